#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

/// The packets of Livox scanners, little endian, of both generations of the maker's protocol.
///
/// First generation (Mid-40, Mid-70, Mid-100, Tele-15, Horizon, Avia):
///
///   offset  size  field
///        0     1  version, 5
///        1     2  slot and number of the scanner, behind a hub
///        4     4  status: bit 9 a pulse per second is there, bit 13 PTP is there, bits 14 to 16 what the clock follows
///        8     1  kind of the time
///        9     1  form of the points
///       10     8  time of the first point
///       18        points, as many as the form says
///
/// Second generation (Mid-360, HAP):
///
///   offset  size  field
///        0     1  version, 0
///        1     2  length of the datagram
///        3     2  time from the first point to the last, 0.1 us
///        5     2  number of points
///        7     2  count of packets, which may begin again with a frame
///       10     1  form of the points
///       11     1  kind of the time
///       24     4  CRC-32; it is not checked: UDP has its own, and the maker's programs do not check it
///       28     8  time of the first point, ns
///       36        points
///
/// Sources: the maker's descriptions "Livox SDK Communication Protocol" of the first generation, of Mid-360 and of HAP.
namespace hueline::drivers {

/// How the points of a packet are written.
struct LivoxForm {
  const char* name;
  std::uint8_t generation;   ///< 1 or 2
  std::uint8_t number;       ///< in the packet
  std::uint16_t points;      ///< firings in a packet; 0: the packet says how many
  std::uint8_t point_bytes;  ///< of one firing
  std::uint8_t returns;      ///< of one firing; 0: no points (IMU)
  bool is_spherical;
  bool has_tag;
  bool is_short;  ///< coordinates are 16 bits of centimetres instead of 32 of millimetres
};

/// What a packet says its time is.
enum class LivoxTimeKind : std::uint8_t {
  Own,      ///< ns since power-up: no reference
  Ptp,      ///< ns since 1970 as the PTP master counts them; which time scale that is, the packet does not say
  Utc,      ///< UTC by a GNSS receiver's pulse and sentences
  Pulse,    ///< ns since the latest pulse; no receiver's sentence names the second
  Unknown,  ///< a kind that is not described
};

/// Header of a packet.
struct LivoxPacket {
  const LivoxForm* form = nullptr;
  LivoxTimeKind time_kind = LivoxTimeKind::Unknown;
  /// ns; its zero is what the kind says. Nothing: the fields of a date contradict the calendar, or it is too large.
  std::optional<std::int64_t> time_ns;
  std::size_t points = 0;
  std::optional<std::int64_t> span_ns;    ///< from the first point to the last; the first generation does not say it
  std::optional<std::uint16_t> sequence;  ///< count of packets; the first generation has none
  std::uint16_t scanner = 0;              ///< slot and number behind a hub
  bool is_clock_abnormal = false;         ///< the scanner says that what its clock follows is broken
  std::span<const std::byte> data;        ///< the points
};

/// A return as the packet says it.
struct LivoxReturn {
  /// In the maker's frame (x forward, y to the left, z up) x, y and z in its unit; of a spherical form range, mm, angle
  /// from the z axis and azimuth from x to y, 0.01 deg. A range of more than 31 bits is negative.
  std::int32_t said[3];
  std::uint8_t reflectivity;
};

/// Reads the header. Returns nothing if the datagram is no packet of points or of the IMU: version, form and size have
/// to agree.
std::optional<LivoxPacket> decode_livox(std::span<const std::byte> bytes);

/// Reads return `which` of a firing. The origin means that there is none. It is called for every point, and therefore
/// stands here.
inline LivoxReturn read_livox_return(const LivoxForm& form, const std::byte* firing, std::size_t which) {
  const auto field = [](auto value, const std::byte* p) {
    std::memcpy(&value, p, sizeof value);  // the program runs on little-endian computers only (novatel/wire.hpp)
    return static_cast<std::int32_t>(value);
  };
  const auto i16 = [&](const std::byte* p) { return field(std::int16_t{}, p); };
  const auto i32 = [&](const std::byte* p) { return field(std::int32_t{}, p); };
  const auto u16 = [&](const std::byte* p) { return field(std::uint16_t{}, p); };
  if (form.is_short) return {{i16(firing), i16(firing + 2), i16(firing + 4)}, static_cast<std::uint8_t>(firing[6])};
  if (!form.is_spherical) {
    const std::byte* p = firing + which * (form.has_tag ? 14 : 13);
    return {{i32(p), i32(p + 4), i32(p + 8)}, static_cast<std::uint8_t>(p[12])};
  }
  // With one return the range comes first; with several the direction, which they share.
  const bool is_shared = form.returns > 1;
  const std::byte* direction = is_shared ? firing : firing + 4;
  const std::byte* range = is_shared ? firing + 4 + which * 6 : firing;
  return {{i32(range), u16(direction), u16(direction + 2)},
          static_cast<std::uint8_t>(is_shared ? range[4] : firing[8])};
}

}  // namespace hueline::drivers
