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
  struct Gap {
    std::int64_t before = 0;  ///< how many messages should have come between this one and the one before, and did not
    /// How many of an earlier gap have not come behind it either. Nothing as long as they may still come.
    std::optional<std::int64_t> missing;
  };
  /// Takes a message. A gap is of messages that are lost, or of messages that waited on their way (in an adapter, or in
  /// a computer that was busy) and come at once behind it; so what is missing is told when the first message comes that
  /// did not wait. Returns an empty Gap until the period is known, and for messages without a period (they are sent
  /// when something changes, or a gateway sends them in groups).
  Gap take(HostTime received);
  /// Waits no longer: the stream ends, or a message came that did not wait. Returns how many of the latest gap are
  /// missing.
  std::int64_t settle();
  /// Returns when the latest message came. Returns nothing before the first.
  std::optional<HostTime> last() const { return last_; }
  /// Returns the period in seconds. Returns nothing if it is not known or if there is none.
  std::optional<double> period_s() const;

 private:
  std::array<std::int64_t, 64> intervals_ns_{};  // the latest intervals, as a ring
  std::size_t count_ = 0;                        // number of all intervals so far
  std::optional<HostTime> last_;
  double awaited_ = 0;  // what the latest gap was too long, and what came sooner behind it, in periods
};

}  // namespace hueline::drivers
