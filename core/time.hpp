#pragma once

#include <chrono>
#include <cstdint>

/// Instants of time, with one type for each clock. An instant of one clock cannot be compared with an instant of
/// another, nor assigned to it. All durations are std::chrono durations; no double holds an absolute time.
namespace hueline {

using std::chrono::nanoseconds;

/// A clock that is only a tag for the type system. It has no `now()`: every function receives the time that it needs as
/// an argument.
template <class Tag>
struct TimeBase {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = nanoseconds;
  using time_point = std::chrono::time_point<TimeBase>;
  static constexpr bool is_steady = true;
};

/// Time of the capture computer: CLOCK_MONOTONIC_RAW, ns since boot. Steps of the wall clock do not change it. A source
/// whose kernel stamps come from another clock converts them to this one (drivers/transport/host_clock.hpp).
using HostTime = TimeBase<struct HostTag>::time_point;

/// GPS time: ns since 1980-01-06T00:00:00 UTC, continuous, without leap seconds. It is the only time base that is used
/// after sync/.
using GpsTime = TimeBase<struct GpsTag>::time_point;

/// Unix time: ns since 1970-01-01T00:00:00 UTC; leap seconds are not counted. It appears only in what devices send and
/// in what files hold (core/calendar.hpp).
using UnixTime = TimeBase<struct UnixTag>::time_point;

/// Time of a device's own counter. Each counter has its own tag, and so its own type.
template <class Device>
using DeviceTime = typename TimeBase<Device>::time_point;

/// Tag of a camera's free-running counter: ns since the camera's power-up, or since the event at which the camera was
/// set.
struct CameraCounter {};
/// Tag of a CAN adapter's free-running counter: ns since an origin that the adapter's driver chooses.
struct CanAdapterCounter {};

/// A value with the time of the physical event that it belongs to, and one sigma of that time.
template <class T>
struct Stamped {
  GpsTime time;
  nanoseconds sigma;
  T value;
};

constexpr double to_seconds(nanoseconds d) { return static_cast<double>(d.count()) * 1e-9; }
constexpr double to_nanoseconds(nanoseconds d) { return static_cast<double>(d.count()); }
/// Returns whether `low` <= d <= `high`.
constexpr bool is_within(nanoseconds d, nanoseconds low, nanoseconds high) { return d >= low && d <= high; }
/// Rounds to the nearest nanosecond; halves are rounded away from zero.
constexpr nanoseconds from_seconds(double s) {
  return nanoseconds(static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5)));
}

constexpr HostTime host_time_ns(std::int64_t ns) { return HostTime(nanoseconds(ns)); }
constexpr GpsTime gps_time_ns(std::int64_t ns) { return GpsTime(nanoseconds(ns)); }
template <class TimePoint>
constexpr std::int64_t count_ns(TimePoint t) {
  return t.time_since_epoch().count();
}

/// How far a clock model can be trusted. The names are those of linuxptp's servo, plus Holdover.
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
