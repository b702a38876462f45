#pragma once

#include <map>

#include "tests/sync/simulated_time.hpp"

/// Scanners, cameras and strobes for a Drive, with their truth and their faults.
namespace hueline::test {

constexpr std::int64_t kHour = 3'600'000'000'000;

/// A scanner: `rate_hz` packets, each stamped with microseconds past the UTC hour of its first firing.
struct SimulatedLaser {
  SensorId sensor = kLaser;
  double rate_hz = 50;
  seconds leap{18};
  Drive::Shift clock_error = [](GpsTime) { return nanoseconds(0); };  ///< added to the true time before it is counted
  Drive::Delay latency = [](Random& r, GpsTime) { return ms(1.45 + r.exponential(0.15)); };
  std::function<PpsStatus(GpsTime)> pps = [](GpsTime) { return PpsStatus::Locked; };
  std::map<std::uint64_t, GpsTime> truth;  ///< by packet sequence

  void run(Drive& drive) {
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
};

/// A strobed camera: each exposure gives a mark at its start (less `strobe_delay`) and, later, an image.
struct SimulatedCamera {
  SensorId sensor = kCamera;
  int input = 1;
  double rate_hz = 10;
  nanoseconds interval_wobble{0};  ///< distance-triggered cameras are not periodic
  nanoseconds strobe_delay = us(20), exposure = ms(2);
  double clock_ppm = 23, stamp_jitter_us = 3;
  Drive::Delay latency = [](Random& r, GpsTime) { return ms(30 + r.exponential(3)); };
  Drive::Delay mark_latency = late(8, 4);
  std::function<bool(int)> mark_lost = [](int) { return false; };
  std::function<bool(int)> image_lost = [](int) { return false; };
  std::function<int(int)> mark_copies = [](int) { return 1; };
  std::function<int(int)> image_copies = [](int) { return 1; };
  std::function<nanoseconds(int)> extra_latency = [](int) { return nanoseconds(0); };
  int restart_at = -1;                     ///< exposure from which frame numbers and clock begin anew
  std::map<std::uint64_t, GpsTime> truth;  ///< exposure_mid by Image::packet_sequence
  std::vector<GpsTime> spurious;           ///< marks of nothing
  int exposures = 0;

  void run(Drive& drive) {
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
  void mark(Drive& drive, GpsTime t, HostTime received) const {
    EventMark m;
    m.sensor = kPos;
    m.received = received;
    m.time = t;
    m.input = input;
    m.is_valid = true;
    drive.stream.add(received, m);
  }
};

}  // namespace hueline::test
