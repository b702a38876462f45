#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/time.hpp"

/// The packets of RoboSense scanners that rotate, big endian, 1248 bytes each.
///
/// Points (the maker's MSOP, usually port 6699):
///
///   offset  size  field
///        0     8  55 AA 05 0A 5A A5 50 A0 (RS-LiDAR-16, RS-LiDAR-32, Bpearl), or in its first 4 bytes 55 AA 05 5A
///        (Helios)
///       20    10  time, one of the two forms below
///       30     2  model: 1, 2 or 3 in either byte, RS-LiDAR-16, RS-LiDAR-32 or Bpearl
///       32     1  4: Bpearl of the fourth version
///       42  1200  12 blocks: FF EE, azimuth in 0.01 deg (2 bytes), 32 times range (2 bytes) and reflectivity (1 byte)
///     1246     2  00 FF
///
/// Description (DIFOP, usually port 7788, about once a second):
///
///        0     8  A5 FF 00 5A 11 11 55 55
///        8     2  revolutions a minute
///       32     4  first and last azimuth that are sent, 0.01 deg
///      300     1  returns: 0 both of a firing, any other number one
///      301     1  Helios, Bpearl 4: what the clock follows: 0 a receiver, 1 to 3 PTP
///      302     1  Helios, Bpearl 4: 0 it does not follow, 1 the receiver, 2 PTP
///      337     1  Bpearl: not 0: it turns the other way
///      357     1  RS-LiDAR-16 and -32, Bpearl 3: 1 the receiver's time is valid
///      468        elevations and (564) azimuths of 32 beams: sign (not 0: below; FF: none) and 2 bytes, in 0.01 deg,
///      or in
///                 0.001 deg (RS-LiDAR-32)
///     1165        RS-LiDAR-16: elevations of 16 beams, 3 bytes in 0.0001 deg, the first eight of them below
///
/// Times: year since 2000, month, day, hour, minute, second, millisecond (2 bytes), microsecond (2 bytes); Helios and
/// Bpearl 4 instead: seconds since 1970 (6 bytes), microseconds (4 bytes).
///
/// Sources: the maker's user manuals, and the layouts in its public driver. No recording of such a scanner was there to
/// check them; the place of the lens agrees with clouds of a Helios 16P that others decoded.
namespace hueline::drivers {

enum class RobosenseModel : std::uint8_t { Rs16, Rs32, Bpearl, Bpearl4, Helios, Helios16 };

constexpr std::size_t kRobosenseBytes = 1248, kRobosenseBlocks = 12, kRobosenseChannels = 32;

/// What is the same for all scanners of a model.
struct RobosenseTable {
  RobosenseModel model;
  const char* name;
  int beams;
  double range_unit_m;
  double lens_radius_m, lens_height_m;               ///< of the lens from the axis, and above the origin
  double firing_period_us;                           ///< from one firing of all beams to the next
  std::array<float, kRobosenseChannels> channel_us;  ///< of each channel after the block's time
};
const RobosenseTable& robosense_table(RobosenseModel model);

/// What a scanner says of itself.
struct RobosenseDescription {
  enum class Clock : std::uint8_t { Free, Receiver, Ptp };
  double revolutions_hz = 10;
  double blind_rad = 0;  ///< the part of a revolution that is not sent
  bool is_dual = false;
  bool is_reversed = false;
  Clock clock = Clock::Free;
  std::vector<double> elevations, azimuths;  ///< of each beam, rad; azimuths are added to the block's
};

/// Return the number of one byte, or of two, big endian, at this place of a packet.
inline unsigned robosense_u8(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<unsigned>(bytes[at]);
}
inline unsigned robosense_u16(std::span<const std::byte> bytes, std::size_t at) {
  return robosense_u8(bytes, at) << 8 | robosense_u8(bytes, at + 1);
}

/// Returns the family of a packet of points from its first bytes; of Helios, which of the two it is, the description
/// says. Nothing: it is no packet of points of a known model.
std::optional<RobosenseModel> robosense_model(std::span<const std::byte> bytes);
/// Returns whether the datagram has the signature of a packet of points, of any model.
bool is_robosense_points(std::span<const std::byte> bytes);
/// Returns whether the datagram begins as packets of points do, also those of models whose packets have other sizes:
/// M2, M3, MX, EMX, RS-LiDAR-48.
bool has_robosense_signature(std::span<const std::byte> bytes);
/// Returns whether the datagram is a description, of any model.
bool is_robosense_description(std::span<const std::byte> bytes);
/// Reads the description of a scanner whose points are of `model`, and sets `model` to Helios16 if it has 16 beams.
/// Returns nothing if it has no angles of the beams.
std::optional<RobosenseDescription> decode_robosense_description(std::span<const std::byte> bytes,
                                                                 RobosenseModel& model);
/// Returns the time of a packet of points, as if the scanner's date were UTC; nothing if it cannot be one.
std::optional<UnixTime> decode_robosense_time(std::span<const std::byte> bytes, RobosenseModel model);

}  // namespace hueline::drivers
