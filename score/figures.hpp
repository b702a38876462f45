#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hueline::score {

/// One value of the sheet, or the reason why there is none.
struct Figure {
  std::optional<double> value;
  std::string reason;  ///< empty if there is a value
};
/// Figures by the name of their metric (metric_table.hpp).
using Figures = std::map<std::string, Figure>;

/// A chart of figures. Curves are drawn in the given order, which also decides their colours.
struct Chart {
  enum class Kind { Lines, Bars, Points };
  /// A curve, a set of bars or a set of points.
  struct Curve {
    std::string label;
    std::vector<std::pair<double, double>> points;  ///< x, y
    std::vector<double> plus_minus;                 ///< Points: half the height of each point's bar; empty: no bars
  };
  std::string title, x_label, y_label;
  Kind kind = Kind::Lines;
  bool is_x_logarithmic = false;
  std::vector<std::string> bar_names;  ///< Bars: name of each x = 0, 1, 2 ...
  std::vector<Curve> curves;
};

/// A picture in 8-bit RGB; rows run from the top.
struct Picture {
  std::string caption;
  int width = 0, height = 0;
  std::vector<std::array<std::uint8_t, 3>> pixels;
};

/// One scenario of a sheet.
struct ScenarioScore {
  std::string scenario;
  Figures figures;
  std::vector<Chart> charts;
  std::vector<Picture> pictures;
  std::vector<std::string> notes;  ///< sentences for the reader: samples, what was excluded
};
using Sheet = std::vector<ScenarioScore>;

}  // namespace hueline::score
