#include "drivers/ladybug/ladybug_image.hpp"

#include <fmt/format.h>

#include "drivers/big_endian.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint32_t kMagic = 0xCAFEBABE, kVersion = 2;
constexpr std::uint32_t kMostImageBytes = 256u << 20;  // six lenses of any model fit several times

/// The cycle time of the bus, whose cycles are of 125 us and have 3072 parts.
nanoseconds cycle_time_of(std::uint32_t word) {
  const std::int64_t parts = std::int64_t{word >> 12 & 0x1FFF} * 3072 + (word & 0xFF0);
  return std::chrono::seconds(word >> 25) + nanoseconds(parts * 125'000 / 3072);
}

}  // namespace

std::optional<std::uint32_t> ladybug_image_size(std::span<const std::byte> first_bytes) {
  if (first_bytes.size() < kLadybugFramingSize || be32(&first_bytes[kLadybugMagicAt]) != kMagic ||
      be32(&first_bytes[kLadybugMagicAt + 4]) != kVersion)
    return std::nullopt;
  const std::uint32_t size = be32(&first_bytes[kLadybugSizeAt]);
  if (size < kJpegPlanesHeaderSize || size > kMostImageBytes) return std::nullopt;
  return size;
}

Result<LadybugImage> read_ladybug_image(std::span<const std::byte> bytes) {
  if (bytes.size() < kJpegPlanesHeaderSize)
    return Error{ErrorCode::Truncated,
                 fmt::format("Ladybug image of {} bytes; its head alone has {}", bytes.size(), kJpegPlanesHeaderSize)};
  if (const std::uint32_t magic = be32(&bytes[0x10]); magic != kMagic)
    return Error{ErrorCode::Malformed,
                 fmt::format("Ladybug image with 0x{:08x} where 0x{:08x} belongs", magic, kMagic)};
  if (const std::uint32_t version = be32(&bytes[0x14]); version != kVersion)
    return Error{ErrorCode::Unsupported,
                 fmt::format("Ladybug image of version {}; version {} is read", version, kVersion)};
  LadybugImage image;
  image.size = be32(&bytes[kLadybugSizeAt]);
  image.cycle_time = cycle_time_of(be32(&bytes[0x00]));
  const std::uint32_t microseconds = be32(&bytes[0x1C]);
  if (microseconds >= 1'000'000)
    return Error{ErrorCode::Malformed, fmt::format("Ladybug image with {} us in a second", microseconds)};
  image.unix_time = std::chrono::seconds(be32(&bytes[0x18])) + std::chrono::microseconds(microseconds);
  image.sequence = be32(&bytes[0x20]);
  image.white_balance = be32(&bytes[0x40]);
  image.bayer_gain = be32(&bytes[0x44]);
  image.bayer_map = be32(&bytes[0x48]);
  image.brightness = be32(&bytes[0x4C]);
  image.gamma = be32(&bytes[0x50]);
  image.serial = be32(&bytes[0x54]);
  const std::size_t offset = be32(&bytes[0x338]), size = be32(&bytes[0x33C]);
  if (size > 0) {
    if (offset > bytes.size() || size > bytes.size() - offset)
      return Error{ErrorCode::Malformed,
                   fmt::format("Ladybug image whose NMEA ends at byte {}; {} came", offset + size, bytes.size())};
    image.nmea = bytes.subspan(offset, size);
  }
  return image;
}

}  // namespace hueline::drivers
