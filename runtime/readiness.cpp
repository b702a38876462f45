#include "runtime/readiness.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "runtime/host_settings.hpp"
#include "runtime/sensor_values.hpp"
#include "storage/projection.hpp"

namespace hueline::runtime {
namespace {

using drivers::Role;

constexpr double kVehicle_m = 10;  // no sensor is farther from the centre of navigation

/// A UDP port at which a sensor is heard.
struct HeardPort {
  std::string sensor, port, bind, group, source;

  /// Returns whether the two do not hear their own datagrams alone. The kernel refuses the second socket of a port, but
  /// for multicast groups, where it gives each socket the datagrams of all groups: the senders tell these apart.
  bool collides(const HeardPort& other) const {
    if (port != other.port) return false;
    if (bind != other.bind && bind != kAnyInterface && other.bind != kAnyInterface) return false;
    const bool may_share = !group.empty() && !other.group.empty();
    return !may_share || source == other.source || source.empty() || other.source.empty();
  }

  static constexpr const char* kAnyInterface = "0.0.0.0";
};

/// Adds a finding for each pair of sensors that are reached in the same way.
void find_shared_addresses(const config::Rig& rig, std::vector<Finding>& out) {
  std::map<std::string, std::string> owners;
  std::vector<HeardPort> heard;
  for (const auto& sensor : rig.sensors) {
    const auto values = values_of(sensor);
    const auto value = [&](const char* key) {
      const auto found = values.find(key);
      return found == values.end() ? std::string() : found->second;
    };
    std::vector<std::string> ways;
    for (const char* key : {"address", "serial", "device", "socket", "serial.device", "can.interface"})
      if (!value(key).empty()) ways.push_back(fmt::format("{} {}", key, value(key)));
    if (!value("tcp.host").empty()) ways.push_back(fmt::format("tcp {}:{}", value("tcp.host"), value("tcp.port")));
    for (const std::string section : {"udp.", "cannelloni."}) {
      const auto of_section = [&](const char* key) { return value((section + key).c_str()); };
      std::istringstream ports(of_section("ports"));
      for (HeardPort one{sensor.name, "", of_section("bind_address"), of_section("multicast_group"),
                         of_section("source_address")};
           ports >> one.port;) {
        const auto other = std::ranges::find_if(
            heard, [&](const HeardPort& known) { return known.sensor != one.sensor && known.collides(one); });
        if (other != heard.end())
          out.push_back({true, sensor.name, fmt::format("is heard at UDP port {}, as is {}", one.port, other->sensor),
                         one.group.empty() ? "give each sensor its own port, or its own bind_address"
                                           : "give each sensor its own port, or name its sender (source_address)"});
        heard.push_back(one);
      }
    }
    for (const std::string& way : ways)
      if (const auto [owner, is_new] = owners.try_emplace(way, sensor.name); !is_new)
        out.push_back({true, sensor.name, fmt::format("is reached by {}, as is {}", way, owner->second),
                       "give each sensor its own address"});
  }
}

void find_marks_not_asked_for(const config::Rig& rig, std::vector<Finding>& out) {
  for (const auto& sensor : rig.sensors) {
    if (sensor.type->role != Role::Pos) continue;
    const auto values = values_of(sensor);
    const auto inputs = values.find("logs.mark_inputs");
    if (inputs == values.end()) continue;
    for (const auto& camera : rig.sync.cameras)
      if (camera.mark_input > 0 &&
          (" " + inputs->second).find(fmt::format(" {} ", camera.mark_input)) == std::string::npos)
        out.push_back({true, rig.sensor_names().at(camera.camera),
                       fmt::format("its strobe is at event input {}, but {} is asked for the marks of input {}only",
                                   camera.mark_input, sensor.name, inputs->second),
                       "set event_input of the camera, or logs.mark_inputs of the receiver"});
  }
}

void check_lenses(const fusion::CameraHeadGeometry& head, std::vector<Finding>& out) {
  const auto& lenses = head.lenses;
  for (std::size_t i = 0; i < lenses.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto &a = lenses[i], &b = lenses[j];
      const auto apart = [](std::uint32_t begin_a, std::uint32_t size_a, std::uint32_t begin_b, std::uint32_t size_b) {
        return begin_a >= begin_b + size_b || begin_b >= begin_a + size_a;
      };
      if (a.camera == b.camera && !apart(a.x_offset, a.intrinsics.width, b.x_offset, b.intrinsics.width) &&
          !apart(a.y_offset, a.intrinsics.height, b.y_offset, b.intrinsics.height))
        out.push_back({true, a.name, fmt::format("has the same region of the image as {}", b.name),
                       "correct offset_px, width or height"});
    }
  for (const auto& lens : lenses) {
    const double wide = std::max(lens.intrinsics.width, lens.intrinsics.height);
    const Eigen::Vector2d focal = lens.intrinsics.focal_px, principal = lens.intrinsics.principal_point_px;
    // A fisheye of 250 deg across has 0.23 times its image; a tele lens of 3 deg has 20 times.
    if (focal.minCoeff() < 0.15 * wide || focal.maxCoeff() > 20 * wide)
      out.push_back({true, lens.name,
                     fmt::format("a focal length of {:.0f} px cannot fit an image of {} x {}", focal.x(),
                                 lens.intrinsics.width, lens.intrinsics.height),
                     "focal_px is in pixels of the lens image as the rig uses it"});
    if (principal.x() < 0 || principal.y() < 0 || principal.x() > lens.intrinsics.width ||
        principal.y() > lens.intrinsics.height)
      out.push_back({true, lens.name, "its principal point is outside its image", "correct principal_point_px"});
  }
  // Where down is in the images of the lenses that look to the side: all should agree.
  std::map<std::string, double> down;
  double sum_x = 0, sum_y = 0;
  for (const auto& lens : lenses) {
    const Eigen::Matrix3d R = (head.T_body_head.rotation * lens.T_head_lens.rotation).toRotationMatrix();
    if (std::abs(R(2, 2)) > 0.7) continue;  // looks up or down
    const Eigen::Vector3d in_lens = R.transpose() * Eigen::Vector3d(0, 0, -1);
    down[lens.name] = portable::atan2(in_lens.y(), in_lens.x());
    sum_x += portable::cos(down[lens.name]);
    sum_y += portable::sin(down[lens.name]);
  }
  if (down.size() < 3) return;
  const double most = portable::atan2(sum_y, sum_x);
  for (const auto& [name, angle] : down) {
    const double off_deg = std::abs(std::remainder(angle - most, 2 * std::numbers::pi)) * kDegPerRad;
    if (off_deg > 60)
      out.push_back({true, name,
                     fmt::format("is turned by {:.0f} deg about its axis against the other lenses: {}", off_deg,
                                 off_deg > 120 ? "upside down" : "on its side"),
                     "correct its T_head_lens, or turn the camera"});
  }
}

void check_mounting(const std::string& name, const Eigen::Vector3d& lever, std::vector<Finding>& out) {
  if (lever.norm() <= kVehicle_m) return;
  out.push_back({true, name,
                 fmt::format("is mounted {:.1f} m from the centre of navigation, beyond any vehicle", lever.norm()),
                 "position_m is in metres, in the body frame (docs/conventions.md)"});
}

bool has_capability(int bit) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("CapEff:")) return (std::stoull(line.substr(7), nullptr, 16) >> bit & 1) != 0;
  return false;
}

