#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hueline::drivers {

/// The ranges that are kept, in steps of a scanner's packets: `count` from `nearest` on.
struct RangeSteps {
  std::uint32_t nearest, count;
};

/// Returns the steps of `step_m` that lie between two ranges, m. A range of 0 steps means "no return", whatever the
/// limits are, and the packets have 16 bits for one.
inline RangeSteps range_steps(double min_range_m, double max_range_m, double step_m) {
  constexpr double kSlack = 1e-6;  // of a step, which the limits are rounded by
  const double nearest = std::max(1.0, std::ceil(min_range_m / step_m - kSlack));
  const double farthest = std::min(65535.0, std::floor(max_range_m / step_m + kSlack));
  return {static_cast<std::uint32_t>(nearest), static_cast<std::uint32_t>(std::max(0.0, farthest - nearest + 1))};
}

}  // namespace hueline::drivers
