#pragma once

#include <vector>

#include "core/measurements.hpp"
#include "drivers/livox/livox_wire.hpp"

namespace hueline::drivers {

/// Computes the returns of a packet of points, many firings at a time. It does not deal with faults or clocks.
/// Thread safety: none; one thread calls it, because it owns the scratch space.
class LivoxKernel {
 public:
  LivoxKernel(double min_range_m, double max_range_m);

  /// Replaces `returns` by those of a packet whose firings are `interval_ns` apart. Times count from the first firing.
  void decode(const LivoxPacket& packet, double interval_ns, std::vector<LaserReturn>& returns);

 private:
  float nearest_m_, farthest_m_;
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
