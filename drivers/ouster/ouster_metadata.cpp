#include "drivers/ouster/ouster_metadata.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/number_word.hpp"

namespace hueline::drivers {
namespace {

using Json = nlohmann::json;

constexpr std::array<OusterProfile, 13> kProfiles{{
    {"LEGACY", 12, 0xFFFFF, 0, 4, false},
    {"RNG19_RFL8_SIG16_NIR16", 12, 0x7FFFF, 0, 4, false},
    {"RNG19_RFL8_SIG16_NIR16_DUAL", 16, 0x7FFFF, 0, 3, true},
    {"RNG15_RFL8_NIR8", 4, 0x7FFF, 3, 2, false},
    {"RNG15_RFL8_NIR8_DUAL", 8, 0x7FFF, 3, 2, true},
    {"FUSA_RNG15_RFL8_NIR8_DUAL", 8, 0x7FFF, 3, 2, true},
    {"FIVE_WORD_PIXEL", 20, 0x7FFFF, 0, 3, true},
    {"RNG15_RFL8_NIR8_ZONE16", 8, 0x7FFF, 3, 2, false},
    {"RNG19_RFL8_SIG16_NIR16_ZONE16", 12, 0x7FFFF, 0, 4, false},
    {"RNG15_RFL8_WIN8", 4, 0x7FFF, 3, 2, false},
    {"RNG19_RFL8_SIG16_ZONE16_DUAL", 16, 0x7FFFF, 0, 3, true},
    {"RNG19_RFL8_SIG16_NIR16_RGB16", 16, 0x7FFFF, 0, 3, false},
    {"RNG19_RFL8_SIG16_NIR16_RGB16_DUAL", 20, 0x7FFFF, 0, 3, true},
}};

constexpr int kMostChannels = 128, kMostColumns = 4096;

Error wrong(const std::string& key, const std::string& why) {
  return {ErrorCode::Malformed, fmt::format("the Ouster's metadata: {} {}", key, why)};
}

/// Finds values by key: in a section of the nested form, or at the top of the flat one.
class Sections {
 public:
  explicit Sections(const Json& root) : root_(root) {}

  const Json* find(const char* section, const char* key) const {
    if (const auto at = root_.find(section); at != root_.end() && at->is_object())
      if (const auto value = at->find(key); value != at->end()) return &*value;
    const auto value = root_.find(key);
    return value != root_.end() ? &*value : nullptr;
  }
  std::string text(const char* section, const char* key) const {
    const Json* value = find(section, key);
    return value && value->is_string() ? value->get<std::string>() : "";
  }
  /// Returns a number or `otherwise` if there is none, or nothing if it is outside the range.
  std::optional<double> number(const char* section, const char* key, double otherwise, double min, double max) const {
    const Json* value = find(section, key);
    if (!value || value->is_null()) return otherwise;
    if (!value->is_number()) return {};
    const double number = value->get<double>();
    return number >= min && number <= max ? std::optional(number) : std::nullopt;
  }
  /// Returns the numbers of a list, or of a list of lists that are its rows. Nothing: there is no such list.
  std::optional<std::vector<double>> numbers(const char* section, const char* key) const {
    const Json* value = find(section, key);
    if (!value || !value->is_array()) return {};
    std::vector<double> out;
    for (const Json& one : *value) {
      if (one.is_number()) {
        out.push_back(one.get<double>());
      } else if (one.is_array()) {
        for (const Json& inner : one) {
          if (!inner.is_number()) return {};
          out.push_back(inner.get<double>());
        }
      } else {
        return {};
      }
    }
    return out;
  }

