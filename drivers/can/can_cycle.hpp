#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// Learns the period of a message that its control unit sends regularly, from the latest intervals. With it, losses of
/// messages without a counter can be found, and how often a counter wrapped meanwhile.
/// Thread safety: none; one thread calls all functions.
class CanCycle {
 public:
  /// Takes a message. Returns how many messages should have come since the one before and did not. Returns 0 until the
  /// period is known, and for messages without a period (they are sent when something changes, or a gateway sends them
  /// in groups).
  std::int64_t take(HostTime received);
  /// Returns the period in seconds. Returns nothing if it is not known or if there is none.
  std::optional<double> period_s() const;

 private:
  std::array<std::int64_t, 64> intervals_ns_{};  // the latest intervals, as a ring
  std::size_t count_ = 0;                        // number of all intervals so far
  std::optional<HostTime> last_;
};

}  // namespace hueline::drivers
