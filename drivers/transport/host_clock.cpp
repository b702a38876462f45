#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

constexpr int kReadings = 5;
// A reading through the vDSO takes 20-50 ns, so two of them around a third take at most this.
constexpr nanoseconds kGoodWindow{150};

nanoseconds read_clock(clockid_t id) {
  std::timespec t{};
  ::clock_gettime(id, &t);
  return to_nanoseconds(t);
}

clockid_t clock_id(KernelClock clock) { return clock == KernelClock::Realtime ? CLOCK_REALTIME : CLOCK_MONOTONIC; }

}  // namespace

HostTime host_now() { return HostTime(read_clock(CLOCK_MONOTONIC_RAW)); }

ClockOffset sample_clock_offset(KernelClock clock) {
  ClockOffset best{nanoseconds(0), nanoseconds::max()};
  for (int i = 0; i < kReadings; ++i) {
    const nanoseconds before = read_clock(CLOCK_MONOTONIC_RAW);
    const nanoseconds stamp = read_clock(clock_id(clock));
    const nanoseconds after = read_clock(CLOCK_MONOTONIC_RAW);
    const nanoseconds window = after - before;
    if (window / 2 < best.half_window) best = {before + window / 2 - stamp, window / 2};
    if (window <= kGoodWindow) break;
  }
  return best;
}

HostTime to_host_time(nanoseconds stamp, KernelClock clock) { return to_host_time(stamp, sample_clock_offset(clock)); }

HostTime to_host_time(const std::timespec& stamp, KernelClock clock) {
  return to_host_time(to_nanoseconds(stamp), clock);
}

}  // namespace hueline::drivers
