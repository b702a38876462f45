#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/fault.hpp"
#include "drivers/stream/log_cycle.hpp"

namespace hueline::drivers {

/// Finds out which messages of a receiver never arrived, for protocols without a counter: each message with a fixed
/// rate has its own LogCycle. Messages that came broken are not lost: bytes that were skipped between two messages
/// explain as many missing ones as they can have been.
/// Thread safety: none; one thread calls all functions.
class CycleWatch {
 public:
  /// Takes a message by its name, with its time and its size.
  void take(const std::string& name, GpsTime time, std::size_t bytes, HostTime received);
  /// Takes a run of `bytes` that belonged to no message, in which `messages` messages began.
  void skipped(std::uint64_t bytes, std::uint64_t messages);
  /// Forgets the periods, because the stream was interrupted or the receiver's clock was set.
  void forget() { logs_.clear(); }
  /// Ends the stream.
  void finish();
  /// Returns a Fault Lost with the names and numbers of the messages that were lost since the last one, at most once a
  /// second; at the end of the stream (`is_end`) at once.
  std::optional<Fault> told(SensorId sensor, HostTime now, bool is_end = false);

 private:
  struct Log {
    LogCycle cycle;
    std::uint64_t skipped_bytes = 0, skipped_messages = 0;  // since its latest message
  };
  void settle(const std::string& name, Log& log);

  std::map<std::string, Log> logs_;
  std::map<std::string, std::uint64_t> lost_;  // not reported yet
  std::optional<HostTime> told_at_;
};

}  // namespace hueline::drivers
