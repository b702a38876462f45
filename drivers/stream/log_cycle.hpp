#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// Counts how many messages of one log are missing, from the times in their headers. A log that the receiver outputs at
/// a fixed rate steps by exactly its period, however long its way to this computer takes. The period is learned from
/// the log itself.
/// Thread safety: none; one thread calls all functions.
///
/// A gap counts only after four later messages, two of which came one period apart: a lower rate makes gaps as well,
/// but no step of one period. A message that comes late within these four fills its gap. The class forgets everything
/// and learns again when the step is no multiple of the period, is longer than a minute, or repeats 16 times; when the
/// time stands still or falls; and when it jumps ahead of the arrivals, because a message never arrives before its
/// time. These signs mean another rate, a restart or another clock.
class LogCycle {
 public:
  /// A step of the times that is longer than the period.
  struct Gap {
    GpsTime before{}, after{};  ///< times of the messages on both sides
    std::uint64_t missing = 0;
  };

  /// Takes the time of a message. Returns the gap before it, if there is one. The gap does not count yet; see
  /// settled().
  std::optional<Gap> take(GpsTime time, HostTime received);
  /// Takes `logs` messages off the newest gap, because they came broken or were never sent.
  void excuse(std::uint64_t logs);
  /// Returns the oldest gap that counts, without the messages that came late. Call it again until it returns nothing.
  std::optional<Gap> settled();
  /// Ends the log: gaps that no later message could confirm count from now on.
  void finish();
  /// Returns the period. Returns nothing if it is not known yet, or if the log has none.
  std::optional<nanoseconds> period() const { return period_; }

 private:
  struct Trial {
    Gap gap;
    int followed = 0;           ///< number of messages that came after the gap
    bool is_confirmed = false;  ///< two of them came one period apart
  };
  bool fills(GpsTime time);
  void begin(GpsTime time, HostTime received);
  int equal_steps(nanoseconds step);
  void settle();

  std::optional<GpsTime> last_;
  std::optional<nanoseconds> period_;
  nanoseconds step_{0};  // the latest
  int equal_ = 0;        // number of equal steps in a row
  // Smallest recent difference between arrival and time; the two scales have different zeros, so only its changes have
  // a meaning.
  nanoseconds earliest_{};
  std::deque<Trial> trials_;
};

}  // namespace hueline::drivers
