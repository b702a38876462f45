#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/fault.hpp"

namespace hueline::drivers {

/// At most one Fault an interval for one kind of trouble, so that a flood of bad datagrams does not become a flood of faults;
/// each Fault's count covers those held back before it. Time is the packets' own: the same input gives the same faults.
/// Thread-bound.
class FaultLimiter {
 public:
  FaultLimiter(FaultKind kind, SensorId sensor, nanoseconds interval = std::chrono::seconds(1))
      : kind_(kind), sensor_(sensor), interval_(interval) {}

  /// `count` more units, seen on a packet received at `time`. `detail` is a callable: text is made only when it is shown.
  template <class Detail>
  std::optional<Fault> add(HostTime time, std::uint64_t count, Detail&& detail) {
    held_ += count;
    if (last_ && !is_over(time)) return {};
    detail_ = std::forward<Detail>(detail)();
    return release(time);
  }

  /// What is held back, once the interval is over, with the detail of the latest that was told. Call on each good packet.
  std::optional<Fault> flush(HostTime time) {
    if (held_ == 0 || !is_over(time)) return {};
    return release(time);
  }

  /// The end of the stream: what is held back, with the time and the detail of the latest that was told.
  std::optional<Fault> drain() {
    if (held_ == 0) return {};
    return release(*last_);
  }

 private:
  // A clock that fell back must not silence the faults.
  bool is_over(HostTime time) const { return time - *last_ >= interval_ || time < *last_; }
  Fault release(HostTime time) {
    last_ = time;
    return Fault{sensor_, kind_, time, std::exchange(held_, 0), detail_};
  }

  FaultKind kind_;
  SensorId sensor_;
  nanoseconds interval_;
  std::optional<HostTime> last_;
  std::uint64_t held_ = 0;
  std::string detail_;  // of the latest that was told: what is held back is the same trouble
};

}  // namespace hueline::drivers
