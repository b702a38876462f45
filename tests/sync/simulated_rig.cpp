#include "tests/sync/simulated_rig.hpp"

#include <algorithm>

namespace hueline::test {

void SimulatedLaser::run(Drive& drive) {
  std::uint64_t sequence = std::uint64_t{sensor} * 100'000'000;
  HostTime order{};  // one socket delivers in order
  for (GpsTime t = drive.begin + us(333); t < drive.end; t += from_seconds(1 / rate_hz)) {
    const HostTime r = order = std::max(order, drive.clock.host(t + latency(drive.random, t)));
    LaserBatch m;
    m.sensor = sensor;
    m.received = r;
    m.packet_sequence = ++sequence;
    const std::int64_t utc = count_ns(t + clock_error(t) - leap);
    m.time = DeviceTime<UtcHourCounter>(nanoseconds(utc % kHour / 1000 * 1000));
    m.returns.resize(1);
    truth[sequence] = t;
    drive.stream.add(r, m);
  }
  for (GpsTime t = drive.begin - ms(5); t < drive.end; t += ms(200)) {
    const HostTime r = drive.clock.host(t + ms(1));
    drive.stream.add(r, LaserStatus{sensor, r, {}, pps(t), true, true});
  }
}

void SimulatedCamera::run(Drive& drive) {
  GpsTime start = drive.begin + ms(40);
  GpsTime power_up = drive.begin - seconds(1000);
  std::uint64_t frame = 700, sequence = std::uint64_t{sensor} * 100'000'000;
  HostTime order{};  // one connection delivers in order
  for (int i = 0; start + seconds(1) < drive.end; ++i, ++exposures) {
    if (i == restart_at) {
      power_up = start - ms(300);
      frame = 0;
    }
    const HostTime mark_received = drive.clock.host(start + mark_latency(drive.random, start));
    for (int c = 0; c < (mark_lost(i) ? 0 : mark_copies(i)); ++c)
      mark(drive, start - strobe_delay + us(150) * c, mark_received);
    if (!image_lost(i)) {
      Image m;
      m.sensor = sensor;
      m.frame_id = frame;
      const double counter = static_cast<double>((start - power_up).count()) * (1 + clock_ppm * 1e-6) +
                             drive.random.gauss(stamp_jitter_us * 1e3);
      m.time = DeviceTime<CameraCounter>(nanoseconds(std::llround(counter)));
      m.is_complete = true;
      m.received = std::max(order, drive.clock.host(start + latency(drive.random, start) + extra_latency(i)));
      for (int c = 0; c < image_copies(i); ++c) {
        m.packet_sequence = ++sequence;
        truth[sequence] = start + exposure / 2;
        drive.stream.add(m.received, m);
      }
      order = m.received;
    }
    ++frame;
    start += from_seconds(1 / rate_hz) +
             nanoseconds(std::llround(drive.random.uniform(-1, 1) * static_cast<double>(interval_wobble.count())));
  }
  for (const GpsTime t : spurious) mark(drive, t, drive.clock.host(t + ms(10)));
}

void SimulatedCamera::mark(Drive& drive, GpsTime t, HostTime received) const {
  EventMark m;
  m.sensor = kPos;
  m.received = received;
  m.time = t;
  m.input = input;
  m.is_valid = true;
  drive.stream.add(received, m);
}

}  // namespace hueline::test
