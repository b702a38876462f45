#pragma once

#include <span>
#include <string>

namespace hueline::score {

enum class Better {
  Lower,
  Higher,
  Target,       ///< the nearer to Metric::target
  Informative,  ///< shown, never called better or worse
};

const char* name(Better better);

/// What a metric is, which way is better, and how far two versions may differ before anyone says so. docs/score.md has
/// the same list.
struct Metric {
  const char* name;
  const char* unit;
  const char* meaning;  ///< what is counted over which sample
  Better better;
  double target;          ///< Better::Target
  double noise;           ///< differences up to this are noise ...
  double relative_noise;  ///< ... and up to this share of the old value
  bool is_wall_clock;     ///< measured on this machine: differs from run to run
};

/// In the order of the sheet.
std::span<const Metric> metrics();
/// nullptr: no such metric.
const Metric* find_metric(const std::string& name);
/// Largest difference from `old_value` that counts as noise.
double noise_of(const Metric& metric, double old_value);

}  // namespace hueline::score
