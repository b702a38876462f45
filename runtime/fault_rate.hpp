#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "core/fault.hpp"

namespace hueline::runtime {

/// Limits how often faults are reported. The first fault of a trouble is reported at once; while it lasts, it is
/// reported at most once an interval, with its count. The counts of the reported faults add up to all faults that were
/// given.
///
/// Two faults are the same trouble if their sensor, their kind and the words of their detail are equal; numbers between
/// the words may differ. Of one sensor and kind at most kTroubles are kept apart, and all others share one entry. So
/// the memory is bounded, and a flood gives at most kTroubles + 1 faults an interval. Reads no clock.
/// Thread safety: none; one thread calls all functions.
class FaultRate {
 public:
  static constexpr std::size_t kTroubles = 8;

  explicit FaultRate(nanoseconds interval = std::chrono::seconds(1)) : interval_(interval) {}

  /// Takes a fault. `now` is stream time and must not fall from call to call.
  void add(Fault fault, HostTime now);
  /// Moves time on. Faults that were held for an interval become due, with the detail of the newest.
  void advance(HostTime now);
  /// Makes all held faults due, at the end of the stream.
  void flush();
  /// Takes back a fault that could not be reported. It counts as held again.
  void take_back(Fault fault);
  /// Returns the faults that are due now, and forgets them.
  std::vector<Fault> take();

 private:
  struct Key {
    SensorId sensor;
    FaultKind kind;
    std::string words;
    auto operator<=>(const Key&) const = default;
  };
  struct Entry {
    std::optional<HostTime> told_at;
    Fault held{kSystemSensor, FaultKind::Malformed, {}, 0, {}};  // count 0: nothing is held
  };
  Entry& entry_of(const Fault& fault, HostTime now);
  void tell(Entry& entry, HostTime now);

  nanoseconds interval_;
  std::map<Key, Entry> entries_;
  std::vector<Fault> ready_;
  std::optional<HostTime> due_;  // no entry is due before this time
};

}  // namespace hueline::runtime
