#pragma once

#include <array>
#include <cstdint>

#include "score/figures.hpp"

namespace hueline::score {

/// How well the points say which of them lie on things that move by themselves, over all points with a truth. The
/// definitions are those of the public benchmark of dynamic-point removal (KTH-RPL/DynamicMap_Benchmark). Thread
/// safety: none.
class MotionFigures {
 public:
  /// A point counts as moving from this confidence on: more likely than not.
  static constexpr int kMoving = 128;

  /// Adds a point. `confidence` is ColouredPoint::moving.
  void add(bool is_truly_moving, std::uint8_t confidence);
  /// Adds the figures static_accuracy, dynamic_accuracy and associated_accuracy and their chart.
  void report(ScenarioScore& score) const;

 private:
  using Histogram = std::array<std::uint64_t, 256>;  // points by confidence
  Histogram static_{}, dynamic_{};
};

}  // namespace hueline::score
