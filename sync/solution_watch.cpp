#include "sync/solution_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace hueline::sync {
namespace {

constexpr std::size_t kSteps = 15;
// In usual steps. Logs of two rates and alternating stamps are usual; two missing solutions in a row are not.
constexpr double kGap = 2.5;

}  // namespace

std::uint64_t SolutionWatch::add(const InsSolution& solution, FaultLog& faults) {
  if (!solution.is_good)
    faults.add(solution.sensor, FaultKind::Implausible, "not good", solution.received,
               "navigation solutions that the receiver itself does not trust: recorded, not used");
  const nanoseconds step = last_ ? solution.time - *last_ : nanoseconds(0);
  if (!last_ || step > nanoseconds(0) || step < std::chrono::seconds(-1)) last_ = solution.time;
  if (step <= nanoseconds(0)) return 0;
  std::uint64_t missing = 0;
  std::vector<nanoseconds> sorted(steps_.begin(), steps_.end());
  if (sorted.size() == kSteps) {
    std::nth_element(sorted.begin(), sorted.begin() + kSteps / 2, sorted.end());
    const double steps = to_nanoseconds(step) / to_nanoseconds(sorted[kSteps / 2]);
    if (steps > kGap) {
      missing = static_cast<std::uint64_t>(std::llround(steps) - 1);
      faults.add(solution.sensor, FaultKind::Silent, "ins", solution.received,
                 fmt::format("no navigation solution for {:.3f} s: what was measured there cannot be placed",
                             to_seconds(step)));
    }
  }
  steps_.push_back(step);
  if (steps_.size() > kSteps) steps_.pop_front();
  return missing;
}

}  // namespace hueline::sync
