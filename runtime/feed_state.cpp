#include "runtime/feed_state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/portable_math.hpp"
#include "runtime/disk_outlook.hpp"
#include "runtime/summary.hpp"

namespace hueline::runtime {
namespace {

using nlohmann::ordered_json;

constexpr double kRateSpan_s = 2;

const char* word(drivers::Role role) {
  switch (role) {
    case drivers::Role::Laser:
      return "scanner";
    case drivers::Role::Camera:
      return "camera";
    case drivers::Role::Pos:
      return "pos";
    case drivers::Role::Pps:
      return "pps";
    case drivers::Role::Odometer:
      return "wheel";
  }
  return "other";
}

ordered_json trouble_json(const HealthEpisode& one) {
  return {{"trouble", name(one.trouble)},
          {"level", name(one.level)},
          {"cause", one.cause},
          {"action", one.action},
          {"since_s", one.begin_s}};
}

double rate(std::uint64_t now, std::uint64_t before, double seconds) {
  return seconds > 0.1 && now >= before ? static_cast<double>(now - before) / seconds : 0;
}

std::string utc_now() {
  return iso_utc(from_unix(
      UnixTime(std::chrono::duration_cast<nanoseconds>(std::chrono::system_clock::now().time_since_epoch()))));
}

}  // namespace

StatusWriter::StatusWriter(const config::Rig& rig, std::string mode, std::string drive)
    : rig_(rig), names_(rig.sensor_names()), mode_(std::move(mode)), drive_(std::move(drive)), since_(utc_now()) {}

ordered_json StatusWriter::sensor_json(const config::Sensor& sensor, const DriveState& state,
                                       const std::optional<LiveState>& live, const Sample& now, HostTime host) const {
  const DriveState::Sensor& one = state.sensors.at(sensor.id);
  const Sample& before = samples_.front();
  const double span_s = now.seconds - before.seconds;
  ordered_json out = {{"name", sensor.name}, {"role", word(sensor.type->role)}, {"driver", sensor.driver()}};
  const LiveState::Sensor* of_capture =
      live && sensor.id <= live->sensors.size() ? &live->sensors[sensor.id - 1u] : nullptr;
  out["state"] = of_capture ? of_capture->state : "replay";
  out["level"] = name(one.level);
  const HealthEpisode* worst = nullptr;
  auto troubles = ordered_json::array();
  for (const HealthEpisode& trouble : state.troubles) {
    if (trouble.sensor != sensor.id) continue;
    troubles.push_back(trouble_json(trouble));
    if (worst == nullptr || trouble.level > worst->level) worst = &trouble;
  }
  out["trouble"] = worst ? ordered_json(name(worst->trouble)) : ordered_json();
  out["cause"] = worst ? worst->cause : "";
  out["action"] = worst ? worst->action : "";
  out["since_s"] = worst ? ordered_json(worst->begin_s) : ordered_json();
  out["troubles"] = std::move(troubles);
  out["packets"] = one.packets;
  out["bytes"] = one.bytes;
  out["rate_hz"] = rate(one.packets, before.packets.at(sensor.id), span_s);
  out["bytes_per_s"] = rate(one.bytes, before.bytes.at(sensor.id), span_s);
  out["age_s"] =
      one.last ? ordered_json(std::max(0.0, to_seconds((live ? host : state.newest) - *one.last))) : ordered_json();
  out["lost"] = one.lost;
  out["shed"] = of_capture ? of_capture->shed : 0;
  out["refused"] = of_capture ? of_capture->refused : 0;
  return out;
}

ordered_json StatusWriter::status(const DriveState& state, const std::optional<LiveState>& live, HostTime host) {
  Sample now;
  now.seconds = live ? to_seconds(host.time_since_epoch()) : state.drive_s;
  for (const auto& sensor : state.sensors) now.packets.push_back(sensor.packets), now.bytes.push_back(sensor.bytes);
  now.recorded_bytes = live ? live->recorded_bytes : 0;
  now.points = state.points;
  samples_.push_back(now);
  while (samples_.size() > 2 && (now.seconds - samples_[1].seconds >= kRateSpan_s || samples_.size() > 1000))
    samples_.pop_front();
  const Sample& before = samples_.front();
  const double span_s = now.seconds - before.seconds;

  ordered_json out = {{"mode", mode_}, {"rig", rig_.name}, {"drive", drive_}, {"since", since_}};
  out["drive_s"] = state.drive_s;
  out["gps"] = state.gps ? ordered_json(iso_utc(*state.gps)) : ordered_json();
  out["level"] = name(state.level);
  auto& sensors = out["sensors"] = ordered_json::array();
  for (const config::Sensor& sensor : rig_.sensors) sensors.push_back(sensor_json(sensor, state, live, now, host));
  auto& troubles = out["troubles"] = ordered_json::array();
  for (const HealthEpisode& trouble : state.troubles)
    if (trouble.sensor == kSystemSensor) troubles.push_back(trouble_json(trouble));
  auto& clocks = out["clocks"] = ordered_json::array();
  for (const auto& [id, clock] : state.clocks) {
    ordered_json one = {{"name", names_.at(id)},
                        {"state", name(clock.state)},
                        {"sigma_s", nullptr},
                        {"residual_s", nullptr},
                        {"holdover_s", nullptr}};
    if (id == rig_.sync.clock.pps && state.host_sigma) one["sigma_s"] = to_seconds(*state.host_sigma);
    if (clock.state == SyncState::Holdover) one["holdover_s"] = state.drive_s - clock.since_s;
    clocks.push_back(std::move(one));
  }
  out["pos"] = nullptr;
  if (const auto& solution = state.solution) {
    out["pos"] = {{"status", ins_status_words(solution->status)}, {"is_good", solution->is_good}};
    auto& pos = out["pos"];
    pos["sigma_horizontal_m"] =
        solution->sigma ? ordered_json(portable::hypot((*solution->sigma)[0], (*solution->sigma)[1])) : ordered_json();
    pos["sigma_vertical_m"] = solution->sigma ? ordered_json((*solution->sigma)[2]) : ordered_json();
    const bool has_place = is_on_earth(solution->position);
    const auto number = [&](double value) { return has_place ? ordered_json(value) : ordered_json(); };
    pos["latitude_deg"] = number(solution->position.latitude * kDegPerRad);
    pos["longitude_deg"] = number(solution->position.longitude * kDegPerRad);
    pos["height_m"] = number(solution->position.ellipsoidal_height);
    pos["speed_m_s"] = solution->velocity_enu.norm();
    pos["heading_deg"] = solution->attitude.heading * kDegPerRad;
    pos["fix"] = state.fix ? ordered_json(name(state.fix->type)) : ordered_json();
    pos["satellites"] = state.fix && state.fix->satellites > 0 ? ordered_json(state.fix->satellites) : ordered_json();
  }
  out["disk"] = nullptr;
  auto& queues = out["queues"] = ordered_json::array();
  if (live) {
    const double bytes_per_s = rate(now.recorded_bytes, before.recorded_bytes, span_s);
    const double fill = bytes_per_s + cloud_bytes_a_point(rig_.cloud_format, rig_.cloud_split.has_value()) *
                                          rate(now.points, before.points, span_s);
    out["disk"] = {{"free_bytes", live->free_bytes}, {"bytes_per_s", bytes_per_s}, {"left_s", nullptr}};
    if (fill > 0) out["disk"]["left_s"] = static_cast<double>(live->free_bytes) / fill;
    for (const auto& queue : live->queues)
      queues.push_back({{"name", queue.name}, {"packets", queue.packets}, {"share", queue.share}});
  }
  out["points"] = state.points;
  out["coloured_share"] = state.points
                              ? ordered_json(static_cast<double>(state.coloured) / static_cast<double>(state.points))
                              : ordered_json();
  out["exposures"] = state.exposures;
  out["path_m"] = state.path_m;
  auto& marks = out["marks"] = ordered_json::array();
  for (std::size_t i = 0; i < state.marks.size(); ++i) {
    const OperatorCommand& mark = state.marks[i];
    ordered_json one = {{"number", state.first_mark + i + 1}, {"drive_s", mark.drive_s}, {"time", nullptr},
                        {"note", mark.command.note},          {"latitude_deg", nullptr}, {"longitude_deg", nullptr}};
    if (mark.time) one["time"] = iso_utc(*mark.time);
    if (mark.place) {
      one["latitude_deg"] = mark.place->latitude * kDegPerRad;
      one["longitude_deg"] = mark.place->longitude * kDegPerRad;
    }
    marks.push_back(std::move(one));
  }
  return out;
}

ordered_json StatusWriter::diagnostics(const ordered_json& status) {
  const auto level = [](const std::string& word) { return word == "alarm" ? 2 : word == "warning" ? 1 : 0; };
  const auto pairs = [](const ordered_json& from, std::initializer_list<const char*> keys) {
    auto out = ordered_json::array();
    for (const char* key : keys)
      if (from.contains(key)) out.push_back({{"key", key}, {"value", from[key].dump()}});
    return out;
  };
  auto all = ordered_json::array();
  all.push_back({{"name", "drive"},
                 {"level", level(status["level"].get<std::string>())},
                 {"message", status["level"]},
                 {"values", pairs(status, {"drive_s", "path_m", "points", "coloured_share", "disk", "queues"})}});
  for (const auto& sensor : status["sensors"]) {
    const std::string cause = sensor["cause"].get<std::string>();
    all.push_back({{"name", sensor["name"]},
                   {"level", sensor["packets"] == 0 ? 3 : level(sensor["level"].get<std::string>())},
                   {"message", cause.empty() ? sensor["level"].get<std::string>() : cause},
                   {"values", pairs(sensor, {"state", "packets", "rate_hz", "age_s", "lost", "shed", "refused"})}});
  }
  return {{"status", std::move(all)}};
}

ordered_json map_json(const Geodetic& origin, const std::vector<DriveMap::Second>& seconds, std::size_t first,
                      std::size_t step) {
  const auto T_enu_ecef = ecef_from_enu(origin).inverse();
  const auto rounded = [](double value, double by) { return std::round(value * by) / by; };
  auto rows = ordered_json::array();
  for (std::size_t i = 0; i < seconds.size(); i += step) {
    const DriveMap::Second& one = seconds[i];
    auto row = ordered_json::array({first + i, nullptr, nullptr, one.points, one.coloured, nullptr, nullptr});
    if (one.place) {
      const auto at = T_enu_ecef * to_ecef(*one.place);
      row[1] = rounded(at.xyz.x(), 100);
      row[2] = rounded(at.xyz.y(), 100);
    }
    if (one.sigma_m >= 0) row[5] = rounded(static_cast<double>(one.sigma_m), 1e4);
    if (one.fix) row[6] = name(*one.fix);
    rows.push_back(std::move(row));
  }
  return {{"origin",
           {{"latitude_deg", origin.latitude * kDegPerRad},
            {"longitude_deg", origin.longitude * kDegPerRad},
            {"height_m", origin.ellipsoidal_height}}},
          {"first_s", first},
          {"seconds", std::move(rows)}};
}

}  // namespace hueline::runtime
