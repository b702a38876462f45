#pragma once

#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/fault.hpp"

namespace hueline::sync {

/// Limits the rate of repeated faults without losing any count. A fault is reported at once, and then at most once
/// every `interval`, with the count since the last report. So a spurious edge every second gives one line in ten
/// seconds. Thread safety: one thread per object.
///
/// The reports pass through runtime::FaultRate afterwards, which has another task. It bounds floods of every kind of
/// fault, one second each, and recognises a trouble by the words of its detail. Here the code names the trouble by its
/// topic, so a detail may change its words, and a trouble that lasts for the whole drive gives a line in ten seconds
/// instead of one a second.
class FaultLog {
 public:
  explicit FaultLog(nanoseconds interval = std::chrono::seconds(10)) : interval_(interval) {}

  /// Adds a fault. `topic` separates faults of the same sensor and kind. The report contains the newest `detail`.
  void add(SensorId sensor, FaultKind kind, const char* topic, HostTime time, std::string detail,
           std::uint64_t count = 1) {
    Entry& entry = entries_[{sensor, kind, topic}];
    entry.count += count;
    entry.detail = std::move(detail);
    entry.time = time;
    if (!entry.told || time - entry.told_at >= interval_) tell(sensor, kind, entry);
  }
  /// Reports everything that is not reported yet. Call it at the end of the stream.
  void flush() {
    for (auto& [key, entry] : entries_)
      if (entry.count > 0) tell(std::get<0>(key), std::get<1>(key), entry);
  }
  /// Moves the reports to the end of `out`.
  void drain(std::vector<Fault>& out) {
    for (Fault& fault : ready_) out.push_back(std::move(fault));
    ready_.clear();
  }

 private:
  struct Entry {
    std::uint64_t count = 0;
    std::string detail;
    HostTime time{}, told_at{};
    bool told = false;
  };
  void tell(SensorId sensor, FaultKind kind, Entry& entry) {
    ready_.push_back({sensor, kind, entry.time, entry.count, entry.detail});
    entry.count = 0;
    entry.told = true;
    entry.told_at = entry.time;
  }
  nanoseconds interval_;
  std::map<std::tuple<SensorId, FaultKind, std::string>, Entry> entries_;
  std::vector<Fault> ready_;
};

}  // namespace hueline::sync
