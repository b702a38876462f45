#pragma once

#include <string>
#include <vector>

#include "score/comparison.hpp"
#include "score/metric_table.hpp"

namespace hueline::score {

/// A figure with the digits that its metric carries; a dash for none.
std::string digits(const Metric& metric, const Figure& figure);
/// Metrics down, scenarios across.
std::string terminal_table(const Sheet& sheet);
/// The same for docs/score.md.
std::string markdown_table(const Sheet& sheet);
/// What got better and worse, and one line that counts the rest.
std::string terminal_changes(const std::vector<Change>& changes);

}  // namespace hueline::score
