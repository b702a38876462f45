#pragma once

#include <cstdint>
#include <ctime>

#include "core/time.hpp"

/// The kernel stamps datagrams and PPS edges on CLOCK_REALTIME, images and USB transfers on CLOCK_MONOTONIC; hueline's
/// HostTime is CLOCK_MONOTONIC_RAW. Sources convert at once, here, and nobody behind them sees another clock of the
/// computer.
namespace hueline::drivers {

/// Clocks that stamps come on.
enum class KernelClock : std::uint8_t {
  Realtime,   ///< CLOCK_REALTIME: SO_TIMESTAMPNS, PPS_FETCH. May step and is slewed by NTP/PTP.
  Monotonic,  ///< CLOCK_MONOTONIC: V4L2, libusb, input events. Never steps; slewed.
};

/// CLOCK_MONOTONIC_RAW now. Thread-safe.
HostTime host_now();

/// HostTime = stamp + offset, both in ns. `half_window` bounds the error of the pair of readings it was made from.
struct ClockOffset {
  nanoseconds offset{0};
  nanoseconds half_window{0};
};

/// Reads CLOCK_MONOTONIC_RAW before and after the other clock, several times, and keeps the pair with the smallest
/// window (typically below 100 ns; a preempted reading is outvoted). Thread-safe; about 1 us.
ClockOffset sample_clock_offset(KernelClock clock);

/// Converts a stamp made shortly before this call. The offset is sampled at the call, so a stamp t old carries the two
/// clocks' relative rate (slewing: at most 500 ppm) times t: 0.5 us for a stamp 1 ms old. A step of CLOCK_REALTIME
/// between the stamp and the call shifts the result by the step: such stamps come out in the future or far in the past,
/// and sync/ refuses them. Thread-safe.
HostTime to_host_time(nanoseconds stamp, KernelClock clock);
HostTime to_host_time(const std::timespec& stamp, KernelClock clock);

/// For a batch of stamps with one sampled offset.
constexpr HostTime to_host_time(nanoseconds stamp, const ClockOffset& offset) {
  return HostTime(stamp + offset.offset);
}

constexpr nanoseconds to_nanoseconds(const std::timespec& t) {
  return nanoseconds(static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + static_cast<std::int64_t>(t.tv_nsec));
}

}  // namespace hueline::drivers
