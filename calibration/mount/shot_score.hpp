#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "calibration/lens/board.hpp"
#include "calibration/mount/fast_lens.hpp"
#include "calibration/mount/shot_pairs.hpp"

namespace hueline::calibration {

/// The weight of each part of a scene (LaserPair::part).
using PartWeights = std::array<float, kPairParts>;
/// Returns weights of one for all parts.
PartWeights all_parts();

/// Measures how well an image and the pairs of a laser cloud fit together at one width of blur: the mutual information
/// of what the laser sees between two directions and how the image changes between them. The image is freed from slow
/// changes of brightness and contrast first. score() is pure.
class ShotScore {
 public:
  /// Uses at most about `most_pairs` pairs. `blur` is the standard deviation of the blur, rad.
  ShotScore(const GreyImage& image, const LensValues& lens, double max_angle, const std::vector<LaserPair>& pairs,
            double blur, std::size_t most_pairs);

  /// Returns the mutual information in nat for each pair in the image, for a lens rotated by `turn` (rad, about its own
  /// axes). 0 if less than a third of the weight of all pairs falls into the image.
  double score(const Eigen::Vector3d& turn, const PartWeights& weights) const;
  /// Returns the number of pairs that fall into the image.
  std::size_t pairs_in_image(const Eigen::Vector3d& turn) const;
  double blur() const { return blur_; }

 private:
  /// Computes the change of the image between the ends of a pair. Returns false if an end is outside.
  bool change(const Eigen::Matrix3f& R, const LaserPair& pair, float& out) const;
  /// Reads the picture. Returns false outside.
  bool read(const Eigen::Vector3f& p_lens, float& out) const;

  FastLens lens_;
  double blur_;
  float shrink_ = 1;  ///< pixels of the image in one of the picture
  int width_ = 0, height_ = 0;
  std::vector<float> picture_;
  std::vector<LaserPair> pairs_;
};

}  // namespace hueline::calibration
