#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "apps/inspect/inspect.hpp"
#include "apps/inspect/unfinished_run.hpp"
#include "apps/log.hpp"
#include "config/key_reader.hpp"
#include "config/rig.hpp"
#include "config/sheet.hpp"
#include "core/calendar.hpp"
#include "core/input_file.hpp"
#include "core/mounting.hpp"
#include "drivers/trajectory/smrmsg_file.hpp"
#include "runtime/readiness.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/cloud_file.hpp"
#include "storage/e57_reader.hpp"
#include "storage/las_fields.hpp"
#include "storage/las_reader.hpp"
#include "storage/text_cloud.hpp"

/// Formats that are whole files: clouds and configurations.
namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

struct Extent {
  double min = std::numeric_limits<double>::infinity(), max = -std::numeric_limits<double>::infinity();
  void add(double v) {
    if (std::isnan(v)) return;
    min = std::min(min, v);
    max = std::max(max, v);
  }
  Json json() const { return min <= max ? Json::array({min, max}) : Json(); }
};

}  // namespace

Inspection inspect_las(const std::string& path) {
  auto reader = storage::LasReader::open(path);
  if (!reader.ok()) return {nullptr, reader.error()};
  Inspection out;
  Extent x, y, z;
  std::uint64_t points = 0, coloured = 0;
  bool has_time = false;
  GpsTime first{}, last{};
  std::map<std::uint64_t, std::uint64_t> states;
  const auto* state = reader->extra_field(storage::las_extra_name<&ColouredPoint::state>());
  std::vector<storage::LasPoint> batch;
  for (;;) {
    if (Status read = reader->next(batch); !read.ok()) {
      out.trouble = read;
      break;
    }
    if (batch.empty()) break;
    for (const auto& point : batch) {
      ++points;
      coloured += point.red || point.green || point.blue;
      x.add(point.x);
      y.add(point.y);
      z.add(point.z);
      if (state) ++states[static_cast<std::uint64_t>(storage::LasReader::extra(point, *state))];
      if (const auto time = reader->gps_time(point)) {
        first = has_time ? std::min(first, *time) : *time;
        last = has_time ? std::max(last, *time) : *time;
        has_time = true;
      }
    }
  }
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "LAS";
  json["points"] = points;
  if (reader->has_colour()) json["points_with_colour"] = coloured;
  json["x"] = x.json();
  json["y"] = y.json();
  json["z"] = z.json();
  if (has_time) {
    json["begin"] = iso_utc(first);
    json["end"] = iso_utc(last);
  }
  for (const auto& [value, count] : states) json["colour_state"][name(static_cast<ColourState>(value))] = count;
  std::vector<std::string> fields;
  for (const auto& field : reader->extra_fields()) fields.push_back(field.name);
  json["extra_fields"] = fields;
  const Result<std::string> crs = storage::crs_wkt(*reader);
  if (!crs.ok()) return {nullptr, crs.error()};
  json["crs"] = *crs;
  const Result<bool> has_unread = storage::has_unread_crs(*reader);
  if (!has_unread.ok()) return {nullptr, has_unread.error()};
  if (*has_unread) json["crs_not_read"] = "GeoTIFF keys that describe a projection that is not known here";
  if (const Status run = check_run_of(path, reader->header());
      out.trouble.ok() && !run.ok() && run.error().code == ErrorCode::Truncated)
    out.trouble = run;
  return out;
}

Inspection inspect_e57(const std::string& path) {
  auto reader = storage::E57Reader::open(path);
  if (!reader.ok()) return {nullptr, reader.error()};
  Inspection out;
  std::array<Extent, 3> place;
  std::map<std::string, Extent> fields;
  std::uint64_t points = 0, without_place = 0;
  Json scans = Json::array();
  std::vector<std::vector<double>> columns;
  std::vector<Point<Scanner>> places;
  for (std::size_t i = 0; i < reader->scans().size() && out.trouble.ok(); ++i) {
    const storage::E57Scan& scan = reader->scans()[i];
    const auto& pose = scan.T_world_scanner;
    Json about;
    if (!scan.name.empty()) about["name"] = scan.name;
    if (!scan.sensor.empty()) about["sensor"] = scan.sensor;
    if (scan.begin) about["begin"] = iso_utc(*scan.begin);
    about["points"] = scan.points;
    about["position_m"] = {pose.translation.x(), pose.translation.y(), pose.translation.z()};
    about["turn_deg"] = Eigen::AngleAxisd(pose.rotation).angle() * 180 / std::numbers::pi;
    scans.push_back(about);
    out.trouble = reader->begin(i);
    while (out.trouble.ok()) {
      out.trouble = reader->next(columns);
      storage::e57_places(scan, columns, places);
      if (places.empty()) break;
      points += places.size();
      for (const Point<Scanner>& one : places) {
        const Eigen::Vector3d at = (pose * one).xyz;
        without_place += !at.allFinite();
        for (Eigen::Index axis = 0; axis < at.size(); ++axis) place[static_cast<std::size_t>(axis)].add(at[axis]);
      }
      for (std::size_t k = 0; k < columns.size(); ++k)
        for (const double value : columns[k]) fields[scan.columns[k].name].add(value);
    }
  }
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "E57";
  json["points"] = points;
  if (without_place > 0) json["points_without_place"] = without_place;
  for (std::size_t axis = 0; axis < place.size(); ++axis) json[std::string(1, "xyz"[axis])] = place[axis].json();
  for (const auto& [field, extent] : fields) json["fields"][field] = extent.json();
  json["scans"] = scans;
  if (reader->images() > 0) json["images"] = reader->images();
  json["crs"] = reader->crs();
  return out;
}

