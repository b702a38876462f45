#pragma once

#include <string>

#include "score/figures.hpp"

namespace hueline::score {

/// An inline <svg> of a chart, 380 x 230 px, readable in light and dark; text is escaped. A chart without points says
/// so.
std::string svg(const Chart& chart);

/// &, <, > and quotes as HTML wants them.
std::string escaped(const std::string& text);

}  // namespace hueline::score
