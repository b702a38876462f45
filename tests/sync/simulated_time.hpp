#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "core/calendar.hpp"
#include "core/measurements.hpp"

/// Truth for the tests of sync/: an oscillator with wander, and devices whose messages arrive late. GPS time is the
/// truth, and the host's clock is derived from it. No code is shared with what is tested.
namespace hueline::test {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr SensorId kPps = 1, kPos = 2, kLaser = 3, kCamera = 4, kLaserB = 5, kCameraB = 6;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double a, double b) { return a + (b - a) * uniform(); }
  double gauss(double sigma) {
    return sigma * std::sqrt(-2 * std::log(1 - uniform())) * std::cos(6.283185307179586 * uniform());
  }
  double exponential(double mean) { return -mean * std::log(1 - uniform()); }

 private:
  std::mt19937_64 engine_;
};

/// A host clock against GPS time, for a given number of seconds.
class Oscillator {
 public:
  struct Form {
    double rate_ppm = 12;                 // constant part
    double phase_walk_us = 0.05;          // us per sqrt(s)
    double frequency_walk_ppb = 1;        // ppb per sqrt(s)
    double ramp_ppb_per_s = 0;            // steady warming
    double swing_ppm = 0, swing_s = 900;  // slow temperature cycle
  };
  Oscillator(GpsTime begin, seconds life, Form form, std::uint64_t seed,
             HostTime host_begin = host_time_ns(77'123'456'789'012));
  HostTime host(GpsTime t) const;

 private:
  GpsTime begin_;
  HostTime host_begin_;
  std::vector<double> phase_;
};

inline nanoseconds us(double v) { return nanoseconds(std::llround(v * 1e3)); }
inline nanoseconds ms(double v) { return nanoseconds(std::llround(v * 1e6)); }

/// Measurements in the order in which a computer would have received them.
class Stream {
 public:
  void add(HostTime received, Measurement m);
  std::vector<std::pair<HostTime, Measurement>>& sorted();

 private:
  std::vector<std::pair<HostTime, Measurement>> items_;
};

/// A drive with its sources. One call switches on one source; the arguments are the faults of the source.
class Drive {
 public:
  Drive(GpsTime first, seconds life, Oscillator::Form form, std::uint64_t seed = 1)
      : begin(first), end(first + life), clock(first, life, form, seed), random(seed * 7919 + 13) {}

  Drive(GpsTime first, seconds life) : Drive(first, life, Oscillator::Form{}) {}

  using When = std::function<bool(GpsTime)>;
  using Delay = std::function<nanoseconds(Random&, GpsTime)>;
  using Shift = std::function<nanoseconds(GpsTime)>;
  static bool never(GpsTime) { return false; }

  /// `jitter` is added to the true edge; there is no edge when `lost` is true.
  void pps(Delay jitter, When lost = never);
  void edge_at(HostTime h, std::uint64_t sequence) { stream.add(h, PpsEdge{kPps, h, sequence}); }

  /// Adds a label of each whole second, `delay` after it; it names the second plus `shift`.
  void labels(
      SensorId sensor, Delay delay, Shift shift = [](GpsTime) { return nanoseconds(0); }, When lost = never);
  /// Adds navigation solutions at `rate_hz`, each `delay` after its instant.
  void ins(
      double rate_hz, Delay delay, Shift shift = [](GpsTime) { return nanoseconds(0); }, SensorId sensor = kPos);
  static GpsTime ceil_second(GpsTime t) { return GpsTime(std::chrono::ceil<seconds>(t.time_since_epoch())); }

  GpsTime begin, end;
  Oscillator clock;
  Random random;
  Stream stream;
};

/// Monday noon of GPS week 2300, and a quarter of a second.
inline GpsTime some_begin() { return from_gps_week(2300, seconds(86400 + 43200) + milliseconds(250)); }

inline Drive::Delay gaussian(double sigma_us) {
  return [=](Random& r, GpsTime) { return us(r.gauss(sigma_us)); };
}
inline Drive::Delay late(double min_ms, double mean_more_ms) {
  return [=](Random& r, GpsTime) { return ms(min_ms + r.exponential(mean_more_ms)); };
}

}  // namespace hueline::test
