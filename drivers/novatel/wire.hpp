#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "core/time.hpp"

/// The layout of OEM7 binary messages (OEM7 Commands and Logs Reference Manual, "Messages"): a long or a short header,
/// the body, and the CRC. Little endian.
///
///   long header
///   offset  size  field
///        0     3  0xAA 0x44 0x12
///        3     1  length of the header, bytes, 28
///        4     2  message id
///        6     1  message type: bits 0-4 antenna, bit 7 answer to a command
///        7     1  not read
///        8     2  length of the body, bytes
///       10     3  not read
///       13     1  time status, TimeStatus
///       14     2  full GPS week, not modulo 1024
///       16     4  time of the week, ms
///       20     8  not read
///
///   short header
///   offset  size  field
///        0     3  0xAA 0x44 0x13
///        3     1  length of the body, bytes
///        4     2  message id
///        6     2  full GPS week, not modulo 1024
///        8     4  time of the week, ms
///
/// The CRC has 4 bytes (crc32.hpp).
namespace hueline::drivers {

static_assert(std::endian::native == std::endian::little, "fields are copied as they lie on the wire");

constexpr std::byte kSync1{0xAA}, kSync2{0x44}, kSyncLong{0x12}, kSyncShort{0x13};
constexpr std::size_t kLongHeaderBytes = 28, kShortHeaderBytes = 12, kCrcBytes = 4;
/// Longest header that is accepted. OEM7 headers have 28 bytes and say so; their length field leaves room for more.
constexpr std::size_t kLongestHeaderBytes = 64;

/// Returns the field at a byte offset. The caller must have checked that it lies inside `bytes`.
template <class T>
T field(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// GPS reference time status (header byte 13). Only the three fine ones mean that the receiver's clock is within a
/// microsecond of GPS.
enum class TimeStatus : std::uint8_t { Unknown = 20, Fine = 160, FineBackupSteering = 170, FineSteering = 180 };
constexpr bool is_fine(std::uint8_t status) {
  return status == static_cast<std::uint8_t>(TimeStatus::Fine) ||
         status == static_cast<std::uint8_t>(TimeStatus::FineBackupSteering) ||
         status == static_cast<std::uint8_t>(TimeStatus::FineSteering);
}

/// A long or short header. A short header has no time status, antenna or message type.
struct NovatelHeader {
  std::uint16_t id = 0;
  bool is_short = false;
  bool is_response = false;  ///< message type bit 7: the message answers a binary command
  std::uint8_t antenna = 0;  ///< message type bits 0-4: 0 primary, 1 secondary
  std::optional<std::uint8_t> time_status;
  std::uint16_t week = 0;          ///< full GPS week, not modulo 1024
  std::uint32_t milliseconds = 0;  ///< of the week
};

/// A message whose CRC is right.
struct NovatelMessage {
  NovatelHeader header;
  std::span<const std::byte> body;  ///< without header and CRC
  std::size_t wire_bytes = 0;       ///< header, body and CRC
  HostTime received{};              ///< arrival of the packet with the last byte
};

}  // namespace hueline::drivers
