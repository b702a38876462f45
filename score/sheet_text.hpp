#pragma once

#include <string>
#include <vector>

#include "score/comparison.hpp"
#include "score/metric_table.hpp"

namespace hueline::score {

/// Returns a figure with the digits that suit its metric; a dash if there is no value.
std::string digits(const Metric& metric, const Figure& figure);
/// Returns a table with a row for each metric and a column for each scenario.
std::string terminal_table(const Sheet& sheet);
/// Returns the same table for docs/score.md.
std::string markdown_table(const Sheet& sheet);
/// Returns what got better and worse, and a line that counts the rest.
std::string terminal_changes(const std::vector<Change>& changes);

}  // namespace hueline::score
