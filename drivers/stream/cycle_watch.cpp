#include "drivers/stream/cycle_watch.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace hueline::drivers {

void CycleWatch::take(const std::string& name, GpsTime time, std::size_t bytes, HostTime received) {
  Log& log = logs_[name];
  if (log.cycle.take(time, received)) {
    const std::uint64_t by_bytes = bytes > 0 ? log.skipped_bytes / bytes : 0;
    log.cycle.excuse(std::max(log.skipped_messages, by_bytes));
  }
  log.skipped_bytes = log.skipped_messages = 0;
  settle(name, log);
}

void CycleWatch::skipped(std::uint64_t bytes, std::uint64_t messages) {
  for (auto& [name, log] : logs_) {
    log.skipped_bytes += bytes;
    log.skipped_messages += messages;
  }
}

void CycleWatch::finish() {
  for (auto& [name, log] : logs_) {
    log.cycle.finish();
    settle(name, log);
  }
}

void CycleWatch::settle(const std::string& name, Log& log) {
  while (const auto gap = log.cycle.settled()) lost_[name] += gap->missing;
}

std::optional<Fault> CycleWatch::told(SensorId sensor, HostTime now, bool is_end) {
  if (lost_.empty()) return {};
  if (!is_end && told_at_ && now - *told_at_ < std::chrono::seconds(1)) return {};
  told_at_ = now;
  Fault fault{sensor, FaultKind::Lost, now, 0, "messages that never came, by their period:"};
  for (const auto& [name, number] : lost_) {
    fault.count += number;
    fault.detail += fmt::format(" {} {}", name, number);
  }
  lost_.clear();
  return fault;
}

}  // namespace hueline::drivers