 private:
  const Json& root_;
};

OusterTimestampMode mode_of(const std::string& word) {
  if (word == "TIME_FROM_INTERNAL_OSC") return OusterTimestampMode::Oscillator;
  if (word == "TIME_FROM_SYNC_PULSE_IN") return OusterTimestampMode::SyncPulse;
  if (word == "TIME_FROM_PTP_1588") return OusterTimestampMode::Ptp;
  return OusterTimestampMode::Unknown;
}

/// Reads the identity of the scanner, and what its stamps count.
void read_identity(const Sections& all, OusterMetadata& out) {
  out.product = all.text("sensor_info", "prod_line");
  out.firmware = all.text("sensor_info", "build_rev");
  out.serial = parse_number<std::uint64_t>(all.text("sensor_info", "prod_sn"));
  if (out.serial == 0) out.serial.reset();
  if (const Json* id = all.find("sensor_info", "initialization_id"); id && id->is_number_unsigned())
    out.init_id = static_cast<std::uint32_t>(id->get<std::uint64_t>() & 0xFFFFFFU);
  out.timestamp_mode = mode_of(all.text("config_params", "timestamp_mode"));
  out.reads_nmea = all.text("config_params", "multipurpose_io_mode") == "INPUT_NMEA_UART";
}

/// Returns whether firmware is older than 2.1. Firmware whose metadata do not name it is; what has a name that is no
/// version is a maker's build of later years.
bool is_before_2_1(const std::string& firmware) {
  if (firmware.empty()) return true;
  int major = 0, minor = 0;
  return std::sscanf(firmware.c_str(), "v%d.%d", &major, &minor) == 2 && (major < 2 || (major == 2 && minor < 1));
}

Status read_format(const Sections& all, OusterMetadata& out) {
  // "1024x10": columns and frames a second.
  const std::string mode = all.text("config_params", "lidar_mode");
  const auto mode_columns = parse_number<int>(mode.substr(0, mode.find('x')));
  const auto whole = [&](const char* key, double otherwise, double max) {
    return all.number("lidar_data_format", key, all.number("data_format", key, otherwise, 1, max).value_or(0), 1, max);
  };
  const auto columns = whole("columns_per_frame", mode_columns.value_or(0), kMostColumns);
  if (!columns || *columns < 1)
    return wrong("columns_per_frame",
                 fmt::format("is missing or not in 1 .. {}, and lidar_mode is \"{}\"", kMostColumns, mode));
  out.columns_per_frame = static_cast<int>(*columns);
  const auto per_packet = whole("columns_per_packet", 16, 256);
  if (!per_packet || *per_packet < 1 || out.columns_per_frame % static_cast<int>(*per_packet) != 0)
    return wrong("columns_per_packet", "is no divisor of columns_per_frame");
  out.columns_per_packet = static_cast<int>(*per_packet);

  const auto word = [&](const char* key) {
    std::string text = all.text("lidar_data_format", key);
    if (text.empty()) text = all.text("data_format", key);
    return text.empty() ? all.text("config_params", key) : text;
  };
  std::string profile = word("udp_profile_lidar");
  if (profile.empty()) profile = "LEGACY";
  for (const OusterProfile& known : kProfiles)
    if (profile == known.name) out.profile = &known;
  if (!out.profile)
    return Error{ErrorCode::Unsupported, fmt::format("the Ouster's metadata: profile {} is not read", profile)};
  out.has_wide_reflectivity = out.is_legacy() && is_before_2_1(out.firmware);
  const std::string header = word("header_type");
  out.is_fusa = header.empty() ? profile.starts_with("FUSA") : header == "FUSA";

  auto window = all.numbers("lidar_data_format", "column_window");
  if (!window) window = all.numbers("data_format", "column_window");
  out.window_last = out.columns_per_frame - 1;
  if (window) {
    const auto is_column = [&](double v) { return v >= 0 && v < out.columns_per_frame && v == std::floor(v); };
    if (window->size() != 2 || !std::ranges::all_of(*window, is_column))
      return wrong("column_window", "is no pair of columns of the frame");
    out.window_first = static_cast<int>((*window)[0]);
    out.window_last = static_cast<int>((*window)[1]);
  }
  return {};
}

Status read_beams(const Sections& all, OusterMetadata& out) {
  const auto altitudes = all.numbers("beam_intrinsics", "beam_altitude_angles");
  const auto azimuths = all.numbers("beam_intrinsics", "beam_azimuth_angles");
  if (!altitudes || !azimuths) return wrong("beam_altitude_angles or beam_azimuth_angles", "is no list of numbers");
  const std::size_t count = altitudes->size();
  if (count > kMostChannels)
    return Error{ErrorCode::Unsupported,
                 fmt::format("the Ouster's metadata: {} angles; scanners with up to {} channels are read", count,
                             kMostChannels)};
  if (count == 0 || count % 4 != 0 || azimuths->size() != count)
    return wrong("beam_altitude_angles", fmt::format("has {} numbers and beam_azimuth_angles {}: one of each is "
                                                     "needed for each of 16, 32, 64 or 128 channels",
                                                     count, azimuths->size()));
  const auto is_angle = [](double v) { return std::abs(v) <= 90; };
  if (!std::ranges::all_of(*altitudes, is_angle) || !std::ranges::all_of(*azimuths, is_angle))
    return wrong("beam_altitude_angles or beam_azimuth_angles", "has an angle beyond 90 degrees");
  if (std::ranges::all_of(*altitudes, [](double v) { return v == 0; }))
    return wrong("beam_altitude_angles", "are all 0: the scanner had not started when it was asked");
  for (const char* section : {"lidar_data_format", "data_format"})
    if (const Json* told = all.find(section, "pixels_per_column");
        told && (!told->is_number_unsigned() || told->get<std::size_t>() != count))
      return wrong("pixels_per_column", fmt::format("is not the number of angles, {}", count));
  out.channels = static_cast<int>(count);
  out.altitudes_deg = *altitudes;
  out.azimuths_deg = *azimuths;

  // The maker's values for firmware that does not tell them.
  const double otherwise = out.product.starts_with("OS-0")   ? 27.67
                           : out.product.starts_with("OS-1") ? 15.806
                           : out.product.starts_with("OS-2") ? 13.762
                                                             : 12.163;
  const auto origin = all.number("beam_intrinsics", "lidar_origin_to_beam_origin_mm", otherwise, -1000, 1000);
  if (!origin) return wrong("lidar_origin_to_beam_origin_mm", "is no number in -1000 .. 1000");
  out.beam_x_m = *origin * 1e-3;
  const auto is_small = [](double v) { return std::abs(v) <= 1e4; };
  if (const auto beam = all.numbers("beam_intrinsics", "beam_to_lidar_transform")) {
    if (beam->size() != 16 || !std::ranges::all_of(*beam, is_small))
      return wrong("beam_to_lidar_transform", "is no matrix of 16 numbers");
    out.beam_x_m = (*beam)[3] * 1e-3;
    out.beam_z_m = (*beam)[11] * 1e-3;
  }
  std::vector<double> sensor{-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1};
  if (auto told = all.numbers("lidar_intrinsics", "lidar_to_sensor_transform")) sensor = std::move(*told);
  if (sensor.size() != 16 || !std::ranges::all_of(sensor, is_small))
    return wrong("lidar_to_sensor_transform", "is no matrix of 16 numbers");
  for (int row = 0; row < 3; ++row) {
    const double* numbers = sensor.data() + std::ptrdiff_t{4} * row;
    out.R_sensor_lidar.row(row) = Eigen::RowVector3d(numbers[0], numbers[1], numbers[2]);
    out.p_sensor_lidar_m[row] = numbers[3] * 1e-3;
  }
  if ((out.R_sensor_lidar * out.R_sensor_lidar.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-3)
    return wrong("lidar_to_sensor_transform", "is no rotation");
  return {};
}

/// Returns a truth value that firmware writes as a number, a truth value or a word.
bool is_true(const Json* value) {
  if (!value) return false;
  if (value->is_boolean()) return value->get<bool>();
  if (value->is_number()) return value->get<double>() != 0;
  return value->is_string() && (*value == "true" || *value == "True" || *value == "1");
}

/// Returns the value at a path of keys, or null.
const Json* at(const Json& root, std::initializer_list<const char*> path) {
  const Json* here = &root;
  for (const char* key : path) {
    if (!here->is_object()) return nullptr;
    const auto next = here->find(key);
    if (next == here->end()) return nullptr;
    here = &*next;
  }
  return here;
}

std::string text_at(const Json& root, std::initializer_list<const char*> path) {
  const Json* value = at(root, path);
  return value && value->is_string() ? value->get<std::string>() : "";
}

}  // namespace

std::span<const OusterProfile> ouster_profiles() { return kProfiles; }

std::string OusterMetadata::name() const {
  if (!product.empty()) return product;
  return fmt::format("scanner with {} channels", channels);
}

bool is_json(std::span<const std::byte> bytes) {
  if (bytes.empty() || bytes.front() != std::byte{'{'}) return false;
  std::size_t end = bytes.size();
  while (end > 0 && (bytes[end - 1] == std::byte{'\n'} || bytes[end - 1] == std::byte{'\r'} ||
                     bytes[end - 1] == std::byte{' '} || bytes[end - 1] == std::byte{'\t'}))
    --end;
  return end > 1 && bytes[end - 1] == std::byte{'}'};
}

Result<OusterMetadata> parse_ouster_metadata(std::string_view text) {
  const Json root = Json::parse(text, nullptr, false);
  if (root.is_discarded()) return Error{ErrorCode::Malformed, "the Ouster's metadata: not JSON"};
  const Sections all(root);
  if (!root.is_object() || !all.find("beam_intrinsics", "beam_altitude_angles"))
    return Error{ErrorCode::Unsupported, "not the metadata of an Ouster: beam_altitude_angles is missing"};
  OusterMetadata out;
  read_identity(all, out);
  const auto leap = all.number("config_params", "nmea_leap_seconds", 0, -100, 100);
  if (!leap) return wrong("nmea_leap_seconds", "is no number in -100 .. 100");
  out.nmea_leap_seconds = static_cast<int>(*leap);
  if (Status read = read_format(all, out); !read.ok()) return read.error();
  if (Status read = read_beams(all, out); !read.ok()) return read.error();
  if (out.packet_bytes() > 65507) return wrong("columns_per_packet", "makes packets larger than a datagram");
  return out;
}

Result<OusterClock> parse_ouster_clock(std::string_view text) {
  const Json root = Json::parse(text, nullptr, false);
  if (root.is_discarded()) return Error{ErrorCode::Malformed, "the Ouster's time: not JSON"};
  // The answer to the text command of old firmware has no section `sensor` around it, and nothing of PTP.
  const Json* sensor = at(root, {"sensor"});
  if (!sensor) sensor = &root;
  const Json* stamp = at(*sensor, {"timestamp"});
  if (!stamp || !stamp->is_object())
    return Error{ErrorCode::Unsupported, "not the time of an Ouster: sensor.timestamp is missing"};
  OusterClock out;
  out.mode = mode_of(text_at(*stamp, {"mode"}));
  out.is_pulse_locked = is_true(at(*sensor, {"sync_pulse_in", "locked"}));
  out.is_nmea_locked = is_true(at(*sensor, {"multipurpose_io", "nmea", "locked"}));
  out.ptp_state = text_at(root, {"ptp", "port_data_set", "port_state"});
  if (const Json* offset = at(root, {"ptp", "time_status_np", "master_offset"}); offset && offset->is_number())
    out.ptp_offset_ns = offset->get<double>();
  return out;
}

}  // namespace hueline::drivers