constexpr const char* kCorrectMap = "correct cloud.crs, datum or geoid in the rig";

/// Returns what is wrong with the map itself, which any place shows. What is wrong with it at that place does not
/// matter.
std::optional<std::string> wrong_map(const config::Rig& rig) {
  const auto map = storage::Projection::create({0.84, 0.16, 100}, rig.map);
  if (map.ok() || map.error().code != ErrorCode::Invalid) return std::nullopt;
  return "cloud: " + map.error().message;
}

template <class T>
T first_of(const char* file, T otherwise) {
  std::ifstream in(file);
  T value;
  return in >> value ? value : otherwise;
}

}  // namespace

std::vector<Finding> check_rig(const config::Rig& rig) {
  std::vector<Finding> out;
  find_shared_addresses(rig, out);
  find_marks_not_asked_for(rig, out);
  check_lenses(rig.geometry.head, out);
  check_mounting("head", rig.geometry.head.T_body_head.translation, out);
  for (const auto& laser : rig.geometry.lasers)
    check_mounting(rig.sensor_names().at(laser.sensor), laser.T_body_scanner.translation, out);
  if (const auto wrong = wrong_map(rig)) out.push_back({true, "rig", *wrong, kCorrectMap});
  return out;
}

Status check_map(const config::Rig& rig) {
  const auto wrong = wrong_map(rig);
  return wrong ? Status(Error{ErrorCode::Invalid, fmt::format("{}: {}", *wrong, kCorrectMap)}) : Status();
}

