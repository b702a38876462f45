#include "runtime/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/novatel/messages.hpp"

namespace hueline::runtime {
namespace {

/// Returns the meaning of a kind for readers of the summary.
const char* explanation(FaultKind kind) {
  switch (kind) {
    case FaultKind::Disconnected:
      return "device or peer gone; asked again with back-off";
    case FaultKind::Reconnected:
      return "came back";
    case FaultKind::Silent:
      return "connected but said nothing";
    case FaultKind::Overflow:
      return "a bounded queue, pool or kernel buffer was full";
    case FaultKind::Malformed:
      return "bytes that break their format, recorded as received";
    case FaultKind::Lost:
      return "gap in the device's own count or period: never reached this computer";
    case FaultKind::Late:
      return "came after its place in the stream had passed: recorded, not fused";
    case FaultKind::ClockStep:
      return "a clock jumped";
    case FaultKind::LabelConflict:
      return "sources disagree about the second";
    case FaultKind::Spurious:
      return "belongs to nothing: recorded, not used";
    case FaultKind::Shed:
      return "recorded, not fused: the pipeline was too slow";
    case FaultKind::DiskFull:
      return "a write was refused, or the recording was taken away";
    case FaultKind::WrongSize:
      return "image of another size than the rig's: recorded, not used";
    case FaultKind::WrongDevice:
      return "not the device that the rig names";
    case FaultKind::NoTime:
      return "its clock is not disciplined: stamped roughly, or not at all";
    case FaultKind::Refused:
      return "the device refused a command";
    case FaultKind::Implausible:
      return "doubted by its source, or by the values before it: used with a grown sigma, or not at all";
  }
  return "?";
}

constexpr const char* kWithoutRange = "without a range";

double share(std::uint64_t part, std::uint64_t whole) {
  return whole ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

std::string ins_status_words(std::uint32_t status) { return drivers::ins_status_name(status); }

void Summary::SigmaStatistics::add(nanoseconds sigma) {
  const double us = to_seconds(sigma) * 1e6;
  ++count;
  sum_square_us += us * us;
  largest_us = std::max(largest_us, us);
}
double Summary::SigmaStatistics::rms_us() const {
  return count ? std::sqrt(sum_square_us / static_cast<double>(count)) : 0;
}

Summary::Summary(std::vector<std::string> sensors) {
  for (auto& name : sensors)
    sensors_.push_back({.name = std::move(name), .packets = 0, .bytes = 0, .shed = 0, .decoded = {}, .faults = {}});
}

void Summary::on_packet(const Packet& packet) {
  ++packets_;
  bytes_ += packet.bytes.size();
  if (packet.sequence > next_sequence_) gaps_ += packet.sequence - next_sequence_;
  next_sequence_ = packet.sequence + 1;
  if (packet.sensor >= sensors_.size()) return;
  Sensor& sensor = sensors_[packet.sensor];
  if (packet.kind == PacketKind::Wire) {
    ++sensor.packets;
    sensor.bytes += packet.bytes.size();
  }
  if (packet.shed) ++sensor.shed;
}

void Summary::on_shed(SensorId sensor, const Ingest::Shed& shed) {
  packets_ += shed.packets;
  bytes_ += shed.bytes;
  gaps_ -= std::min(gaps_, shed.packets);
  if (sensor >= sensors_.size()) return;
  Sensor& one = sensors_[sensor];
  one.packets += shed.wire;
  one.bytes += shed.wire_bytes;
  one.shed += shed.packets;
}

void Summary::on_decoded(SensorId sensor, const DecodeCounts& counts) {
  if (sensor < sensors_.size()) sensors_[sensor].decoded = counts;
}

void Summary::on_wheels(SensorId sensor, const sync::WheelOdometer::Way& speeds,
                        const sync::WheelOdometer::Way& pulses) {
  if (sensor < sensors_.size()) wheels_.push_back({sensor, speeds, pulses});
}

void Summary::on_unfused(const std::string& reason, std::uint64_t points) {
  if (points) unfused_[reason] += points;
}

void Summary::on_unwritten(const std::string& reason, std::uint64_t points) {
  if (points) unwritten_[reason] += points;
}

void Summary::on_cloud(const CloudBlock& block, const fusion::Trajectory&) {
  points_ += block.points.size();
  for (const auto& point : block.points) ++by_state_[static_cast<std::size_t>(point.state)];
}

void Summary::on_exposure(const Exposure& exposure) {
  ++exposures_;
  ++exposures_by_timing_[static_cast<std::size_t>(exposure.timing)];
  if (!exposure.image.is_complete) ++incomplete_images_;
  if (exposure.timing != ExposureTiming::Unmatched) exposure_sigma_.add(exposure.sigma);
}

void Summary::on_solution(const InsSolution& solution) {
  first_ = solutions_ ? std::min(first_, solution.time) : solution.time;
  last_ = solutions_ ? std::max(last_, solution.time) : solution.time;
  ++solutions_;
  const nanoseconds since = last_solution_ ? solution.time - *last_solution_ : nanoseconds(0);
  last_solution_ = solution.time;
  if (!solution.is_good) {
    const bool is_told = solutions_by_status_.contains(solution.status) || solutions_by_status_.size() < kMostStatuses;
    NotGood& state = is_told ? solutions_by_status_[solution.status] : other_statuses_;
    ++state.solutions;
    if (since > nanoseconds(0) && since <= std::chrono::seconds(2)) state.lasted += since;
    return;
  }
  ++good_solutions_;
  // The path length is summed in steps of at least 0.5 m. A sum over every solution would add the noise of the POS.
  if (has_place_) {
    const double step = (to_ecef(solution.position).xyz - to_ecef(last_place_).xyz).norm();
    if (step < 0.5) return;
    path_m_ += step;
  }
  has_place_ = true;
  last_place_ = solution.position;
}

void Summary::on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) {
  ++change_count_;
  if (changes_.size() < kMostChanges) changes_.push_back({time, clock, state});
}

void Summary::on_command(const OperatorCommand& command) {
  if (command.command.kind != DriveCommand::Kind::Mark) return;
  if (marks_.size() < kMostMarks)
    marks_.push_back(command);
  else
    ++marks_not_kept_;
}

nlohmann::ordered_json Summary::marks_json() const {
  auto out = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    const OperatorCommand& mark = marks_[i];
    nlohmann::ordered_json one = {{"number", i + 1},
                                  {"drive_s", mark.drive_s},
                                  {"path_m", mark.path_m},
                                  {"time", nullptr},
                                  {"note", mark.command.note}};
    if (mark.time) one["time"] = iso_utc(*mark.time);
    if (mark.place)
      one["place"] = {{"latitude_deg", mark.place->latitude * kDegPerRad},
                      {"longitude_deg", mark.place->longitude * kDegPerRad}};
    out.push_back(std::move(one));
  }
  return out;
}

void Summary::on_fault(const Fault& fault) {
  Sensor& sensor = sensors_[fault.sensor < sensors_.size() ? fault.sensor : kSystemSensor];
  FaultLine& line = sensor.faults[fault.kind];
  if (!line.events) line.first = fault.detail;
  line.last = fault.detail;
  ++line.events;
  line.count += fault.count;
}

std::uint64_t Summary::coloured_points() const {
  return by_state_[static_cast<std::size_t>(ColourState::Direct)] +
         by_state_[static_cast<std::size_t>(ColourState::Neighbour)];
}

double Summary::coloured_share() const { return share(coloured_points(), points_); }

double Summary::placed_share() const {
  std::uint64_t unplaced = 0;
  for (const auto& [reason, returns] : unfused_)
    if (reason != kWithoutRange) unplaced += returns;
  return share(points_, points_ + unplaced);
}

void Summary::on_verdict(const Health& health, Verdict verdict) {
  episodes_ = health.episodes();
  episodes_not_kept_ = health.episodes_not_kept();
  verdict_ = std::move(verdict);
}

bool Summary::had_trouble(SensorId sensor) const {
  if (!verdict_ || verdict_->grade == Grade::Again) return true;
  return std::ranges::any_of(
      episodes_, [&](const HealthEpisode& one) { return one.sensor == sensor && one.level >= HealthLevel::Warning; });
}

nlohmann::ordered_json Summary::episode_json(const HealthEpisode& one) const {
  nlohmann::ordered_json out = {{"sensor", one.sensor == kSystemSensor ? "drive" : sensors_.at(one.sensor).name},
                                {"trouble", name(one.trouble)},
                                {"level", name(one.level)},
                                {"cause", one.cause},
                                {"action", one.action},
                                {"begin_s", one.begin_s},
                                {"end_s", one.end_s}};
  if (one.begin) out["begin"] = iso_utc(*one.begin);
  if (one.end) out["end"] = iso_utc(*one.end);
  out["length_m"] = one.end_m - one.begin_m;
  if (one.place)
    out["place"] = {{"latitude_deg", one.place->latitude * kDegPerRad},
                    {"longitude_deg", one.place->longitude * kDegPerRad}};
  out["lasts"] = one.lasts;
  return out;
}

std::uint64_t Summary::wire_packets() const {
  std::uint64_t sum = 0;
  for (const auto& sensor : sensors_) sum += sensor.packets;
  return sum;
}

std::uint64_t Summary::lost(FaultKind kind) const {
  std::uint64_t sum = 0;
  for (const auto& sensor : sensors_)
    if (const auto it = sensor.faults.find(kind); it != sensor.faults.end()) sum += it->second.count;
  return sum;
}

nlohmann::ordered_json Summary::wheels_json(const Wheels& wheels) const {
  nlohmann::ordered_json out = {{"sensor", sensors_[wheels.sensor].name}};
  for (const auto& [kind, way] : {std::pair("speeds", wheels.speeds), std::pair("pulses", wheels.pulses)}) {
    if (way.messages == 0) continue;
    out[kind] = {{"messages", way.messages},
                 {"distance_m", way.wheels_m},
                 {"compared_s", way.compared_s},
                 {"compared_distance_m", way.compared_wheels_m},
                 {"compared_pos_distance_m", way.compared_pos_m},
                 {"disagreeing_s", way.disagreeing_s}};
  }
  return out;
}

nlohmann::ordered_json Summary::watch_json() const {
  nlohmann::ordered_json out = {
      {"images", watch_->images},          {"patches", watch_->patches}, {"images_standing", watch_->standing},
      {"images_dropped", watch_->dropped}, {"windows", watch_->windows}, {"drifts", watch_->drifts}};
  if (!watch_->last) return out;
  const calibration::CalibrationDrift& last = *watch_->last;
  const auto values = [](const calibration::HeadCorrection& by, const Eigen::Matrix4d& covariance) {
    const Eigen::Vector3d turn = by.head<3>() * kDegPerRad;
    const Eigen::Vector4d sigma = covariance.diagonal().cwiseSqrt();
    return nlohmann::ordered_json{
        {"turn_deg", {turn.x(), turn.y(), turn.z()}},
        {"turn_sigma_deg", {sigma[0] * kDegPerRad, sigma[1] * kDegPerRad, sigma[2] * kDegPerRad}},
        {"late_ms", by[3] * 1e3},
        {"late_sigma_ms", sigma[3] * 1e3}};
  };
  out["last_window"] = {
      {"begin", iso_utc(last.from)}, {"end", iso_utc(last.to)}, {"against_rig", values(last.error, last.covariance)}};
  if (last.change_covariance(0, 0) > 0)
    out["last_window"]["since_beginning"] = values(last.change, last.change_covariance);
  return out;
}

std::string Summary::watch_text() const {
  if (!watch_->last)
    return fmt::format("watch      {} lens images compared with the laser, no full window to judge\n", watch_->images);
  const calibration::CalibrationDrift& last = *watch_->last;
  const bool has_change = last.change_covariance(0, 0) > 0;
  const calibration::HeadCorrection& by = has_change ? last.change : last.error;
  const Eigen::Vector4d sigma = (has_change ? last.change_covariance : last.covariance).diagonal().cwiseSqrt();
  return fmt::format(
      "watch      {} lens images compared with the laser, {} drifts; at the end, against the {}: head turned by "
      "{:.3f}, "
      "{:.3f}, {:.3f} deg (+- {:.3f}), images late by {:.3f} ms (+- {:.3f})\n",
      watch_->images, watch_->drifts, has_change ? "beginning" : "rig", by.x() * kDegPerRad, by.y() * kDegPerRad,
      by.z() * kDegPerRad, sigma.head<3>().maxCoeff() * kDegPerRad, by[3] * 1e3, sigma[3] * 1e3);
}

nlohmann::ordered_json Summary::sensor_json(const Sensor& sensor) {
  nlohmann::ordered_json out = {
      {"name", sensor.name}, {"packets", sensor.packets}, {"bytes", sensor.bytes}, {"shed", sensor.shed}};
  out["decoded"] = {{"decoded_bytes", sensor.decoded.decoded_bytes},
                    {"ignored_bytes", sensor.decoded.ignored_bytes},
                    {"malformed_bytes", sensor.decoded.malformed_bytes},
                    {"messages", sensor.decoded.messages}};
  auto& faults = out["faults"] = nlohmann::ordered_json::array();
  for (const auto& [kind, line] : sensor.faults)
    faults.push_back({{"kind", name(kind)},
                      {"events", line.events},
                      {"count", line.count},
                      {"meaning", explanation(kind)},
                      {"first", line.first},
                      {"last", line.last}});
  return out;
}

nlohmann::ordered_json Summary::json() const {
  nlohmann::ordered_json out;
  out["journal"] = {{"packets", packets_}, {"bytes", bytes_}, {"sequence_gaps", gaps_}};
  if (removed_.segments > 0)
    out["journal"]["removed_by_ring"] = {
        {"segments", removed_.segments}, {"packets", removed_.packets}, {"bytes", removed_.bytes}};
  if (!ends_early_.empty()) out["ends_early"] = ends_early_;
  if (verdict_) {
    out["verdict"] = verdict_->json();
    auto& troubles = out["health"] = nlohmann::ordered_json::array();
    for (const HealthEpisode& one : episodes_) troubles.push_back(episode_json(one));
    if (episodes_not_kept_ > 0) out["health_not_listed"] = episodes_not_kept_;
  }
  if (solutions_)
    out["drive"] = {{"begin", iso_utc(first_)}, {"end", iso_utc(last_)},   {"duration_s", to_seconds(last_ - first_)},
                    {"path_m", path_m_},        {"solutions", solutions_}, {"good_solutions", good_solutions_}};
  for (const auto& [status, state] : solutions_by_status_) {
    out["drive"]["not_good"][drivers::ins_status_name(status)] = state.solutions;
    out["drive"]["not_good_s"][drivers::ins_status_name(status)] = to_seconds(state.lasted);
  }
  if (other_statuses_.solutions) {
    out["drive"]["not_good"]["other"] = other_statuses_.solutions;
    out["drive"]["not_good_s"]["other"] = to_seconds(other_statuses_.lasted);
  }
  if (!marks_.empty()) out["marks"] = marks_json();
  if (marks_not_kept_ > 0) out["marks_not_listed"] = marks_not_kept_;
  nlohmann::ordered_json states;
  for (int i = 0; i < kColourStates; ++i)
    if (by_state_[static_cast<std::size_t>(i)])
      states[name(static_cast<ColourState>(i))] = by_state_[static_cast<std::size_t>(i)];
  out["points"] = {{"returns", returns_},
                   {"total", points_},
                   {"coloured", coloured_points()},
                   {"coloured_share", share(coloured_points(), points_)},
                   {"by_state", states}};
  out["points"]["not_placed"] = unfused_;
  out["points"]["not_written"] = unwritten_;
  out["points"]["notes"] = notes_;
  nlohmann::ordered_json timing;
  for (int i = 0; i < 3; ++i)
    timing[name(static_cast<ExposureTiming>(i))] = exposures_by_timing_[static_cast<std::size_t>(i)];
  out["exposures"] = {{"total", exposures_},
                      {"by_timing", timing},
                      {"incomplete_images", incomplete_images_},
                      {"time_sigma_rms_us", exposure_sigma_.rms_us()},
                      {"time_sigma_largest_us", exposure_sigma_.largest_us}};
  if (map_) out["map"] = {{"crs", map_->crs}, {"name", map_->name}, {"positions", map_->words}};
  if (parts_) {
    out["parts"] = {{"split", parts_->split},
                    {"folder", parts_->folder},
                    {"files", parts_->files},
                    {"points", parts_->points},
                    {"bytes", parts_->bytes}};
    if (parts_->missing > 0) out["parts"]["missing"] = parts_->missing;
  }
  if (trajectory_) out["trajectory"] = trajectory_->json();
  if (watch_) out["watch"] = watch_json();
  for (const Wheels& wheels : wheels_) out["wheels"].push_back(wheels_json(wheels));
  auto& clocks = out["clocks"] = nlohmann::ordered_json::array();
  for (const auto& change : changes_)
    clocks.push_back({{"clock", change.clock < sensors_.size() ? sensors_[change.clock].name : "?"},
                      {"time", change.time ? nlohmann::ordered_json(iso_utc(*change.time)) : nlohmann::ordered_json()},
                      {"state", name(change.state)}});
  if (change_count_ > changes_.size()) out["clock_changes_not_listed"] = change_count_ - changes_.size();
  auto& sensors = out["sensors"] = nlohmann::ordered_json::array();
  for (const auto& sensor : sensors_) sensors.push_back(sensor_json(sensor));
  return out;
}

std::string Summary::text() const {
  std::string out;
  if (!ends_early_.empty()) out += fmt::format("ends early {}\n", ends_early_);
  if (solutions_)
    out += fmt::format("drive      {} to {} ({:.1f} s, {:.0f} m), {} of {} {} good\n", iso_utc(first_), iso_utc(last_),
                       to_seconds(last_ - first_), path_m_, good_solutions_, solutions_,
                       trajectory_ ? "poses of the trajectory" : "POS solutions");
  for (const auto& [status, state] : solutions_by_status_)
    out += fmt::format("           {} POS solutions not used, {:.1f} s; the receiver says: {}\n", state.solutions,
                       to_seconds(state.lasted), drivers::ins_status_name(status));
  if (other_statuses_.solutions)
    out += fmt::format("           {} POS solutions not used, {:.1f} s; the receiver says something else each time\n",
                       other_statuses_.solutions, to_seconds(other_statuses_.lasted));
  out += fmt::format("journal    {} packets, {:.1f} MB, {} gaps in the sequence\n", packets_,
                     static_cast<double>(bytes_) / 1e6, gaps_);
  if (removed_.segments > 0)
    out +=
        fmt::format("           the ring removed {} segments with {} packets, {:.1f} MB: a replay does not have them\n",
                    removed_.segments, removed_.packets, static_cast<double>(removed_.bytes) / 1e6);
  out += fmt::format("points     {}, {:.1f} % coloured", points_, 100 * share(coloured_points(), points_));
  for (int i = 0; i < kColourStates; ++i)
    if (by_state_[static_cast<std::size_t>(i)])
      out += fmt::format("; {} {}", name(static_cast<ColourState>(i)), by_state_[static_cast<std::size_t>(i)]);
  out += '\n';
  for (const auto& [reason, points] : unfused_)
    out += fmt::format("           {} returns not placed: {}\n", points, reason);
  for (const auto& [reason, points] : unwritten_)
    out += fmt::format("           {} points not written: {}\n", points, reason);
  for (const std::string& note : notes_) out += fmt::format("           {}\n", note);
  out += fmt::format(
      "exposures  {}: {} by event mark, {} by the camera's clock, {} unmatched; {} images incomplete; time sigma "
      "{:.2f} us rms, {:.2f} us largest\n",
      exposures_, exposures_by_timing_[0], exposures_by_timing_[1], exposures_by_timing_[2], incomplete_images_,
      exposure_sigma_.rms_us(), exposure_sigma_.largest_us);
  if (map_) out += fmt::format("map        {}, {}; positions {}\n", map_->crs, map_->name, map_->words);
  if (parts_) {
    out += fmt::format("parts      {} files of {} in the folder {}: {} points, {:.1f} MB\n", parts_->files,
                       parts_->split, parts_->folder, parts_->points, static_cast<double>(parts_->bytes) / 1e6);
    if (parts_->missing > 0)
      out += fmt::format("           {} points are not in them: a replay makes them whole\n", parts_->missing);
  }
  if (trajectory_) out += trajectory_->text();
  if (watch_) out += watch_text();
  for (const Wheels& wheels : wheels_)
    for (const auto& [kind, way] : {std::pair("speeds", wheels.speeds), std::pair("pulses", wheels.pulses)})
      if (way.messages > 0)
        out += fmt::format(
            "wheels     {} {} of {}: {:.1f} m; where both are known {:.1f} m, by the POS {:.1f} m; they disagree for "
            "{:.1f} of {:.1f} s\n",
            way.messages, kind, sensors_[wheels.sensor].name, way.wheels_m, way.compared_wheels_m, way.compared_pos_m,
            way.disagreeing_s, way.compared_s);
  for (std::size_t i = 0; i < marks_.size(); ++i)
    out += fmt::format("mark {:5} {} {}\n", i + 1,
                       marks_[i].time ? iso_utc(*marks_[i].time) : fmt::format("{:.1f} s", marks_[i].drive_s),
                       marks_[i].command.note);
  if (marks_not_kept_ > 0) out += fmt::format("           {} later marks are not listed\n", marks_not_kept_);
  for (const auto& change : changes_)
    out += fmt::format("clock      {:24} {} {}\n", change.time ? iso_utc(*change.time) : "without GPS time",
                       change.clock < sensors_.size() ? sensors_[change.clock].name : "?", name(change.state));
  if (change_count_ > changes_.size())
    out += fmt::format("           {} later changes of clocks are not listed\n", change_count_ - changes_.size());
  for (const auto& sensor : sensors_) {
    const bool is_system = &sensor == &sensors_.front();
    if (is_system && !sensor.packets && sensor.faults.empty()) continue;
    if (!is_system && !sensor.packets) {
      out += fmt::format("{:10} no packet came\n", sensor.name);
    } else {
      out += fmt::format("{:10} {} packets, {:.1f} MB", sensor.name, sensor.packets,
                         static_cast<double>(sensor.bytes) / 1e6);
      if (sensor.shed) out += fmt::format(", {} shed (recorded, not fused)", sensor.shed);
      out += sensor.faults.empty() ? ", nothing lost\n" : "\n";
    }
    // Faults without a consequence are events, such as connections at the beginning and at the end of a drive.
    const bool are_events = !had_trouble(static_cast<SensorId>(&sensor - sensors_.data()));
    if (are_events && !sensor.faults.empty()) {
      std::string kinds;
      for (const auto& [kind, line] : sensor.faults)
        kinds += fmt::format("{}{} x{}", kinds.empty() ? "" : ", ", name(kind), line.count);
      out += fmt::format("           events without a consequence: {}\n", kinds);
      continue;
    }
    for (const auto& [kind, line] : sensor.faults)
      out += fmt::format("           {} x{}{}: {}. {}\n", name(kind), line.count,
                         line.events == line.count ? "" : fmt::format(" ({} events)", line.events), explanation(kind),
                         line.last);
  }
  if (verdict_) out += verdict_->text();
  return out;
}

}  // namespace hueline::runtime
