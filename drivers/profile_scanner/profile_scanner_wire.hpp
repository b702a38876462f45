#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "drivers/pulse_status.hpp"

/// The generic wire format of profile scanners (docs/formats.md, "Profile scanner"): its datagrams cut into fields and
/// checked. Reentrant.
namespace hueline::drivers {

constexpr std::uint32_t kProfileMagic = 0x31465250;  ///< "PRF1"
constexpr std::uint8_t kProfileVersion = 1;
constexpr std::size_t kProfileHeaderBytes = 24;
constexpr std::size_t kProfileDataBytes = 44;    ///< before the table of pulses
constexpr std::size_t kProfileStatusBytes = 32;  ///< whole
constexpr std::size_t kProfileReturnBytes = 6;

enum class ProfileKind : std::uint8_t { Data = 1, Status = 2 };
/// What the seconds of a datagram count.
enum class ProfileTimeScale : std::uint8_t {
  Gps = 0,   ///< seconds since 1980-01-06T00:00:00 UTC, no leap seconds
  Utc = 1,   ///< Unix: seconds since 1970-01-01T00:00:00 UTC, leap seconds not counted
  None = 2,  ///< since power-up: nobody told the scanner the time
};

/// What every datagram begins with.
struct ProfileHeader {
  ProfileKind kind = ProfileKind::Data;
  std::uint16_t scanner = 0;
  std::uint32_t counter = 0;  ///< of datagrams of this kind
  ProfileTimeScale scale = ProfileTimeScale::Gps;
  std::uint32_t second = 0, nanosecond = 0;  ///< Data: emission of the first pulse; Status: sending
};

struct ProfileData {
  std::uint32_t line = 0;             ///< turn of the mirror in which the first pulse left
  std::uint32_t angle = 0;            ///< of the mirror at the first pulse, 2^-32 turn
  std::int32_t angle_step = 0;        ///< from pulse to pulse, 2^-32 turn
  std::uint32_t period_ps = 0;        ///< from pulse to pulse
  std::span<const std::byte> counts;  ///< one byte a pulse: number of its returns
  std::span<const std::byte>
      returns;  ///< 6 bytes each: u32 range (0.1 mm), u16 reflectance (0.01 %); as many as the counts say
};

struct ProfileStatus {
  PulseStatus pps;
  bool has_label = false;         ///< a receiver's message named the seconds
  bool is_label_valid = false;    ///< and the receiver trusted its fix
  std::uint32_t edge_second = 0;  ///< the latest PPS edge, as the scanner names it
};

/// Begins like one of ours: magic and room for a header. For telling formats apart.
bool is_profile_datagram(std::span<const std::byte> datagram);
/// Errors: Malformed (magic, length, kind, fields out of range), Truncated (shorter than it says), Unsupported (another
/// version).
Result<ProfileHeader> decode_profile_header(std::span<const std::byte> datagram);
/// `datagram`: one whose header was decoded. Errors: Malformed.
Result<ProfileData> decode_profile_data(std::span<const std::byte> datagram);
Result<ProfileStatus> decode_profile_status(std::span<const std::byte> datagram);

}  // namespace hueline::drivers
