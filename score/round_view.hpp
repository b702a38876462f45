#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// The coloured cloud as seen all around from one place: as the program coloured it, as it truly is, and how far apart
/// the two are. Wrong surfaces show as the shadow that a near thing's colour throws on what is behind it. Thread-bound.
class RoundView {
 public:
  static constexpr int kWidth = 760, kHeight = 300;  ///< equirectangular: 360 deg wide, from kTop_deg down
  static constexpr double kTop_deg = 62;

  /// `T_enu_head`: where one looks from; forward is the picture's middle.
  explicit RoundView(const sim::Pose& T_enu_head);
  void add(sim::Vec3 place_enu, std::array<std::uint8_t, 3> claimed, std::array<std::uint8_t, 3> truth,
           double difference);
  /// Three pictures.
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
