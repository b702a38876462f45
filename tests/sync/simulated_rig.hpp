#pragma once

#include <map>
#include <vector>

#include "tests/sync/simulated_time.hpp"

/// Scanners, cameras and strobes for a Drive, with their truth and their faults.
namespace hueline::test {

/// A scanner's stamp at an instant of UTC (ns since 1970, leap seconds not counted): what a device whose clock shows
/// that instant sends.
using Stamping = std::function<LaserTime(std::int64_t utc_ns)>;
/// Makes stamps of a counter of microseconds that starts again after each period since 1970.
Stamping counts(nanoseconds period, CounterOrigin origin = CounterOrigin::Utc);
constexpr nanoseconds k32Bits_us{(std::int64_t{1} << 32U) * 1000};
/// Valid while there are 18 leap seconds.
GpsTime of_unix(nanoseconds since_1970);

/// Each kind of stamp that a scanner may have, with an instant at which a counter of that kind starts again.
struct StampKind {
  const char* name;
  Stamping stamp;
  GpsTime begins_anew;
};
std::vector<StampKind> stamp_kinds();

/// A scanner: `rate_hz` packets, each stamped with its first firing.
struct SimulatedLaser {
  SensorId sensor = kLaser;
  double rate_hz = 50;
  seconds leap{18};
  Drive::Shift clock_error = [](GpsTime) { return nanoseconds(0); };  ///< added to the true time before it is stamped
  Drive::Delay latency = [](Random& r, GpsTime) { return ms(1.45 + r.exponential(0.15)); };
  Stamping stamp = counts(std::chrono::hours(1));
  /// The state that the scanner reports.
  std::function<SyncState(GpsTime)> clock = [](GpsTime) { return SyncState::Locked; };
  std::map<std::uint64_t, GpsTime> truth;  ///< by packet sequence

  void run(Drive& drive);
};

/// A camera with a strobe. Each exposure gives a mark at its start (minus `strobe_delay`) and, later, an image.
struct SimulatedCamera {
  SensorId sensor = kCamera;
  int input = 1;
  double rate_hz = 10;
  nanoseconds interval_wobble{0};  ///< distance-triggered cameras are not periodic
  nanoseconds strobe_delay = us(20), exposure = ms(2);
  /// Durations that the camera chooses for itself and reports with its images; one for each part of the image.
  std::function<std::vector<nanoseconds>(int)> reported = [](int) { return std::vector<nanoseconds>(); };
  double stamped_at = 0;  ///< the share of the exposure after which the camera's counter is read
  double clock_ppm = 23, stamp_jitter_us = 3;
  Drive::Delay latency = [](Random& r, GpsTime) { return ms(30 + r.exponential(3)); };
  Drive::Delay mark_latency = late(8, 4);
  std::function<bool(int)> mark_lost = [](int) { return false; };
  std::function<bool(int)> image_lost = [](int) { return false; };
  std::function<int(int)> mark_copies = [](int) { return 1; };
  std::function<int(int)> image_copies = [](int) { return 1; };
  std::function<nanoseconds(int)> extra_latency = [](int) { return nanoseconds(0); };
  int restart_at = -1;                     ///< from this exposure on, frame numbers and clock start again
  std::map<std::uint64_t, GpsTime> truth;  ///< exposure_mid by Image::packet_sequence
  std::vector<GpsTime> spurious;           ///< marks that belong to no exposure
  int exposures = 0;

  void run(Drive& drive);
  void mark(Drive& drive, GpsTime t, HostTime received) const;
};

}  // namespace hueline::test
