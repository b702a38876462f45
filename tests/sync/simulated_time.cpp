#include "tests/sync/simulated_time.hpp"

#include <algorithm>
#include <utility>

namespace hueline::test {

Oscillator::Oscillator(GpsTime begin, seconds life, Form form, std::uint64_t seed, HostTime host_begin)
    : begin_(begin), host_begin_(host_begin) {
  Random random(seed);
  double phase = 0, walk = 0;
  for (std::int64_t s = 0; s <= life.count() + 10; ++s) {
    phase_.push_back(phase);
    walk += random.gauss(form.frequency_walk_ppb);
    const double t = static_cast<double>(s);
    const double rate_ppb = form.rate_ppm * 1e3 + walk + form.ramp_ppb_per_s * t +
                            form.swing_ppm * 1e3 * std::sin(6.283185307179586 * t / form.swing_s);
    phase += rate_ppb + random.gauss(form.phase_walk_us * 1e3);  // 1 ppb during one second is a nanosecond
  }
}

HostTime Oscillator::host(GpsTime t) const {
  const std::int64_t ns = (t - begin_).count();
  // Before the beginning and after the end, the rate of the nearest second continues.
  const auto last = static_cast<std::int64_t>(phase_.size()) - 2;
  const std::int64_t k = std::clamp<std::int64_t>(ns / 1'000'000'000, 0, last);
  const double part = static_cast<double>(ns - k * 1'000'000'000) * 1e-9;
  const double a = phase_[static_cast<std::size_t>(k)], b = phase_[static_cast<std::size_t>(k + 1)];
  return host_begin_ + nanoseconds(ns + std::llround(a + (b - a) * part));
}

void Stream::add(HostTime received, Measurement m) { items_.push_back({received, std::move(m)}); }

std::vector<std::pair<HostTime, Measurement>>& Stream::sorted() {
  std::stable_sort(items_.begin(), items_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return items_;
}

void Drive::pps(Delay jitter, When lost) {
  std::uint64_t sequence = 0;
  for (GpsTime t = ceil_second(begin); t < end; t += seconds(1)) {
    if (lost(t)) continue;
    edge_at(clock.host(t) + jitter(random, t), ++sequence);
  }
}

void Drive::labels(SensorId sensor, Delay delay, Shift shift, When lost) {
  for (GpsTime t = ceil_second(begin); t < end; t += seconds(1)) {
    if (lost(t)) continue;
    const HostTime r = clock.host(t + delay(random, t));
    stream.add(r, TimeLabel{sensor, r, t + std::chrono::duration_cast<seconds>(shift(t)), {}, true});
  }
}

void Drive::ins(double rate_hz, Delay delay, Shift shift, SensorId sensor) {
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

}  // namespace hueline::test
