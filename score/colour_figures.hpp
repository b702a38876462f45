#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "score/ciede2000.hpp"
#include "score/figures.hpp"
#include "sim/judge.hpp"

namespace hueline::score {

/// The figures of the points' colours against the truth, over all coloured points. Thread safety: none.
class ColourFigures {
 public:
  /// Adds a point. `difference` is the CIEDE2000 difference of `claimed` and `truth`.
  void add(std::uint32_t exposure, Lab claimed, Lab truth, double difference);
  /// Adds the figures colour_de00_* and frame_swing_L and their charts.
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

/// Returns points of the cumulative distribution of a Spread, in %, for a chart.
Chart::Curve distribution(const std::string& label, const sim::Spread& spread);

}  // namespace hueline::score
