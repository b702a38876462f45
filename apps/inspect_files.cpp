#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "apps/inspect.hpp"
#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "core/calendar.hpp"
#include "storage/las_reader.hpp"
#include "storage/pcd_reader.hpp"

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
  const auto* state = reader->extra_field("colour_state");
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
  json["crs"] = reader->wkt();
  return out;
}

Inspection inspect_pcd(const std::string& path) {
  auto cloud = storage::read_pcd(path);
  if (!cloud.ok()) return {nullptr, cloud.error()};
  Inspection out;
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "PCD";
  json["points"] = cloud->points();
  for (std::size_t i = 0; i < cloud->fields.size(); ++i) {
    Extent extent;
    for (const double value : cloud->columns[i]) extent.add(value);
    json["fields"][cloud->fields[i]] = extent.json();
  }
  return out;
}

Inspection inspect_yaml(const std::string& path) {
  Inspection out;
  std::string as_rig;
  try {
    const config::Rig rig = config::load_rig(path);
    out.found = std::make_unique<Json>();
    Json& json = *out.found;
    json["format"] = "rig";
    json["rig"] = rig.name;
    for (const auto& sensor : rig.sensors) json["sensors"][sensor.name] = sensor.driver();
    json["lenses"] = rig.geometry.head.lenses.size();
    json["crs"] = rig.crs;
    return out;
  } catch (const config::ConfigError& e) {
    as_rig = e.what();
  }
  try {
    const sim::Scenario scenario = config::load_scenario(path);
    out.found = std::make_unique<Json>();
    (*out.found)["format"] = "scenario";
    (*out.found)["duration_s"] = scenario.duration_s;
    (*out.found)["seed"] = scenario.seed;
    (*out.found)["fingerprint"] = scenario.fingerprint();
    return out;
  } catch (const config::ConfigError& e) {
    return {nullptr, Error{ErrorCode::Malformed, fmt::format("as a rig: {}\nas a scenario: {}", as_rig, e.what())}};
  }
}

}  // namespace hueline::apps
