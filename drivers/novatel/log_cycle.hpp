#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// How many of one log are missing, told from the times in its headers: a log that the receiver gives at a fixed rate
/// steps by exactly its period, whatever its way here took. The period is learned from the log itself. Thread-bound.
///
/// A gap is on trial until a log came one period after another behind it: a lower rate has gaps too, but nothing else.
/// A step that is no multiple of the period, a time that stands or falls, and one that leaps ahead of the arrivals (a
/// log is never here before its time) are a new rate, a restart or another clock: all is forgotten and learned again.
/// So are gaps longer than a minute.
class LogCycle {
 public:
  struct Gap {
    GpsTime before{}, after{};  ///< of the logs on both sides
    std::uint64_t missing = 0;
  };

  /// A log came. The gap that it shows before itself, on trial from now.
  std::optional<Gap> take(GpsTime time, HostTime received);
  /// So many of the newest gap came broken, or were never sent.
  void excuse(std::uint64_t logs);
  /// The oldest gap that is beyond doubt; a log that came late has been taken off it. Ask until there is none.
  std::optional<Gap> settled();
  /// The end of the log: gaps that nothing speaks against are beyond doubt now.
  void finish();
  /// Without value: not known, or it has none.
  std::optional<nanoseconds> period() const { return period_; }

 private:
  struct Trial {
    Gap gap;
    int followed = 0;           ///< by so many logs
    bool is_confirmed = false;  ///< one of them a period after the one before
  };
  bool fills(GpsTime time);
  void begin(GpsTime time, HostTime received);
  int equal_steps(nanoseconds step);
  void settle();

  std::optional<GpsTime> last_;
  std::optional<nanoseconds> period_;
  nanoseconds step_{0};     // the latest
  int equal_ = 0;           // so many in a row were like it
  nanoseconds earliest_{};  // least arrival less time lately: of the two scales' zeros only differences mean anything
  std::deque<Trial> trials_;
};

}  // namespace hueline::drivers
