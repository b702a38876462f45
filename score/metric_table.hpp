#pragma once

#include <span>
#include <string>

namespace hueline::score {

/// Which values of a metric are better.
enum class Better {
  Lower,
  Higher,
  Target,       ///< values nearer to Metric::target
  Informative,  ///< shown, never called better or worse
};

const char* name(Better better);

/// What a metric is, which values are better, and how far two versions may differ before the difference counts.
/// docs/score.md has the same list.
struct Metric {
  const char* name;
  const char* unit;
  const char* meaning;  ///< what is counted, over which sample
  Better better;
  double target;  ///< of Better::Target
  /// A difference is noise up to the larger of `noise` and `relative_noise` times the old value.
  double noise;
  double relative_noise;
  bool is_wall_clock;  ///< measured on this machine, so it differs from run to run
};

/// Returns all metrics in the order of the sheet.
std::span<const Metric> metrics();
/// Returns the metric of that name, or nullptr if there is none.
const Metric* find_metric(const std::string& name);
/// Returns the largest difference from `old_value` that counts as noise.
double noise_of(const Metric& metric, double old_value);

}  // namespace hueline::score
