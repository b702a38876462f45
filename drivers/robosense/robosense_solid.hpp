#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "core/time.hpp"

/// The packets of points of RoboSense scanners that do not rotate, big endian. They carry the direction of each point,
/// so that no description of the scanner is needed.
///
///   offset  size  field
///        0     4  55 AA 5A A5
///        4     2  number of the packet in its frame, from 1 on
///        8     1  returns: 0 both of a firing, any other number one
///        9     1  what the clock follows: 0 nothing, any other number PTP
///       10    10  seconds since 1970 (6 bytes), microseconds (4 bytes)
///       30     1  type
///       32        blocks
///
/// M1, 1210 bytes: 25 blocks of 47 bytes: time after the packet's in us (1 byte), number of the return (1 byte), and 5
/// times range in 0.005 m (2 bytes), elevation and azimuth in 0.01 deg from 32768 on (2 bytes each), reflectivity,
/// attribute, length of the echo (1 byte each).
/// E1, 1200 bytes: 96 blocks of 12 bytes: time after the packet's in us (2 bytes), range in 0.005 m (2 bytes), unit
/// vector (3 times 2 bytes, 32768 is 1), reflectivity, attribute (1 byte each).
///
/// Sources: the maker's user manuals, and the layouts in its public driver. No recording of such a scanner was there to
/// check them.
namespace hueline::drivers {

/// Header of a packet.
struct RobosenseSolidPacket {
  const char* name = "";  ///< of the model
  bool is_m1 = false;
  std::uint16_t sequence = 0;
  bool is_dual = false;
  bool follows_ptp = false;
  std::optional<UnixTime> time;  ///< as if the scanner's seconds were Unix time; nothing if they cannot be a time
};

/// Reads the header. Returns nothing if the datagram is no such packet.
std::optional<RobosenseSolidPacket> decode_robosense_solid(std::span<const std::byte> bytes);

/// Replaces the returns by those between two ranges, in the frame Scanner: the maker's x (forward) is y, its y (to the
/// left) is -x. azimuth counts from the maker's x to its y, and channel is the number of the point in its block. Of two
/// returns return_number is the scanner's own number.
void decode_robosense_solid_points(std::span<const std::byte> bytes, const RobosenseSolidPacket& packet,
                                   double min_range_m, double max_range_m, std::vector<LaserReturn>& out);

}  // namespace hueline::drivers
