#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// How often a message comes that its control unit sends regularly, learned from the message itself: from
/// its latest intervals. It tells losses of messages without a counter, and how often a counter went round meanwhile.
/// Thread-bound.
class CanCycle {
 public:
  /// A message came: how many should have come since the one before and did not. 0 until the cycle is known, and for
  /// messages without one (sent when something changes; or a gateway hands them on in heaps).
  std::int64_t take(HostTime received);
  /// Without value: not known, or there is none.
  std::optional<double> period_s() const;

 private:
  std::array<std::int64_t, 64> intervals_ns_{};  // a ring
  std::size_t count_ = 0;                        // in all
  std::optional<HostTime> last_;
};

}  // namespace hueline::drivers
