#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/result.hpp"
#include "core/time.hpp"
#include "drivers/gige/jpeg_planes.hpp"

/// What a Ladybug writes of itself into each image, before the planes (drivers/gige/jpeg_planes.hpp). Big endian, as
/// far as it is publicly known:
///
///   offset  size  field
///     0x00     4  cycle time of the bus: seconds (7 bits), cycles of 125 us (13 bits), 1/3072 cycles (12 bits). The
///                 lowest 4 bits are not usable; it wraps after 128 s
///     0x08     4  size of the image, bytes
///     0x10     4  magic 0xCAFEBABE
///     0x14     4  version, 2
///     0x18     8  seconds since 1970-01-01, microseconds
///     0x20     4  sequence, restarts when the camera is switched on
///     0x40     4  white balance
///     0x44     4  gain of the Bayer cell
///     0x48     4  map of the Bayer cell
///     0x4C     4  brightness
///     0x50     4  gamma
///     0x54     4  serial number of the head
///    0x338     8  offset and size of a text of NMEA, bytes from the beginning of the image; size 0: there is none
///    0x340     -  table of the planes
///
/// The settings are the numbers of the camera's registers. Their units depend on the model. Gains and shutters of the
/// lenses are read with the planes.
namespace hueline::drivers {

/// Offset and length of what has to be read to know where an image ends.
constexpr std::size_t kLadybugSizeAt = 0x08, kLadybugMagicAt = 0x10, kLadybugFramingSize = 0x18;

struct LadybugImage {
  std::uint32_t size = 0;  ///< bytes of the whole image
  nanoseconds cycle_time{0};
  nanoseconds unix_time{0};  ///< since 1970-01-01; whose clock it is depends on the model
  std::uint32_t sequence = 0;
  std::uint32_t white_balance = 0, bayer_gain = 0, bayer_map = 0, brightness = 0, gamma = 0;
  std::uint32_t serial = 0;
  std::span<const std::byte> nmea;  ///< part of the bytes that were read
};

/// Returns the size that the first kLadybugFramingSize bytes of an image state, or nothing if they are no beginning of
/// an image.
std::optional<std::uint32_t> ladybug_image_size(std::span<const std::byte> first_bytes);

/// Reads the head of an image. Errors: Truncated, Malformed, Unsupported as in read_jpeg_planes(); Malformed if the
/// text of NMEA lies outside the image or the microseconds are no part of a second.
Result<LadybugImage> read_ladybug_image(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
