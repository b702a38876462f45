#pragma once

#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/scenario_rig.hpp"
#include "sim/wire/little_endian.hpp"

/// Velodyne VLP-16 and HDL-32E datagrams (user manuals 63-9243 rev. D and 63-9113 rev. J). Pure functions, reentrant.
namespace hueline::sim {

enum class LaserReturnMode : std::uint8_t { Strongest = 0x37, Last = 0x38, Dual = 0x39 };  ///< value: factory byte 1204

constexpr std::size_t kLaserDataBytes = 1206;
constexpr std::size_t kLaserPositionBytes = 512;
constexpr std::size_t kLaserBlocks = 12;
constexpr std::size_t kLaserChannelsPerBlock = 32;

/// Time from the first to the last firing of a packet: 24 sequences of 55.296 us with 16 firings 2.304 us apart
/// (VLP-16), 12 of 46.080 us with 32 firings 1.152 us apart (HDL-32E); in dual mode the blocks come in pairs of one
/// azimuth.
std::int64_t last_firing_offset_ns(LaserModel model, LaserReturnMode mode);

/// 1206 bytes: 12 blocks of flag 0xFFEE, azimuth, 32 x (distance, reflectivity); whole microseconds past the UTC hour
/// of the first firing; factory bytes. Invalid if the packet does not hold 12 x 32 returns or an azimuth is 36000 or
/// more.
Result<Bytes> encode_laser_data(const LaserPacket& packet, LaserModel model, LaserReturnMode mode);

/// What a position datagram says.
struct LaserPositionReport {
  GpsNs sent_gps_ns = 0;        ///< the scanner's clock when it sent the datagram
  std::uint8_t pps_status = 2;  ///< 0 none, 1 synchronising, 2 locked, 3 error
  std::string nmea;             ///< the last sentence it received, CR LF included; at most 127 bytes; empty: none yet
};

/// 512 bytes: 198 reserved, microseconds past the UTC hour, PPS status, 3 reserved, the sentence padded with zeros.
Result<Bytes> encode_laser_position(const LaserPositionReport& report);

/// What a GPRMC sentence says.
struct RmcReport {
  GpsNs gps_ns = 0;  ///< the instant of the fix, a whole second
  bool is_valid = true;
  double latitude_rad = 0, longitude_rad = 0;
  double speed_m_s = 0;   ///< over ground
  double course_rad = 0;  ///< from north, clockwise
};

/// "$GPRMC,...*hh\r\n": UTC to the hundredth, seven decimals of a minute, NMEA checksum.
std::string encode_gprmc(const RmcReport& report);

}  // namespace hueline::sim
