#include "sim/laps.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <utility>

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

}  // namespace

std::string cannot_be_driven_again(const Scenario& scenario, const Drive& drive) {
  if (!scenario.faults.empty()) return "the scenario has faults, whose times are those of one drive";
  if ((scenario.sensors_end_gps_ns() - scenario.sensors_begin_gps_ns()) % kNsPerSecond != 0)
    return "duration_s of the scenario is no whole number of seconds";
  if (drive.ins.empty()) return "the drive has no solutions of a POS";
  return {};
}

Lap lap_of(const Scenario& scenario, const Drive& drive, std::uint32_t lap, std::uint32_t laps) {
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
    for (const auto field : {&InsSample::latitude_rad, &InsSample::longitude_rad, &InsSample::ellipsoidal_height_m})
      sample.*field += lap * (last.*field - first.*field);

  const std::uint32_t lines = driven.profile.empty() ? 0 : driven.profile.back().line + 1;
  for (ProfilePacket& packet : driven.profile) packet.line += lap * lines;

  std::vector<CameraExposure>& exposures = driven.exposures;
  if (exposures.size() >= 2) {
    const std::int64_t period_ns = exposures[1].exposure_start_gps_ns - exposures[0].exposure_start_gps_ns;
    const std::size_t rendered = exposures.size();
    while (exposures.back().exposure_start_gps_ns + period_ns < exposures.front().exposure_start_gps_ns + lap_ns) {
      CameraExposure again = exposures[exposures.size() % rendered];
      again.exposure_start_gps_ns = exposures.back().exposure_start_gps_ns + period_ns;
      exposures.push_back(std::move(again));
    }
    for (std::size_t i = 0; i < exposures.size(); ++i)
      exposures[i].number = static_cast<std::uint32_t>(lap * exposures.size() + i);
  }

  const auto wheel_samples = [&](GpsNs begin) {
    return static_cast<std::uint32_t>(std::count_if(drive.wheel.begin(), drive.wheel.end(), [&](const WheelSample& s) {
      return Span{begin, sensors_end}.holds(s.gps_ns);
    }));
  };
  if (!drive.wheel.empty()) {
    const auto pulses_until = [&](GpsNs gps_ns) {
      std::array<std::uint32_t, 2> pulses{};
      for (const WheelSample& sample : drive.wheel)
        if (sample.gps_ns < gps_ns) pulses = sample.pulses;
      return pulses;
    };
    const std::array<std::uint32_t, 2> begin = pulses_until(sensors_begin), end = pulses_until(sensors_end);
    for (WheelSample& sample : driven.wheel)
      for (std::size_t i = 0; i < begin.size(); ++i) sample.pulses[i] += lap * (end[i] - begin[i]);
  }
  if (lap > 0) {
    out.before.begin_ns = driven.begin_gps_ns - drive.begin_gps_ns;
    out.before.profile_datagrams = lap * static_cast<std::uint32_t>(driven.profile.size());
    out.before.exposures = lap * static_cast<std::uint32_t>(exposures.size());
    out.before.wheel_samples = wheel_samples(drive.begin_gps_ns) + (lap - 1) * wheel_samples(sensors_begin);
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
