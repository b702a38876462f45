#include "sim/laps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>

#include "sim/earth.hpp"
#include "sim/vec3.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

/// A span of a drive's own time, and how much later it is driven.
struct Span {
  GpsNs begin = 0, end = 0;
  std::int64_t later_ns = 0;
  bool holds(GpsNs t) const { return t >= begin && t < end; }
};

template <class Item>
void cut(std::vector<Item>& items, GpsNs Item::*time, const Span& span) {
  std::erase_if(items, [&](const Item& item) { return !span.holds(item.*time); });
  for (Item& item : items) item.*time += span.later_ns;
}

/// Leaves out a datagram that begins before the end and would end after it, too. Datagrams of one scanner last equally
/// long.
template <class Packet>
void cut_datagrams(std::vector<Packet>& packets, GpsNs Packet::*time, const Span& span) {
  const std::int64_t lasts_ns = packets.size() < 2 ? 0 : packets[1].*time - packets[0].*time;
  cut(packets, time, {span.begin, span.end - lasts_ns + 1, span.later_ns});
}

/// Returns the solution at this time, or the first one after it.
const InsSample& solution_at(const Drive& drive, GpsNs gps_ns) {
  const auto at = std::partition_point(drive.ins.begin(), drive.ins.end(),
                                       [&](const InsSample& sample) { return sample.gps_ns < gps_ns; });
  return at == drive.ins.end() ? drive.ins.back() : *at;
}

GeodeticPlace place_of(const InsSample& sample) {
  return {sample.latitude_rad, sample.longitude_rad, sample.ellipsoidal_height_m};
}

/// Moves and turns a solution of a lap to where the next lap is: that begins at `last`, headed as there, as this one
/// began at `first`. Roll and pitch stay, because a lap that ends on another slope would else tip over lap by lap.
void carry_on(InsSample& sample, const InsSample& first, const InsSample& last) {
  const double turned_rad = last.heading_rad - first.heading_rad;
  const Mat3 R_turn = rotation_z(-turned_rad);  // headings count clockwise
  const Vec3 from_first = transposed(R_ecef_enu(place_of(first))) *
                          (ecef_from_geodetic(place_of(sample)) - ecef_from_geodetic(place_of(first)));
  const GeodeticPlace place =
      geodetic_from_ecef(ecef_from_geodetic(place_of(last)) + R_ecef_enu(place_of(last)) * (R_turn * from_first));
  const Vec3 velocity = R_turn * Vec3{sample.velocity_east, sample.velocity_north, sample.velocity_up};
  sample.latitude_rad = place.latitude;
  sample.longitude_rad = place.longitude;
  sample.ellipsoidal_height_m = place.height;
  sample.velocity_east = velocity.x;
  sample.velocity_north = velocity.y;
  sample.velocity_up = velocity.z;
  const double heading_rad = sample.heading_rad + turned_rad;
  sample.heading_rad = heading_rad - 2 * kPi * std::floor(heading_rad / (2 * kPi));
}

/// Lets the first images follow again until the next lap's first one is due.
void keep_rate(std::vector<CameraExposure>& exposures, std::int64_t lap_ns) {
  if (exposures.size() < 2) return;
  const std::int64_t period_ns = exposures[1].exposure_start_gps_ns - exposures[0].exposure_start_gps_ns;
  const std::size_t rendered = exposures.size();
  while (exposures.back().exposure_start_gps_ns + period_ns < exposures.front().exposure_start_gps_ns + lap_ns) {
    CameraExposure again = exposures[exposures.size() % rendered];
    again.exposure_start_gps_ns = exposures.back().exposure_start_gps_ns + period_ns;
    exposures.push_back(std::move(again));
  }
}

/// Returns the number of samples before this time.
std::uint32_t samples_before(const std::vector<WheelSample>& wheel, GpsNs gps_ns) {
  return static_cast<std::uint32_t>(
      std::count_if(wheel.begin(), wheel.end(), [&](const WheelSample& sample) { return sample.gps_ns < gps_ns; }));
}

}  // namespace

std::string cannot_be_driven_again(const Scenario& scenario) {
  if (!scenario.faults.empty()) return "the scenario has faults, whose times are those of one drive";
  if ((scenario.sensors_end_gps_ns() - scenario.sensors_begin_gps_ns()) % kNsPerSecond != 0)
    return "duration_s of the scenario is no whole number of seconds";
  return {};
}

