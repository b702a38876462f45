#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/fault.hpp"
#include "drivers/novatel/message_table.hpp"
#include "drivers/novatel/wire.hpp"
#include "drivers/stream/log_cycle.hpp"

namespace hueline::drivers {

/// Finds out which logs of a receiver never arrived. NovAtel's logs have no counter, so each log with a fixed rate has
/// its own LogCycle.
///
/// Two kinds of missing logs are not lost. Logs that came broken: bytes that were skipped between two logs explain as
/// many missing logs as they can have been. Logs that the receiver did not output: logs of the inertial filter, if many
/// (8 or more) are missing in a row while other messages came in both halves of the gap, the line lost none of them
/// shortly before, and what it lost of the others meanwhile does not explain the gap by chance.
/// Lost event marks are not found here; the images without a mark show them.
/// Thread safety: none; one thread calls all functions.
class LogLosses {
 public:
  /// Takes a message whose check sum held, in the order of the stream. `info` belongs to its id, and is null if the id
  /// has no name.
  void take(const NovatelMessage& message, const NovatelMessageInfo* info, GpsTime time);
  /// Takes a run of `bytes` that belonged to no message, in which `messages` messages began.
  void skipped(std::uint64_t bytes, std::uint64_t messages);
  /// Forgets the periods, because the receiver's clock is not fine or the stream was interrupted, so the next message
  /// does not continue the earlier ones.
  void forget();
  /// Ends the stream.
  void finish();
  /// Returns a Fault Lost with the names and numbers of the logs that were lost since the last one, at most once a
  /// second. At the end of the stream (`is_end`) it returns them at once.
  std::optional<Fault> told(SensorId sensor, HostTime now, bool is_end = false);

 private:
  static constexpr std::uint64_t kWhole = 32;  ///< so many logs in a row without a loss show that the line is good
  struct Log {
    const NovatelMessageInfo* info = nullptr;
    std::uint8_t antenna = 0;
    LogCycle cycle;
    std::uint64_t newest = 0;      ///< position of its newest message in the stream, in messages
    std::uint64_t lost_until = 0;  ///< lost_of_all_ when it came
    std::size_t wire_bytes = 0;
    std::uint64_t since_loss = kWhole;  ///< logs since the last loss, at most kWhole
  };
  struct Damage {
    /// Position in the stream, and what missing logs have not explained yet.
    std::uint64_t place = 0, bytes = 0, messages = 0;
  };
  struct Seen {
    std::uint64_t place = 0;
    GpsTime time{};
  };
  std::uint64_t came_broken(const Log& log, std::uint64_t missing);
  bool was_held_back(const Log& log, const LogCycle::Gap& gap) const;
  void settle(Log& log);

  std::unordered_map<std::uint32_t, Log> logs_;  // by message id and antenna
  std::uint64_t place_ = 0;                      // position of the newest message in the stream, in messages
  std::uint64_t lost_of_all_ = 0;                // logs that the line lost until now, of all names
  std::deque<Damage> damage_;
  std::array<Seen, 64> seen_{};  // the newest messages, as a ring
  std::size_t next_seen_ = 0;
  std::optional<LogCycle::Gap> held_back_;     // the latest gap in which the receiver output no logs of the filter
  std::map<std::string, std::uint64_t> lost_;  // not reported yet, by the log's name
  std::optional<HostTime> told_at_;
};

}  // namespace hueline::drivers
