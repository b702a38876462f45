#pragma once

#include <cstdint>
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
  double interval_ns_ = 0;           ///< of the latest packet
  std::vector<std::int32_t> times_;  ///< of the firings of such a packet
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