namespace {

Inspection cloud_facts(const Result<storage::PcdCloud>& cloud, const std::string& format) {
  if (!cloud.ok()) return {nullptr, cloud.error()};
  Inspection out;
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = format;
  json["points"] = cloud->points();
  for (std::size_t i = 0; i < cloud->fields.size(); ++i) {
    Extent extent;
    for (const double value : cloud->columns[i]) extent.add(value);
    json["fields"][cloud->fields[i]] = extent.json();
  }
  return out;
}

}  // namespace

Inspection inspect_cloud(const std::string& path, const char* format) {
  return cloud_facts(storage::read_cloud(path), format);
}

Inspection inspect_text_cloud(const std::string& path) {
  const Result<std::string> text =
      read_input(path, storage::kMostCloudBytes, "a cloud that has to be whole in memory,");
  if (!text.ok()) return {nullptr, text.error()};
  if (storage::is_ptx(*text)) return cloud_facts(storage::decode_ptx(*text, path, storage::PtxFrame::File), "PTX");
  return cloud_facts(storage::decode_text_cloud(*text, path), storage::text_cloud_kind(*text));
}

Inspection inspect_smrmsg(const std::string& path) {
  auto file = drivers::SmrmsgFile::open(path);
  if (!file.ok()) return {nullptr, file.error()};
  Inspection out;
  constexpr std::array<const char*, 9> kSigmas{"east_m", "north_m",  "up_m",      "east_m_s",   "north_m_s",
                                               "up_m_s", "roll_deg", "pitch_deg", "heading_deg"};
  std::array<Extent, kSigmas.size()> sigmas;
  Extent seconds;
  std::uint64_t records = 0;
  for (;;) {
    const auto record = file->next();
    if (!record.ok()) {
      out.trouble = record.error();
      break;
    }
    if (!*record) break;
    ++records;
    seconds.add((*record)->second);
    for (std::size_t i = 0; i < sigmas.size(); ++i)
      sigmas[i].add(i < 6 ? (*record)->sigma[i] : (*record)->sigma[i] * 180 / std::numbers::pi);
  }
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "SMRMSG";
  json["records"] = records;
  if (file->impossible() > 0) json["impossible_records"] = file->impossible();
  if (file->bytes_at_end() > 0) json["bytes_at_end"] = file->bytes_at_end();
  json["gps_second_of_week"] = seconds.json();
  for (std::size_t i = 0; i < sigmas.size(); ++i) json["sigma"][kSigmas[i]] = sigmas[i].json();
  return out;
}

namespace {

std::unique_ptr<Json> rig_facts(const std::string& path) {
  const config::Rig rig = config::load_rig(path);
  auto found = std::make_unique<Json>();
  Json& json = *found;
  json["format"] = "rig";
  json["rig"] = rig.name;
  for (const auto& sensor : rig.sensors) json["sensors"][sensor.name] = sensor.driver();
  json["lenses"] = rig.geometry.head.lenses.size();
  json["crs"] = rig.map.crs;
  // Each value is allowed by itself; together they may not be.
  for (const runtime::Finding& one : runtime::check_rig(rig))
    log_warning("{}: {}; {}", one.about, one.text, one.action);
  return found;
}

std::unique_ptr<Json> sheet_facts(const std::string& path) {
  const config::Sheet sheet = config::load_sheet(path);
  auto found = std::make_unique<Json>(Json{{"format", "score sheet"}, {"ray_returns", sheet.ray_returns}});
  for (const auto& scenario : sheet.scenarios) (*found)["scenarios"].push_back(scenario.string());
  return found;
}

/// What `calibrate` writes for the rig: a lens, or where something sits.
std::unique_ptr<Json> calibration_facts(config::Section root, const std::vector<std::string>& mountings) {
  auto found = std::make_unique<Json>(Json{{"format", "calibration"}});
  if (root.has("lens")) {
    const auto lens = config::read_config<fusion::CameraIntrinsics>(root.section("lens"));
    (*found)["lens"] = {{"model", lens.model == fusion::LensModel::Brown ? "brown" : "kannala_brandt"},
                        {"width", lens.width},
                        {"height", lens.height},
                        {"focal_px", {lens.focal_px.x(), lens.focal_px.y()}},
                        {"principal_point_px", {lens.principal_point_px.x(), lens.principal_point_px.y()}}};
  }
  for (const std::string& key : mountings) {
    if (!root.has(key)) continue;
    const auto mounting = config::read_config<Mounting>(root.section(key));
    const Eigen::AngleAxisd turn(mounting.rotation());
    (*found)[key] = {{"position_m", {mounting.position_m.x(), mounting.position_m.y(), mounting.position_m.z()}},
                     {"turn_deg", turn.angle() * 180 / std::numbers::pi}};
  }
  root.finish();
  return found;
}

}  // namespace

Inspection inspect_yaml(const std::string& path) {
  const std::vector<std::string> mountings = {"T_body_scanner", "T_body_head", "T_head_lens", "T_lens_scanner"};
  try {
    const config::Section root = config::Section::load_file(path);
    const auto has_any = [&](const std::vector<std::string>& keys) {
      return std::ranges::any_of(keys, [&](const auto& key) { return root.has(key); });
    };
    // What the author meant it to be: by the keys that stand in no other kind.
    if (has_any({"rig", "sensors", "colouring", "head"})) return {rig_facts(path), {}};
    if (has_any({"scenarios", "ray_returns"})) return {sheet_facts(path), {}};
    if (has_any({"lens"}) || has_any(mountings)) return {calibration_facts(root, mountings), {}};
    return {nullptr, {}, true};
  } catch (const config::ConfigError& e) {
    return {nullptr, Error{ErrorCode::Invalid, e.what()}};
  }
}

}  // namespace hueline::apps
