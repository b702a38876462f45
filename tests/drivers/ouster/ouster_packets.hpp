#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/packet.hpp"
#include "tests/support/pcap_writer.hpp"

/// Ouster metadata and packets for tests, made by hand from the maker's description of them.
namespace hueline::test {

struct OusterText {
  std::string profile = "RNG19_RFL8_SIG16_NIR16";
  std::string header = "STANDARD";
  int channels = 16, columns = 1024;
  std::string window = "[0, 1023]";
  std::string timestamp_mode = "TIME_FROM_INTERNAL_OSC", io_mode = "OFF";
  int nmea_leap_seconds = 0;
  std::string serial = "122000000001";
  std::string firmware = "v3.0.1";
  int init_id = 77;
  double first_altitude_deg = 16;
};

/// The beams point 16, 14, ... degrees up; every second one 3 degrees clockwise, the others 3 degrees back.
inline std::string ouster_metadata(const OusterText& t = {}) {
  std::string altitudes, azimuths;
  for (int c = 0; c < t.channels; ++c) {
    altitudes += fmt::format("{}{}", c ? ", " : "", t.first_altitude_deg - 32.0 / t.channels * c);
    azimuths += fmt::format("{}{}", c ? ", " : "", c % 2 ? -3 : 3);
  }
  return fmt::format(
      R"({{"sensor_info": {{"prod_line": "OS-1-{0}", "prod_sn": "{1}", "build_rev": "{12}", "initialization_id": {2}}},
"beam_intrinsics": {{"beam_altitude_angles": [{3}], "beam_azimuth_angles": [{4}],
  "beam_to_lidar_transform": [1,0,0,20, 0,1,0,0, 0,0,1,0, 0,0,0,1]}},
"lidar_intrinsics": {{"lidar_to_sensor_transform": [-1,0,0,0, 0,-1,0,0, 0,0,1,36.18, 0,0,0,1]}},
"imu_intrinsics": {{}},
"lidar_data_format": {{"pixels_per_column": {0}, "columns_per_packet": 16, "columns_per_frame": {5}, "column_window": {6},
  "udp_profile_lidar": "{7}", "udp_profile_imu": "LEGACY"}},
"config_params": {{"lidar_mode": "{5}x10", "timestamp_mode": "{8}", "multipurpose_io_mode": "{9}",
  "nmea_leap_seconds": {10}, "header_type": "{11}"}}}}
)",
      t.channels, t.serial, t.init_id, altitudes, azimuths, t.columns, t.window, t.profile, t.timestamp_mode, t.io_mode,
      t.nmea_leap_seconds, t.header, t.firmware);
}

/// A data packet: 16 columns whose pixels are all the same bytes.
struct OusterPacket {
  bool is_legacy = false, is_fusa = false;
  int channels = 16;
  std::uint32_t frame = 5, init_id = 77;
  std::uint64_t serial = 122000000001;
  int first_column = 0;
  std::uint64_t time_ns = 5'000'000'000, column_ns = 100'000;
  std::uint32_t invalid_columns = 0;  ///< a bit for each
  unsigned shutdown = 0, shot_limiting = 0;
  Bytes pixel;
};

inline Bytes ouster_bytes(const OusterPacket& p) {
  ByteWriter out(false);
  const auto number = [&](std::uint64_t v, int bytes) {
    for (int i = 0; i < bytes; ++i) out.u8(static_cast<unsigned>(v >> (8 * i) & 0xFF));
  };
  if (p.is_fusa) {
    out.u8(1);
    number(p.init_id, 3);
    out.u32(p.frame).zeros(3);
    number(p.serial, 5);
    out.u8(0).u8(0).u8(p.shutdown).u8(p.shot_limiting).zeros(12);
  } else if (!p.is_legacy) {
    out.u16(1).u16(p.frame & 0xFFFF);
    number(p.init_id, 3);
    number(p.serial, 5);
    out.zeros(4).u8(0).u8(0).u8(p.shutdown).u8(p.shot_limiting).zeros(12);
  }
  for (int i = 0; i < 16; ++i) {
    const bool is_valid = (p.invalid_columns >> i & 1U) == 0;
    out.u64(p.time_ns + p.column_ns * static_cast<std::uint64_t>(i));
    out.u16(static_cast<unsigned>(p.first_column + i));
    if (p.is_legacy)
      out.u16(p.frame & 0xFFFF).u32(88 * static_cast<unsigned>(p.first_column + i));
    else
      out.u16(is_valid ? 1 : 0);
    for (int c = 0; c < p.channels; ++c) out.raw(p.pixel);
    if (p.is_legacy) out.u32(is_valid ? 0xFFFFFFFF : 0);
  }
  if (!p.is_legacy) out.zeros(32);
  return out.bytes();
}

/// Pixels of the profiles.
inline Bytes pixel_legacy(unsigned range_mm, unsigned reflectivity) {
  return ByteWriter(false).u32(range_mm | 0xF0000000U).u16(reflectivity).u16(999).u32(888).bytes();
}
inline Bytes pixel_single(unsigned range_mm, unsigned reflectivity) {
  return ByteWriter(false).u32(range_mm | 0x1F << 19U).u8(reflectivity).u8(1).u16(999).u32(888).bytes();
}
inline Bytes pixel_dual(unsigned range_mm, unsigned reflectivity, unsigned second_mm, unsigned second_reflectivity) {
  return ByteWriter(false)
      .u32(range_mm | 0x1F << 19U | reflectivity << 24U)
      .u32(second_mm | 0x1F << 19U | second_reflectivity << 24U)
      .u32(777)
      .u32(666)
      .bytes();
}
inline Bytes pixel_low_rate(unsigned range_8mm, unsigned reflectivity) {
  return ByteWriter(false).u16(range_8mm | 0x8000U).u8(reflectivity).u8(55).bytes();
}
inline Bytes pixel_low_rate_dual(unsigned range_8mm, unsigned reflectivity, unsigned second_8mm,
                                 unsigned second_reflectivity) {
  return ByteWriter(false)
      .raw(pixel_low_rate(range_8mm, reflectivity))
      .raw(pixel_low_rate(second_8mm, second_reflectivity))
      .bytes();
}

}  // namespace hueline::test
