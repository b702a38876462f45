#pragma once

#include <cstdint>
#include <ctime>

#include "core/time.hpp"

/// Converts the kernel's time stamps to HostTime. The kernel stamps datagrams and PPS edges on CLOCK_REALTIME, images
/// and USB transfers on CLOCK_MONOTONIC. HostTime is CLOCK_MONOTONIC_RAW. Every source converts a stamp at once, so the
/// rest of the program sees one clock of the computer only.
namespace hueline::drivers {

/// The clocks on which the kernel makes time stamps.
enum class KernelClock : std::uint8_t {
  Realtime,   ///< CLOCK_REALTIME: SO_TIMESTAMPNS, PPS_FETCH. It may step, and NTP or PTP slews it.
  Monotonic,  ///< CLOCK_MONOTONIC: V4L2, libusb, input events. It never steps, but it is slewed.
};

/// Returns CLOCK_MONOTONIC_RAW now. Thread-safe.
HostTime host_now();

/// The offset of one clock: HostTime = stamp + offset, in ns. The offset comes from a pair of readings; its error is at
/// most `half_window`.
struct ClockOffset {
  nanoseconds offset{0};
  nanoseconds half_window{0};
};

/// Reads CLOCK_MONOTONIC_RAW before and after the other clock, several times, and keeps the reading with the smallest
/// window (typically below 100 ns). This discards a reading during which the thread was preempted. Takes about 1 us.
/// Thread-safe.
ClockOffset sample_clock_offset(KernelClock clock);

/// Converts a stamp that was made shortly before this call. The offset is sampled during the call. So the result for a
/// stamp of age t is wrong by t times the relative rate of the two clocks (at most 500 ppm while slewing): 0.5 us for a
/// stamp that is 1 ms old. If CLOCK_REALTIME steps between the stamp and the call, the result is wrong by the step.
/// Such times lie in the future or far in the past, and sync/ refuses them. Thread-safe.
HostTime to_host_time(nanoseconds stamp, KernelClock clock);
HostTime to_host_time(const std::timespec& stamp, KernelClock clock);

/// Converts a stamp with an offset that was sampled before. Use it for several stamps of one read.
constexpr HostTime to_host_time(nanoseconds stamp, const ClockOffset& offset) {
  return HostTime(stamp + offset.offset);
}

constexpr nanoseconds to_nanoseconds(const std::timespec& t) {
  return nanoseconds(static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + static_cast<std::int64_t>(t.tv_nsec));
}

}  // namespace hueline::drivers
