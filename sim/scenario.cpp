#include "sim/scenario.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "sim/noise.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {
namespace {

/// Increase this number when the same scenario is to give other bytes than before; folders of the cache made before are
/// then not used.
constexpr int kRendererRevision = 2;

/// Keys that came after the second revision. With its default value such a key changes no byte of a drive, so the text
/// leaves it out then, and scenarios that were rendered before the key existed keep their fingerprint.
constexpr std::array kYoungKeys{"scene=",
                                "street.sky_brightness=",
                                "alley.",
                                "traffic.",
                                "tunnel.",
                                "targets.",
                                "camera.shutter=",
                                "camera.row_time_us=",
                                "camera.strobe_jitter_us=",
                                "camera.auto_exposure",
                                "camera.reports_exposure=",
                                "camera.payload=",
                                "camera.jpeg_quality=",
                                "ins.grade=",
                                "ins.gyro_bias",
                                "ins.angle_random",
                                "ins.velocity_random",
                                "ins.accelerometer",
                                "ins.wheel_s=",
                                "ins.high_variance_m=",
                                "laser.lines_per_s=",
                                "laser.points_per_s=",
                                "wheel.",
                                "street.car_paints=",
                                "street.wetness=",
                                "street.daylight=",
                                "street.lamp_light=",
                                "street.car_lights=",
                                "street.glazed_fronts=",
                                "street.wire_mm=",
                                "street.stake_spacing_m=",
                                "street.fence=",
                                "glass.",
                                "drive.headlights=",
                                "laser.detection_range_m=",
                                "camera.drift."};

bool is_young(std::string_view line) {
  return std::any_of(kYoungKeys.begin(), kYoungKeys.end(), [&](std::string_view key) { return line.starts_with(key); });
}

std::string digits(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}

/// Writes every key and its value, in the order of `visit()`.
class Text final : public Keys {
 public:
  std::vector<std::string> lines;

  void one_of(std::initializer_list<const char*>) override {}

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range&, bool is_whole) override {
    return put(key, is_whole ? std::to_string(static_cast<std::int64_t>(*value)) : digits(*value));
  }
  bool take_flag(const Key& key, bool& value) override { return put(key, value ? "on" : "off"); }
  bool take_text(const Key& key, std::string& value, const TextForm&) override { return put(key, value); }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    return chosen && put(key, words[*chosen]);
  }
  bool take_numbers(const Key& key, std::vector<double>& values, const Range&, Count, bool) override {
    for (const double value : values) put(key, digits(value));
    return false;
  }
  bool take_texts(const Key& key, std::vector<std::string>& values, const TextForm&) override {
    for (const std::string& value : values) put(key, value);
    return false;
  }
  bool take_section(const Key& key, const KeySection& section) override {
    if (section.is_there) inside(std::string(key.name), section.make());
    return false;
  }
  bool take_list(const Key& key, const KeyList& list, Count) override {
    for (std::size_t i = 0; i < list.size; ++i)
      inside(std::string(key.name) + "[" + std::to_string(i) + "]", list.at(i));
    return false;
  }
  bool take_kind(const Key& key, const KeyKinds& kinds) override {
    return kinds.chosen && put(key, kinds.words[*kinds.chosen]);
  }

 private:
  bool put(const Key& key, const std::string& text) {
    lines.push_back(path_ + std::string(key.name) + "=" + text + "\n");
    return false;
  }
  void inside(const std::string& name, const KeyGroup& group) {
    const std::string before = path_;
    path_ += name + ".";
    group.visit(*this);
    path_ = before;
  }

  std::string path_;
};

GpsNs from_seconds(double s) { return static_cast<GpsNs>(std::llround(s * 1e9)); }

}  // namespace

