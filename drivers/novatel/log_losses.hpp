#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/fault.hpp"
#include "drivers/novatel/log_cycle.hpp"
#include "drivers/novatel/message_table.hpp"
#include "drivers/novatel/wire.hpp"

namespace hueline::drivers {

/// Which logs of a receiver never came. NovAtel's logs have no counter: each that comes at a fixed rate has its
/// LogCycle.
///
/// Not lost is what came broken: bytes passed over between two logs account for as many of the missing ones as they may
/// have been. Nor what the receiver did not give out: the inertial filter's logs, when many of them are missing in a
/// row while others came all along, and the line lost none of them lately. Marks are told by the images that miss them.
/// Thread-bound.
class LogLosses {
 public:
  /// A message whose check sum held, in stream order. `info`: of its id, null if it has no name.
  void take(const NovatelMessage& message, const NovatelMessageInfo* info, GpsTime time);
  /// So many bytes in a row belonged to nothing; so many messages began among them.
  void skipped(std::uint64_t bytes, std::uint64_t messages);
  /// The receiver's clock is not fine, or the stream was cut: what comes next follows on nothing.
  void forget();
  /// The end of the stream.
  void finish();
  /// What is lost, with the logs' names, at most once a second; at the end at once.
  std::optional<Fault> told(SensorId sensor, HostTime now, bool is_end = false);

 private:
  static constexpr std::uint64_t kWhole = 32;  ///< logs without a loss: the line is whole
  struct Log {
    const NovatelMessageInfo* info = nullptr;
    std::uint8_t antenna = 0;
    LogCycle cycle;
    std::uint64_t newest = 0;  ///< its place in the stream
    std::size_t wire_bytes = 0;
    std::uint64_t since_loss = kWhole;  ///< logs since the line lost one, as far as it matters
  };
  struct Damage {
    std::uint64_t place = 0, bytes = 0, messages = 0;  ///< not accounted for by a missing log
  };
  struct Seen {
    std::uint64_t place = 0;
    GpsTime time{};
  };
  std::uint64_t came_broken(const Log& log, std::uint64_t missing);
  bool was_held_back(const Log& log, const LogCycle::Gap& gap) const;
  void settle(Log& log);

  std::unordered_map<std::uint32_t, Log> logs_;  // by id and antenna
  std::uint64_t place_ = 0;                      // of the newest message in the stream
  std::deque<Damage> damage_;
  std::array<Seen, 64> seen_{};  // the newest messages: a ring
  std::size_t next_seen_ = 0;
  std::optional<LogCycle::Gap> held_back_;     // the filter's logs, the latest time
  std::map<std::string, std::uint64_t> lost_;  // not told yet, by name
  std::optional<HostTime> told_at_;
};

}  // namespace hueline::drivers