Lap lap_of(const Scenario& scenario, const Drive& drive, std::uint32_t lap, std::uint32_t laps) {
  if (laps == 1) return {drive, {}};
  const GpsNs sensors_begin = scenario.sensors_begin_gps_ns(), sensors_end = scenario.sensors_end_gps_ns();
  const std::int64_t lap_ns = sensors_end - sensors_begin;
  const Span span{lap == 0 ? drive.begin_gps_ns : sensors_begin, lap + 1 == laps ? drive.end_gps_ns : sensors_end,
                  lap * lap_ns};
  Lap out{drive, {}};
  Drive& driven = out.drive;
  driven.begin_gps_ns = span.begin + span.later_ns;
  driven.end_gps_ns = span.end + span.later_ns;
  const auto seconds = static_cast<std::size_t>((span.begin - drive.begin_gps_ns) / kNsPerSecond);
  driven.pps_edge_error_ns.erase(driven.pps_edge_error_ns.begin(),
                                 driven.pps_edge_error_ns.begin() +
                                     static_cast<std::ptrdiff_t>(std::min(seconds, driven.pps_edge_error_ns.size())));
  // Only the POS and the wheels have anything to send before laser and camera begin, or after they end.
  const Span sensors{sensors_begin, sensors_end, span.later_ns};
  cut_datagrams(driven.laser, &LaserPacket::first_firing_gps_ns, sensors);
  cut_datagrams(driven.profile, &ProfilePacket::first_pulse_gps_ns, sensors);
  cut(driven.exposures, &CameraExposure::exposure_start_gps_ns, sensors);
  cut(driven.ins, &InsSample::gps_ns, span);
  cut(driven.wheel, &WheelSample::gps_ns, span);

  const InsSample &first = solution_at(drive, sensors_begin), &last = solution_at(drive, sensors_end);
  for (InsSample& sample : driven.ins)
    for (std::uint32_t i = 0; i < lap; ++i) carry_on(sample, first, last);

  const std::uint32_t lines = driven.profile.empty() ? 0 : driven.profile.back().line + 1;
  for (ProfilePacket& packet : driven.profile) packet.line += lap * lines;

  std::vector<CameraExposure>& exposures = driven.exposures;
  keep_rate(exposures, lap_ns);
  for (std::size_t i = 0; i < exposures.size(); ++i)
    exposures[i].number = static_cast<std::uint32_t>(lap * exposures.size() + i);

  const std::uint32_t to_begin = samples_before(drive.wheel, sensors_begin),
                      to_end = samples_before(drive.wheel, sensors_end);
  const auto pulses_after = [&](std::uint32_t samples) {
    return samples == 0 ? std::array<std::uint32_t, 2>{} : drive.wheel[samples - 1].pulses;
  };
  const std::array<std::uint32_t, 2> begin = pulses_after(to_begin), end = pulses_after(to_end);
  for (WheelSample& sample : driven.wheel)
    for (std::size_t i = 0; i < begin.size(); ++i) sample.pulses[i] += lap * (end[i] - begin[i]);
  if (lap > 0) {
    out.before.begin_ns = driven.begin_gps_ns - drive.begin_gps_ns;
    out.before.profile_datagrams = lap * static_cast<std::uint32_t>(driven.profile.size());
    out.before.exposures = lap * static_cast<std::uint32_t>(exposures.size());
    out.before.wheel_samples = to_end + (lap - 1) * (to_end - to_begin);
  }
  return out;
}

Result<std::shared_ptr<const Timeline>> Laps::next() {
  if (next_ == count_) return std::shared_ptr<const Timeline>();
  Result<Timeline> built = build_(next_++);
  if (!built.ok()) return built.error();
  auto lap = std::make_shared<Timeline>(std::move(*built));
  lap->events.insert(lap->events.end(), std::make_move_iterator(late_.begin()), std::make_move_iterator(late_.end()));
  late_.clear();
  sort_events(lap->events);
  if (next_ == count_) return std::shared_ptr<const Timeline>(std::move(lap));
  const auto late = std::partition_point(lap->events.begin(), lap->events.end(),
                                         [&](const WireEvent& event) { return event.at_ns < lap->end_ns; });
  late_.assign(std::make_move_iterator(late), std::make_move_iterator(lap->events.end()));
  lap->events.erase(late, lap->events.end());
  return std::shared_ptr<const Timeline>(std::move(lap));
}

}  // namespace hueline::sim
