#pragma once

#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/scenario_rig.hpp"
#include "sim/wire/little_endian.hpp"

/// Encoders of Velodyne VLP-16 and HDL-32E datagrams (user manuals 63-9243 rev. D and 63-9113 rev. J). Pure functions,
/// reentrant.
namespace hueline::sim {

/// Which returns of a firing the scanner reports. The value is the factory byte at offset 1204.
enum class LaserReturnMode : std::uint8_t { Strongest = 0x37, Last = 0x38, Dual = 0x39 };

constexpr std::size_t kLaserDataBytes = 1206;
constexpr std::size_t kLaserPositionBytes = 512;
constexpr std::size_t kLaserBlocks = 12;
constexpr std::size_t kLaserChannelsPerBlock = 32;

/// Returns the time from the first to the last firing of a packet: 24 sequences of 55.296 us with 16 firings 2.304 us
/// apart (VLP-16), or 12 of 46.080 us with 32 firings 1.152 us apart (HDL-32E). In dual mode the blocks come in pairs
/// of one azimuth.
std::int64_t last_firing_offset_ns(LaserModel model, LaserReturnMode mode);

/// Encodes a data datagram of 1206 bytes.
///   offset    0  12 x 100  blocks: bytes FF EE; u16 azimuth, 0.01 deg; 32 x (u16 distance, 2 mm; u8 reflectivity)
///   offset 1200  u32       whole microseconds from the last full UTC hour to the first firing
///   offset 1204  u8[2]     factory bytes: return mode and model
/// Errors: Invalid (the packet does not hold 12 x 32 returns, or an azimuth is 36000 or more).
Result<Bytes> encode_laser_data(const LaserPacket& packet, LaserModel model, LaserReturnMode mode);

/// What a position datagram reports.
struct LaserPositionReport {
  GpsNs sent_gps_ns = 0;        ///< by the scanner's clock
  std::uint8_t pps_status = 2;  ///< 0 none, 1 synchronising, 2 locked, 3 error
  /// The last sentence that the scanner received, with its CR LF, at most 127 bytes; empty: none yet.
  std::string nmea;
};

/// Encodes a position datagram of 512 bytes.
///   offset   0  198 bytes  reserved, zero
///   offset 198  u32        microseconds since the last full UTC hour
///   offset 202  u8         PPS status
///   offset 203  3 bytes    reserved, zero
///   offset 206  306 bytes  the sentence, padded with zeros
Result<Bytes> encode_laser_position(const LaserPositionReport& report);

/// What a GPRMC sentence reports.
struct RmcReport {
  GpsNs gps_ns = 0;  ///< time of the fix, a whole second
  bool is_valid = true;
  double latitude_rad = 0, longitude_rad = 0;
  double speed_m_s = 0;   ///< over ground
  double course_rad = 0;  ///< clockwise from north
};

/// Encodes "$GPRMC,...*hh\r\n": UTC to hundredths of a second, seven decimals of a minute, and the NMEA checksum.
std::string encode_gprmc(const RmcReport& report);

}  // namespace hueline::sim
