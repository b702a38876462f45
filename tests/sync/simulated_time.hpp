#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "core/calendar.hpp"
#include "core/measurements.hpp"

/// Truth for the tests of sync/: an oscillator that wanders, and devices that speak late. GPS time is the truth; the
/// host's clock is made from it. Nothing here is shared with what is tested.
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

/// A host clock of so many seconds of life against GPS time.
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
             HostTime host_begin = host_time_ns(77'123'456'789'012))
      : begin_(begin), host_begin_(host_begin) {
    Random random(seed);
    double phase = 0, walk = 0;
    for (std::int64_t s = 0; s <= life.count() + 10; ++s) {
      phase_.push_back(phase);
      walk += random.gauss(form.frequency_walk_ppb);
      const double t = static_cast<double>(s);
      const double rate_ppb = form.rate_ppm * 1e3 + walk + form.ramp_ppb_per_s * t +
                              form.swing_ppm * 1e3 * std::sin(6.283185307179586 * t / form.swing_s);
      phase += rate_ppb + random.gauss(form.phase_walk_us * 1e3);  // 1 ppb for a second is a nanosecond
    }
  }
  HostTime host(GpsTime t) const {
    const std::int64_t ns = (t - begin_).count();
    // Before the beginning and after the end the nearest second's rate goes on.
    const auto last = static_cast<std::int64_t>(phase_.size()) - 2;
    const std::int64_t k = std::clamp<std::int64_t>(ns / 1'000'000'000, 0, last);
    const double part = static_cast<double>(ns - k * 1'000'000'000) * 1e-9;
    const double a = phase_[static_cast<std::size_t>(k)], b = phase_[static_cast<std::size_t>(k + 1)];
    return host_begin_ + nanoseconds(ns + std::llround(a + (b - a) * part));
  }

 private:
  GpsTime begin_;
  HostTime host_begin_;
  std::vector<double> phase_;
};

inline nanoseconds us(double v) { return nanoseconds(std::llround(v * 1e3)); }
inline nanoseconds ms(double v) { return nanoseconds(std::llround(v * 1e6)); }

/// Measurements in the order in which a computer would have ingested them.
class Stream {
 public:
  void add(HostTime received, Measurement m) { items_.push_back({received, std::move(m)}); }
  std::vector<std::pair<HostTime, Measurement>>& sorted() {
    std::stable_sort(items_.begin(), items_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    return items_;
  }

 private:
  std::vector<std::pair<HostTime, Measurement>> items_;
};

/// A drive: who speaks when. Each source is switched on by a call; the arguments are its faults.
class Drive {
 public:
  Drive(GpsTime first, seconds life, Oscillator::Form form, std::uint64_t seed = 1)
      : begin(first), end(first + life), clock(first, life, form, seed), random(seed * 7919 + 13) {}

  Drive(GpsTime first, seconds life) : Drive(first, life, Oscillator::Form{}) {}

  using When = std::function<bool(GpsTime)>;
  using Delay = std::function<nanoseconds(Random&, GpsTime)>;
  using Shift = std::function<nanoseconds(GpsTime)>;
  static bool never(GpsTime) { return false; }

  /// `jitter`: added to the true edge; `lost`: no edge then.
  void pps(Delay jitter, When lost = never) {
    std::uint64_t sequence = 0;
    for (GpsTime t = ceil_second(begin); t < end; t += seconds(1)) {
      if (lost(t)) continue;
      edge_at(clock.host(t) + jitter(random, t), ++sequence);
    }
  }
  void edge_at(HostTime h, std::uint64_t sequence) { stream.add(h, PpsEdge{kPps, h, sequence}); }

  /// A label of each whole second, `delay` after it, saying the second plus `shift`.
  void labels(
      SensorId sensor, Delay delay, Shift shift = [](GpsTime) { return nanoseconds(0); }, When lost = never) {
    for (GpsTime t = ceil_second(begin); t < end; t += seconds(1)) {
      if (lost(t)) continue;
      const HostTime r = clock.host(t + delay(random, t));
      stream.add(r, TimeLabel{sensor, r, t + std::chrono::duration_cast<seconds>(shift(t)), {}, true});
    }
  }
  /// Navigation solutions at `rate_hz`, `delay` after their instant.
  void ins(
      double rate_hz, Delay delay, Shift shift = [](GpsTime) { return nanoseconds(0); }, SensorId sensor = kPos) {
    const nanoseconds step = from_seconds(1 / rate_hz);
    for (GpsTime t = ceil_second(begin); t < end; t += step) {
      const HostTime r = clock.host(t + delay(random, t));
      InsSolution m;
      m.sensor = sensor;
      m.received = r;
      m.time = t + shift(t);
      m.is_good = true;
      stream.add(r, m);
    }
  }
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
