#include "drivers/pps/edge_placer.hpp"

namespace hueline::drivers {

namespace {

// The kernel slews by at most 500 ppm. The rest allows for the oscillator steering that NTP adds.
constexpr std::int64_t kLargestSlewPpm = 600;
// Readings bound their own error by half_window. This allows for the granularity of the two clocks.
constexpr nanoseconds kSlack = std::chrono::microseconds(1);

// Returns by how much two readings may differ, or be wrong about an edge between them, if nobody set the clock.
nanoseconds tolerance(const ClockReading& before, const ClockReading& after) {
  return before.offset.half_window + after.offset.half_window + kSlack +
         (after.at - before.at) / 1'000'000 * kLargestSlewPpm;
}

// Interpolates the offset at the edge: slewing is even between the readings.
HostTime interpolate(nanoseconds stamp, const ClockReading& before, const ClockReading& after) {
  const HostTime by_later = to_host_time(stamp, after.offset);
  const double span = to_seconds(after.at - before.at), age = to_seconds(after.at - by_later);
  if (span <= 0) return by_later;
  const double slewed = to_seconds(after.offset.offset - before.offset.offset);
  return by_later - from_seconds(slewed * age / span);
}

}  // namespace

std::optional<nanoseconds> step_between(const ClockReading& before, const ClockReading& after) {
  // The offset converts CLOCK_REALTIME to HostTime, so it falls when the clock is set forward.
  const nanoseconds step = before.offset.offset - after.offset.offset;
  if (std::chrono::abs(step) <= tolerance(before, after)) return std::nullopt;
  return step;
}

std::optional<HostTime> place_edge(nanoseconds stamp, const ClockReading& before, const ClockReading& after) {
  const nanoseconds slack = tolerance(before, after);
  const auto if_between = [&](HostTime t) -> std::optional<HostTime> {
    if (t < before.at - slack || t > after.at + slack) return std::nullopt;
    return t;
  };
  if (!step_between(before, after)) return if_between(interpolate(stamp, before, after));
  const auto by_earlier = if_between(to_host_time(stamp, before.offset));
  const auto by_later = if_between(to_host_time(stamp, after.offset));
  if (by_earlier && by_later) return std::nullopt;
  return by_later ? by_later : by_earlier;
}

}  // namespace hueline::drivers
