#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "core/time.hpp"

/// The shape of OEM7 binary on the wire (OEM7 Commands and Logs Reference Manual, "Messages"). Little-endian
/// throughout.
namespace hueline::drivers {

static_assert(std::endian::native == std::endian::little, "fields are copied as they lie on the wire");

constexpr std::byte kSync1{0xAA}, kSync2{0x44}, kSyncLong{0x12}, kSyncShort{0x13};
constexpr std::size_t kLongHeaderBytes = 28, kShortHeaderBytes = 12, kCrcBytes = 4;
/// OEM7 headers are 28 bytes and say so; the field leaves room to grow.
constexpr std::size_t kLongestHeaderBytes = 64;

/// A field at a byte offset; the caller has checked that it lies inside.
template <class T>
T field(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// GPS reference time status (header byte 13). Only three of them mean that the receiver's clock is within a
/// microsecond of GPS.
enum class TimeStatus : std::uint8_t { Unknown = 20, Fine = 160, FineBackupSteering = 170, FineSteering = 180 };
constexpr bool is_fine(std::uint8_t status) {
  return status == static_cast<std::uint8_t>(TimeStatus::Fine) ||
         status == static_cast<std::uint8_t>(TimeStatus::FineBackupSteering) ||
         status == static_cast<std::uint8_t>(TimeStatus::FineSteering);
}

/// Long and short header in one; a short header has no time status, source or type.
struct NovatelHeader {
  std::uint16_t id = 0;
  bool is_short = false;
  bool is_response = false;  ///< message type bit 7: the answer to a binary command
  std::uint8_t antenna = 0;  ///< message type bits 0-4: 0 primary, 1 secondary
  std::optional<std::uint8_t> time_status;
  std::uint16_t week = 0;          ///< full GPS week, not modulo 1024
  std::uint32_t milliseconds = 0;  ///< of the week
};

/// A message whose CRC held.
struct NovatelMessage {
  NovatelHeader header;
  std::span<const std::byte> body;  ///< without header and CRC
  std::size_t wire_bytes = 0;       ///< header, body and CRC
  HostTime received{};              ///< arrival of the packet with its last byte
};

}  // namespace hueline::drivers