GpsNs Scenario::begin_gps_ns() const {
  return (static_cast<GpsNs>(start_gps_week) * 604800 + start_time_of_week_s) * 1'000'000'000;
}
GpsNs Scenario::sensors_begin_gps_ns() const { return begin_gps_ns() + from_seconds(lead_in_s); }
GpsNs Scenario::sensors_end_gps_ns() const { return sensors_begin_gps_ns() + from_seconds(duration_s); }
GpsNs Scenario::end_gps_ns() const { return sensors_end_gps_ns() + 1'000'000'000; }

KeyError Scenario::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (lead_in_s != std::floor(lead_in_s)) return {"lead_in_s", "must be a whole number of seconds"};
  if (1000 % ins.rate_hz != 0) return {"ins.rate_hz", "must divide 1000"};
  if (camera.lens_width % 2 != 0 || camera.lens_height % 2 != 0)
    return {"camera.lens_width", "and camera.lens_height must be even: a Bayer cell is 2 x 2"};
  if (camera.lenses.empty()) return {"camera.lenses", "must name at least one lens"};
  if (camera.lenses.size() > static_cast<std::size_t>(camera.stack_columns * camera.stack_rows))
    return {"camera.stack_columns", "x camera.stack_rows must hold every lens"};
  if (camera.payload == ImagePayload::JpegPlanes &&
      (camera.lenses.size() > 6 || 6 % camera.stack_columns != 0 || camera.stack_columns * camera.stack_rows != 6))
    return {"camera.payload",
            "jpeg_planes is that of a head of six lenses: camera.stack_columns x camera.stack_rows must be 1 x 6, 2 x "
            "3, 3 x 2 or 6 x 1"};
  if (camera.exposure_us * 1e-6 * camera.rate_hz >= 1)
    return {"camera.exposure_us", "must be shorter than the time between exposures"};
  if (camera.reports_exposure && camera.payload == ImagePayload::Raw && camera.auto_exposure &&
      camera.auto_exposure_sets != CameraConfig::AutoSets::Shutter)
    return {"camera.reports_exposure",
            "needs payload: jpeg_planes, which has room for the exposure of each lens, or auto_exposure_sets: shutter"};
  if (camera.auto_exposure && camera.auto_exposure_sets != CameraConfig::AutoSets::Gains &&
      camera.exposure_us * camera.auto_exposure_limit * 1e-6 * camera.rate_hz >= 1)
    return {"camera.auto_exposure_limit", "x camera.exposure_us must be shorter than the time between exposures"};
  if (camera.shutter == ShutterKind::Rolling &&
      (camera.exposure_us + camera.row_time_us * camera.lens_height) * 1e-6 * camera.rate_hz >= 1)
    return {"camera.row_time_us",
            "x camera.lens_height and camera.exposure_us must fit into the time between exposures"};
  if (laser.min_range_m >= laser.max_range_m) return {"laser.min_range_m", "must be below laser.max_range_m"};
  if (alley.near_m > alley.far_m) return {"alley.near_m", "must not be above alley.far_m"};
  if (scene == SceneKind::Tunnel && street.curve_deg != 0)
    return {"street.curve_deg", "must be 0 with scene tunnel, because a tunnel is straight"};
  if (scene == SceneKind::Traffic && street.road_width_m < 11)
    return {"street.road_width_m", "must be at least 11 with scene traffic, which has two lanes each way"};
  if (std::abs(drive.lane_offset_m) > street.road_width_m / 2 - 1)
    return {"drive.lane_offset_m", "must keep the vehicle on the road"};
  if (const std::string wrong = check_turns(*this); !wrong.empty()) return {"", wrong};
  for (std::size_t i = 0; i < faults.size(); ++i)
    if (const std::string wrong = faults[i].validate(); !wrong.empty())
      return {"faults[" + std::to_string(i) + "]", wrong};
  return {};
}

std::string Scenario::text() const {
  Text writer, usual;
  Scenario copy = *this, defaults;
  copy.visit(writer);
  defaults.visit(usual);
  std::string out;
  for (const std::string& line : writer.lines)
    if (!is_young(line) || std::find(usual.lines.begin(), usual.lines.end(), line) == usual.lines.end()) out += line;
  if (surroundings) out += "surroundings=" + surroundings->identity() + "\n";
  return out;
}

std::string Scenario::fingerprint() const {
  std::uint64_t hash = scrambled(kRendererRevision);
  for (const char c : text()) hash = scrambled(hash ^ static_cast<unsigned char>(c));
  char out[17];
  std::snprintf(out, sizeof out, "%016llx", static_cast<unsigned long long>(hash));
  return out;
}

}  // namespace hueline::sim
