#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/measurements.hpp"
#include "core/time.hpp"

namespace hueline::drivers {

/// Compares the clock of a device with the arrivals of its packets. A packet can be late on its way, but not early. So
/// a clock that goes ahead of the arrivals has jumped. One that falls behind them, without going back, may only seem
/// to: a network or a computer that stood still held the packets back, and they come in a burst afterwards. A clock
/// that then stays behind has jumped.
///
/// Differences up to kJitter are neither. Drifts have no effect, because packets are compared with the one before.
/// Thread safety: none.
class ArrivalWatch {
 public:
  static constexpr nanoseconds kJitter = std::chrono::milliseconds(200);
  /// Within this time a burst brings the clock back to the arrivals.
  static constexpr nanoseconds kBurst = std::chrono::seconds(1);

  struct Finding {
    FaultKind kind;     ///< ClockStep; or Silent: nothing came for a while, and what was sent then comes late
    nanoseconds moved;  ///< of the clock against the arrivals
    /// Returns what to tell. `clock` names the device's clock, as in "its counter".
    std::string words(std::string_view clock) const;
  };
  /// Adds a packet that was received `waited` after the one before, and is `passed` later by the device's clock.
  std::optional<Finding> add(nanoseconds passed, nanoseconds waited);
  /// Forgets the packets before.
  void reset() { fallen_.reset(); }

 private:
  struct Fallen {
    nanoseconds behind, since;  // of the clock against the arrivals; time since then
  };
  std::optional<Fallen> fallen_;
};

}  // namespace hueline::drivers
