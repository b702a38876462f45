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
    /// How many did not come behind their gap either. Nothing as long as they may still come, or no period is known.
    std::optional<std::int64_t> missing;
  };
  /// Takes a message. A gap is of messages that are lost, or of messages that waited on their way (in an adapter, or in
  /// a computer that was busy) and come sooner behind it, all at once or as the computer finds the time. So what is
  /// missing is told when eight messages in a row have come at their time. Returns an empty Gap until the period is
  /// known, and for messages without a period (they are sent when something changes, or a gateway sends them in
  /// groups).
  Gap take(HostTime received);
  /// Waits no longer, for the stream ends. Returns how many of what is waited for are missing.
  std::int64_t settle();
  /// Returns when the latest message came. Returns nothing before the first.
  std::optional<HostTime> last() const { return last_; }
  /// Returns the period in seconds. Returns nothing if it is not known or if there is none.
  std::optional<double> period_s() const;

 private:
  struct Wait {
    double period_s = 0;    // as it was before the gap: what comes late says nothing of it
    double count = 0;       // messages, in periods: what the gaps were too long, less what came sooner behind them
    int on_time = 0;        // messages in a row
    std::int64_t left = 0;  // messages; if none settles it, this is no gap but another period
  };

  std::array<std::int64_t, 64> intervals_ns_{};  // the latest intervals outside of gaps, as a ring
  std::size_t count_ = 0;                        // number of all intervals so far
  std::optional<HostTime> last_;
  std::optional<Wait> wait_;
};

}  // namespace hueline::drivers
