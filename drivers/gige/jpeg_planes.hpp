#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/keys.hpp"
#include "core/result.hpp"

/// One exposure of a head of six lenses as JPEG planes: each lens image is taken apart into the four places of its
/// Bayer cell, and each of these planes, half as wide and half as high, is a grey JPEG of its own: 24 of them. So a
/// JPEG never sees the mosaic, which it would take for noise. Layout: docs/formats.md, "JPEG planes" (what is publicly
/// known of a Ladybug's JPEG modes). Big endian:
///
///   offset  size
///     0x08     4  bytes of the whole, this head included
///     0x10     4  magic 0xCAFEBABE
///     0x14     4  version, 2
///    0x340   192  6 lenses x 4 planes x {u32 offset from the beginning, u32 size}
/// What stands between (time, gain, shutter, NMEA) is not read: the frame id, the stamp and the POS say it better.
namespace hueline::drivers {

constexpr std::size_t kHeadLenses = 6;
constexpr std::size_t kCellPlaces = 4;
constexpr std::size_t kJpegPlanesHeaderSize = 0x400;

/// Where the planes of an exposure lie. Borrowed bytes.
struct JpegPlanes {
  /// planes[lens][slot]; empty: the table names none, or one that is not inside the bytes.
  std::array<std::array<std::span<const std::byte>, kCellPlaces>, kHeadLenses> planes;
  /// Why a plane that the table names is empty: it ends behind the bytes that came (or begins in the head). ""
  /// otherwise.
  std::array<std::array<std::string, kCellPlaces>, kHeadLenses> why_empty;
  std::size_t size =
      0;  ///< bytes of the whole as its head says; fewer may have come, more may follow (the camera's buffer is larger)
};

/// How the planes become one picture.
struct JpegPlanesLayout {
  /// Lens images lie side by side in rows of so many, lens 0 in the upper left corner: 1, 2, 3 or 6.
  std::uint32_t lens_columns = 1;
  /// Place in the 2 x 2 cell of each slot's plane: 0 upper left, 1 upper right, 2 lower left, 3 lower right. Readers
  /// differ about the cameras' order, so it is a setting.
  std::array<std::uint8_t, kCellPlaces> plane_places{0, 1, 2, 3};
  /// Lenses that anybody wants; the others' planes are not decoded, and their pixels are 0.
  std::array<bool, kHeadLenses> is_used{true, true, true, true, true, true};

  std::uint32_t lens_rows() const { return static_cast<std::uint32_t>(kHeadLenses) / lens_columns; }
  void visit(Keys& keys);
  /// For a picture of this size.
  KeyError validate(std::uint32_t width, std::uint32_t height) const;
};

/// Truncated: fewer bytes than the head has. Malformed: magic. Unsupported: another version. A plane outside the bytes
/// is not an error of the whole.
Result<JpegPlanes> read_jpeg_planes(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
