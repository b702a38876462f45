#pragma once

#include <chrono>
#include <cstdint>

/// Time bases are types: an instant of one clock cannot be compared with, or assigned to, an instant of another.
/// Durations are std::chrono durations everywhere; no double holds an absolute time.
namespace hueline {

using std::chrono::nanoseconds;

/// A clock known only by its tag. Nobody can ask it for "now": time is passed in.
template <class Tag>
struct TimeBase {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = nanoseconds;
  using time_point = std::chrono::time_point<TimeBase>;
  static constexpr bool is_steady = true;
};

/// The capture computer's CLOCK_MONOTONIC_RAW, ns since boot. What the kernel stamped on another clock is converted to
/// it in the source that read it (drivers/transport/host_clock.hpp). Steps of the wall clock do not touch it.
using HostTime = TimeBase<struct HostTag>::time_point;

/// GPS time: continuous, ns since 1980-01-06T00:00:00 UTC, no leap seconds. The only base after sync/.
using GpsTime = TimeBase<struct GpsTag>::time_point;

/// Unix time: ns since 1970-01-01T00:00:00 UTC, leap seconds not counted. Only for what devices say and files hold
/// (core/calendar.hpp).
using UnixTime = TimeBase<struct UnixTag>::time_point;

/// A device's own counter, one type a counter.
template <class Device>
using DeviceTime = typename TimeBase<Device>::time_point;

/// A camera's free-running counter, ns from its power-up or from whatever the camera latched it to.
struct CameraCounter {};
/// A CAN adapter's own free-running counter, ns from whatever its driver lets it begin.
struct CanAdapterCounter {};

/// A value with the instant of the physical event it belongs to and the one-sigma uncertainty of that instant.
template <class T>
struct Stamped {
  GpsTime time;
  nanoseconds sigma;
  T value;
};

constexpr double to_seconds(nanoseconds d) { return static_cast<double>(d.count()) * 1e-9; }
/// Rounds to the nearest nanosecond (half away from zero).
constexpr nanoseconds from_seconds(double s) {
  return nanoseconds(static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5)));
}

constexpr HostTime host_time_ns(std::int64_t ns) { return HostTime(nanoseconds(ns)); }
constexpr GpsTime gps_time_ns(std::int64_t ns) { return GpsTime(nanoseconds(ns)); }
template <class TimePoint>
constexpr std::int64_t count_ns(TimePoint t) {
  return t.time_since_epoch().count();
}

/// How far a clock model may be trusted; the names of linuxptp's servo, plus Holdover.
enum class SyncState : std::uint8_t { Unlocked, Acquiring, Locked, Holdover };
constexpr const char* name(SyncState s) {
  switch (s) {
    case SyncState::Unlocked:
      return "Unlocked";
    case SyncState::Acquiring:
      return "Acquiring";
    case SyncState::Locked:
      return "Locked";
    case SyncState::Holdover:
      return "Holdover";
  }
  return "?";
}

}  // namespace hueline
