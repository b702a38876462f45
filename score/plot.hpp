#pragma once

#include <string>

#include "score/figures.hpp"

namespace hueline::score {

/// Returns an inline <svg> of a chart, 380 x 230 px, readable on light and dark pages. Text is escaped. A chart without
/// points says that it has none.
std::string svg(const Chart& chart);

}  // namespace hueline::score
