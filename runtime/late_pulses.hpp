#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/measurements.hpp"
#include "sync/host_clock_model.hpp"

namespace hueline::runtime {

/// Whether the pulses come after their seconds, as those of an inverted PPS do. The messages of the POS tell: none can
/// arrive before its own time, and none takes three quarters of a second. Reads no clock. Thread safety: none.
class LatePulses {
 public:
  /// Takes an edge of the PPS.
  void on_edge(HostTime edge) { last_edge_ = edge; }
  /// Takes the arrival of a message of the POS. Its delay is that by the clock, or by the last pulse as long as the
  /// clock is not locked; it then lacks the whole seconds.
  void on_arrival(const TimedArrival& arrival, const sync::HostClockModel& clock);
  /// Ends a half second.
  void roll();

  /// How late the pulses are.
  struct Found {
    nanoseconds late{};      ///< or more
    bool is_certain = true;  ///< the clock runs by these pulses
  };
  /// Judges the last two and a half seconds. `was_locked`: the clock has been locked, so single pulses do not tell any
  /// more. Nothing: the pulses are not late, or too few messages have come.
  std::optional<Found> judge(bool was_locked) const;

 private:
  /// The smallest delay of the messages in each of the last half seconds, ns.
  struct Delays {
    std::array<std::int64_t, 5> least{};
    std::array<int, 5> counts{};
    void add(std::int64_t delay_ns);
    void roll();
    bool are_known() const;
  };

  std::optional<HostTime> last_edge_;
  Delays by_clock_, by_pulse_;
};

}  // namespace hueline::runtime
