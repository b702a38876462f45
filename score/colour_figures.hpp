#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "score/ciede2000.hpp"
#include "score/figures.hpp"
#include "sim/judge.hpp"

namespace hueline::score {

/// Colours of points against truth, over all coloured points. Thread-bound.
class ColourFigures {
 public:
  /// `difference`: ciede2000 of `claimed` and `truth`.
  void add(std::uint32_t exposure, Lab claimed, Lab truth, double difference);
  /// colour_de00_*, frame_swing_L and their charts.
  void report(ScenarioScore& score) const;

 private:
  struct OfExposure {
    std::uint64_t count = 0;
    double lightness_error = 0;
  };
  sim::Spread difference_;
  std::uint64_t over20_ = 0;
  std::map<std::uint32_t, OfExposure> exposures_;
};

/// Points of a Spread's cumulative distribution, in %, for a chart.
Chart::Curve distribution(const std::string& label, const sim::Spread& spread);

}  // namespace hueline::score
