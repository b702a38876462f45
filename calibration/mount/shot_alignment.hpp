#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/lens/board.hpp"
#include "calibration/lens/lens_values.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Alignment of one image with the laser cloud of the same moment, without targets. Everything here is pure.
namespace hueline::calibration {

/// One image and one cloud of the same moment.
struct Shot {
  LensValues lens;         ///< with the size of the image
  double max_angle = 1.5;  ///< nothing beyond this angle from the axis is projected, rad
  GreyImage image;
  std::vector<Eigen::Vector3f> p_scanner;  ///< returns in the scanner's frame, m; NaN: none
  std::vector<float> intensity;            ///< of each return, of any scale
};

/// Settings of align_shot().
struct ShotAlignmentConfig {
  double search_deg = 3.0;  ///< largest expected error of the start, about each axis
  /// Largest standard deviation of the rotation, all axes together, with which it counts as determined.
  double most_sigma_deg = 0.25;
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// The rotation of a lens, and how certain it is.
struct ShotAlignment {
  Transform<Lens, Scanner> T_lens_scanner;  ///< the start with a new rotation about the centre of the lens
  /// Covariance of the rotation about the lens's axes, rad^2.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double score_start = 0, score = 0;    ///< mutual information, nat for each pair
  double score_elsewhere = 0;           ///< of the best other maximum of the search
  std::size_t pairs = 0, outlines = 0;  ///< number in the image; outlines are a part of the pairs
  int subsets = 0, elsewhere = 0;       ///< parts of the scene searched alone; those that end at another maximum
  /// Why the shot does not determine the rotation, each as a clause. Empty if it does.
  std::vector<std::string> doubts;

  bool is_determined() const { return doubts.empty(); }
  /// Returns the standard deviation of the rotation, all axes together, rad.
  double sigma() const;
};

/// Estimates the rotation of a lens from `start`. The centre of the lens keeps its place in the scanner's frame.
///
/// The score is the mutual information of two changes between neighbouring returns: what the laser sees (the border of
/// something near, a change of reflectivity, neither) and how the image changes. After Pandey et al. (AAAI 2012), who
/// use the values themselves; changes are free of light, shade and incidence, which made single shots end at wrong
/// maxima. A search over a grid keeps several maxima from a wide blur to a narrow one. The covariance comes from
/// balanced half samples (McCarthy 1969) of the blocks of the image, and from leaving out thirds of its width, near and
/// far. Half samples that prefer another maximum show that the shot does not determine the rotation.
/// Errors: Invalid (wrong settings, image or cloud), Unavailable (hardly any return in the image).
Result<ShotAlignment> align_shot(const Shot& shot, const Transform<Lens, Scanner>& start,
                                 const ShotAlignmentConfig& config);

}  // namespace hueline::calibration
