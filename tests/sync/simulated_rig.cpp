#include "tests/sync/simulated_rig.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace hueline::test {

constexpr nanoseconds kUnixOfGpsEpoch = seconds(315'964'800);

GpsTime of_unix(nanoseconds since_1970) { return GpsTime(since_1970 - kUnixOfGpsEpoch + seconds(18)); }

Stamping counts(nanoseconds period, CounterOrigin origin) {
  return [=](std::int64_t utc_ns) {
    return LaserCounter{origin, period, nanoseconds(utc_ns / 1000 * 1000 % period.count())};
  };
}

std::vector<StampKind> stamp_kinds() {
  constexpr nanoseconds kHour = std::chrono::hours(1), kDay = std::chrono::hours(24),
                        kWeek = std::chrono::hours(7 * 24);
  const auto next = [](nanoseconds period) {
    constexpr nanoseconds kIn2024 = seconds(1'715'000'000);
    return of_unix((kIn2024 / period + 1) * period);
  };
  const auto gps = [](std::int64_t utc_ns) { return gps_time_ns(utc_ns) - kUnixOfGpsEpoch + seconds(18); };
  const GpsTime week = from_gps_week(2313, seconds(0));
  return {{"hour", counts(kHour), next(kHour)},
          {"day", counts(kDay), next(kDay)},
          {"32 bits of us", counts(k32Bits_us), next(k32Bits_us)},
          {"ten minutes", counts(std::chrono::minutes(10)), next(std::chrono::minutes(10))},
          {"GPS week",
           [=](std::int64_t utc_ns) {
             return LaserCounter{CounterOrigin::Gps, kWeek, gps(utc_ns).time_since_epoch() % kWeek};
           },
           week},
          {"absolute GPS time", gps, week},
          {"absolute UTC", [](std::int64_t utc_ns) { return UnixTime(nanoseconds(utc_ns)); }, next(kDay)}};
}

void SimulatedLaser::run(Drive& drive) {
  std::uint64_t sequence = std::uint64_t{sensor} * 100'000'000;
  HostTime order{};  // one socket delivers in order
  for (GpsTime t = drive.begin + us(333); t < drive.end; t += from_seconds(1 / rate_hz)) {
    const HostTime r = order = std::max(order, drive.clock.host(t + latency(drive.random, t)));
    LaserBatch m;
    m.sensor = sensor;
    m.received = r;
    m.packet_sequence = ++sequence;
    m.time = stamp(count_ns(t + clock_error(t) - leap) + kUnixOfGpsEpoch.count());
    m.returns.resize(1);
    truth[sequence] = t;
    drive.stream.add(r, m);
  }
  for (GpsTime t = drive.begin - ms(5); t < drive.end; t += ms(200)) {
    const HostTime r = drive.clock.host(t + ms(1));
    drive.stream.add(r, LaserStatus{sensor, r, {}, clock(t), "as simulated"});
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
      nanoseconds duration = exposure;
      const std::vector<nanoseconds> parts = reported(i);
      for (const nanoseconds part : parts) m.reported.push_back({.duration = part});
      if (!parts.empty())
        duration =
            std::accumulate(parts.begin(), parts.end(), nanoseconds(0)) / static_cast<std::int64_t>(parts.size());
      const double since =
          static_cast<double>((start - power_up).count()) + stamped_at * static_cast<double>(duration.count());
      const double counter = since * (1 + clock_ppm * 1e-6) + drive.random.gauss(stamp_jitter_us * 1e3);
      m.time = DeviceTime<CameraCounter>(nanoseconds(std::llround(counter)));
      m.is_complete = true;
      m.received = std::max(order, drive.clock.host(start + latency(drive.random, start) + extra_latency(i)));
      for (int c = 0; c < image_copies(i); ++c) {
        m.packet_sequence = ++sequence;
        truth[sequence] = start + duration / 2;
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
