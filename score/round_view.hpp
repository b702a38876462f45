#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// Panoramic views of the coloured cloud from one place: as the program coloured it, as it truly is, and the difference
/// of the two. A wrong surface shows as a shadow with the colour of a near thing on what is behind it. Thread safety:
/// none.
class RoundView {
 public:
  static constexpr int kWidth = 760, kHeight = 300;  ///< equirectangular: 360 deg wide, from kTop_deg down
  static constexpr double kTop_deg = 62;

  /// `T_enu_head` is the pose of the viewer; its forward direction is the middle of the picture.
  explicit RoundView(const sim::Pose& T_enu_head);
  /// Adds a point. `difference` is the CIEDE2000 difference of `claimed` and `truth`.
  void add(sim::Vec3 place_enu, std::array<std::uint8_t, 3> claimed, std::array<std::uint8_t, 3> truth,
           double difference);
  /// Returns the three pictures.
  std::vector<Picture> pictures() const;

 private:
  struct Pixel {
    float distance_m = 1e9f;
    std::array<std::uint8_t, 3> claimed{}, truth{};
    float difference = 0;
  };
  sim::Pose T_head_enu_;
  std::vector<Pixel> pixels_;
};

}  // namespace hueline::score