HostFacts read_host_facts() {
  HostFacts facts;
  facts.rmem_max = first_of<std::int64_t>("/proc/sys/net/core/rmem_max", -1);
  facts.clock_source = first_of<std::string>("/sys/devices/system/clocksource/clocksource0/current_clocksource", "");
  facts.has_net_admin = has_capability(12);
  std::error_code unknown;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  facts.has_guest = unknown || std::filesystem::exists(program.parent_path() / "hueline-guest", unknown);
  facts.has_office = unknown || std::filesystem::exists(program.parent_path() / "hueline-office", unknown);
  return facts;
}

std::vector<Finding> check_host(const config::Rig& rig, const HostFacts& facts, double hours) {
  std::vector<Finding> out;
  bool has_camera = false, has_udp = false;
  for (const auto& sensor : rig.sensors) {
    if (sensor.device->arrivals() != drivers::Arrivals::Live) continue;
    has_camera |= sensor.type->role == Role::Camera;
    has_udp |= sensor.type->role == Role::Laser;
  }
  // A camera's library runs in a process without the right to exceed the limit.
  if (facts.rmem_max >= 0 && facts.rmem_max < kWantedReceiveBuffer && (has_camera || (has_udp && !facts.has_net_admin)))
    out.push_back(
        {false, "computer",
         fmt::format("net.core.rmem_max is {}: too small for the sockets of camera and scanner", facts.rmem_max),
         "hueline doctor --fix, or sysctl -w net.core.rmem_max=33554432"});
  if (is_slow_clock_source(facts.clock_source))
    out.push_back({false, "computer", "its clock source is " + facts.clock_source + ": coarse, and slow to read",
                   "find in the kernel's log why tsc was given up"});
  if (has_camera && !facts.has_guest)
    out.push_back({true, "computer", "hueline-guest is missing beside the program: no camera can be read",
                   "install it beside hueline"});
  if (rig.panoramas && !facts.has_office)
    out.push_back({false, "computer", "hueline-office is missing beside the program: no panoramas are made",
                   "install it beside hueline (the package hueline-tools), or make them in the office"});
  const double rate = facts.recorded_bytes_per_s +
                      cloud_bytes_a_point(rig.cloud_format, rig.cloud_split.has_value()) * facts.points_per_s;
  if (facts.free_bytes >= 0 && rate > 0) {
    const double room_h = std::max(0.0, static_cast<double>(facts.free_bytes) - 64e6) / rate / 3600;
    if (room_h < hours)
      out.push_back({true, "disk",
                     fmt::format("{:.1f} GB are free: {:.1f} h at {:.1f} MB/s, planned are {:.1f} h",
                                 static_cast<double>(facts.free_bytes) * 1e-9, room_h, rate * 1e-6, hours),
                     "make room, or use another disk"});
  }
  if (facts.disk_bytes_per_s >= 0 && facts.disk_bytes_per_s < 2 * rate)
    out.push_back({facts.disk_bytes_per_s < rate, "disk",
                   fmt::format("it takes {:.0f} MB/s, and the drive needs {:.0f} MB/s", facts.disk_bytes_per_s * 1e-6,
                               rate * 1e-6),
                   "use a faster disk"});
  return out;
}

std::vector<Finding> check_sensors(const config::Rig& rig, const Health& health) {
  std::vector<Finding> out;
  const auto names = rig.sensor_names();
  for (const HealthEpisode& one : health.episodes()) {
    // A sensor that is not there is told apart, because a check is shorter than health's patience.
    if (!one.lasts || one.trouble == Trouble::Disk || one.trouble == Trouble::Missing) continue;
    // These need more time than a check has, or the vehicle must move.
    const bool may_come =
        one.level == HealthLevel::Waiting && (one.trouble == Trouble::NoClock || one.trouble == Trouble::NoPose);
    const bool prevents = one.level == HealthLevel::Alarm || (one.level == HealthLevel::Waiting && !may_come);
    out.push_back({prevents, one.sensor == kSystemSensor ? "sensors" : names.at(one.sensor), one.cause, one.action});
  }
  return out;
}

}  // namespace hueline::runtime
