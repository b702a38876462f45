#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "core/fault.hpp"

namespace hueline::runtime {

/// The one promise about how often faults are told: a trouble at once, a run of it then at most once an interval with
/// its count, and no unit missing from the sum of the counts. Faults are the same trouble if sensor, kind and the words
/// of their detail are the same, whatever numbers stand among the words; of one sensor and kind at most kTroubles are
/// told apart, the others together. So what it holds is bounded, and a flood gives at most kTroubles + 1 faults an
/// interval. Reads no clock. Thread-bound.
class FaultRate {
 public:
  static constexpr std::size_t kTroubles = 8;

  explicit FaultRate(nanoseconds interval = std::chrono::seconds(1)) : interval_(interval) {}

  /// `now`: of the stream; must not fall from call to call.
  void add(Fault fault, HostTime now);
  /// Time passes: what was held for an interval is told, with the detail of the newest.
  void advance(HostTime now);
  /// The end: everything held is told.
  void flush();
  /// Could not be told after all: counts again as held.
  void take_back(Fault fault);
  /// What is to be told now.
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
    Fault held{kSystemSensor, FaultKind::Malformed, {}, 0, {}};  // count 0: nothing
  };
  Entry& entry_of(const Fault& fault, HostTime now);
  void tell(Entry& entry, HostTime now);

  nanoseconds interval_;
  std::map<Key, Entry> entries_;
  std::vector<Fault> ready_;
  std::optional<HostTime> due_;  // no entry is due before
};

}  // namespace hueline::runtime
