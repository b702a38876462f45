#include "config/rig.hpp"

#include <fmt/format.h>

#include <map>

#include "config/rig_head.hpp"
#include "config/rig_time.hpp"
#include "config/shipped.hpp"

namespace hueline::config {
namespace {

fusion::Colouring::Config read_colouring(Section section) {
  fusion::Colouring::Config out;
  out.method = section.choice<fusion::ColourMethod>("method", {{"lens", fusion::ColourMethod::Lens}, {"panorama", fusion::ColourMethod::Panorama}});
  out.exposure_interval = from_seconds(section.number("exposure_interval_s", {0, 60}, 0.0));
  out.neighbours = static_cast<int>(section.integer("neighbours", {0, 15}, out.neighbours));
  out.lost_image_neighbours = static_cast<int>(section.integer("lost_image_neighbours", {0, 15}, out.lost_image_neighbours));
  out.balance_neighbours = section.boolean("balance_neighbours", out.balance_neighbours);
  out.max_lateness = from_seconds(section.number("max_lateness_s", {0.01, 60}, to_seconds(out.max_lateness)));
  out.trajectory.max_gap = from_seconds(section.number("max_pose_gap_s", {0.001, 10}, to_seconds(out.trajectory.max_gap)));
  if (const std::string wrong = out.validate(); !wrong.empty()) section.refuse("method", wrong);
  section.finish();
  return out;
}

std::string read_crs(Section section) {
  const std::string crs = section.text("crs", "utm");
  const bool is_epsg = crs.rfind("EPSG:", 0) == 0 && crs.size() > 5 && crs.size() <= 11 && crs.find_first_not_of("0123456789", 5) == std::string::npos;
  if (crs != "utm" && !is_epsg) section.refuse("crs", fmt::format("found '{}', allowed: utm, or EPSG: and a number (EPSG:25832)", crs));
  section.finish();
  return crs;
}

/// Only the planes of lenses that the head has are worth decoding.
void leave_out_unused_lenses(const fusion::CameraHeadGeometry& head, std::vector<Sensor>& sensors) {
  for (Sensor& sensor : sensors) {
    auto* camera = std::get_if<CameraSensor>(&sensor.device);
    if (!camera || camera->decoder.payload != drivers::ImagePayload::JpegPlanes) continue;
    auto& decoder = camera->decoder;
    auto& planes = decoder.planes;
    const std::uint32_t width = decoder.width / planes.lens_columns, height = decoder.height / planes.lens_rows();
    planes.is_used.fill(false);
    for (const fusion::LensMount& lens : head.lenses) {
      if (lens.camera != sensor.id) continue;
      for (std::uint32_t i = 0; i < planes.is_used.size(); ++i) {
        const std::uint32_t x = i % planes.lens_columns * width, y = i / planes.lens_columns * height;
        if (lens.x_offset < x + width && x < lens.x_offset + lens.intrinsics.width && lens.y_offset < y + height &&
            y < lens.y_offset + lens.intrinsics.height)
          planes.is_used[i] = true;
      }
    }
  }
}

Rig read(Section root, std::string text) {
  Rig rig;
  rig.text = std::move(text);
  rig.name = root.text("rig");
  rig.sensors = read_sensors(root, rig.geometry, rig.sync);
  std::map<std::string, SensorId> cameras;
  for (const Sensor& sensor : rig.sensors)
    if (std::holds_alternative<CameraSensor>(sensor.device)) cameras[sensor.name] = sensor.id;
  if (root.has("head")) {
    if (cameras.empty()) root.refuse("head", "a head needs a sensor with driver genicam that delivers its images");
    rig.geometry.head = read_head(root.section("head"), cameras);
    leave_out_unused_lenses(rig.geometry.head, rig.sensors);
  } else if (!cameras.empty()) {
    root.refuse("head", "is missing: where the camera's lenses sit");
  }
  if (const std::string wrong = rig.geometry.validate(); !wrong.empty()) root.refuse("head", wrong);
  if (root.has("time")) read_time(root.section("time"), rig.sync);
  if (const std::string wrong = rig.sync.validate(); !wrong.empty()) root.refuse("sensors", wrong);
  rig.colouring = read_colouring(root.section("colouring"));
  rig.crs = root.has("cloud") ? read_crs(root.section("cloud")) : "utm";
  root.finish();
  return rig;
}

}  // namespace

const char* Sensor::driver() const {
  struct Name {
    const char* operator()(const VelodyneSensor&) const { return "velodyne"; }
    const char* operator()(const NovatelSensor&) const { return "novatel"; }
    const char* operator()(const CameraSensor&) const { return "genicam"; }
    const char* operator()(const PpsSensor&) const { return "pps"; }
    const char* operator()(const ProfileScannerSensor&) const { return "profile_scanner"; }
    const char* operator()(const WheelSensor&) const { return "wheel"; }
  };
  return std::visit(Name{}, device);
}

bool Sensor::is_sheddable() const {
  return std::holds_alternative<VelodyneSensor>(device) || std::holds_alternative<ProfileScannerSensor>(device) ||
         std::holds_alternative<CameraSensor>(device);
}

Arrivals Sensor::arrivals() const {
  if (const auto* laser = std::get_if<VelodyneSensor>(&device); laser && std::holds_alternative<drivers::PcapSource::Config>(laser->source))
    return Arrivals::Recorded;
  if (const auto* laser = std::get_if<ProfileScannerSensor>(&device);
      laser && std::holds_alternative<drivers::PcapSource::Config>(laser->source))
    return Arrivals::Recorded;
  if (const auto* wheel = std::get_if<WheelSensor>(&device); wheel && std::holds_alternative<drivers::CanLogSource::Config>(wheel->source))
    return Arrivals::Recorded;
  if (const auto* pos = std::get_if<NovatelSensor>(&device); pos && std::holds_alternative<drivers::FileSource::Config>(pos->source))
    return Arrivals::Unknown;
  return Arrivals::Live;
}

std::vector<std::string> Rig::sensor_names() const {
  std::vector<std::string> names{"hueline"};
  for (const Sensor& sensor : sensors) names.push_back(sensor.name);
  return names;
}

Rig parse_rig(const std::string& text, const std::string& name) { return read(Section::load_text(text, name), text); }

Rig load_rig(const std::string& path) {
  const std::string named = configuration_named(path, "rigs");
  return parse_rig(read_configuration(named), named);
}

}  // namespace hueline::config
