#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/result.hpp"

/// The layout of one exposure of a six-lens head as JPEG planes. Each lens image is split by the four places of its
/// Bayer cell. Each of these planes is half as wide and half as high and is a grey JPEG of its own, so there are 24.
/// JPEG would take the mosaic itself for noise. The layout is what is publicly known of a Ladybug's JPEG modes
/// (docs/formats.md, "JPEG planes"). Big endian:
///
///   offset  size  field
///     0x08     4  size of the whole, bytes, including this header
///     0x10     4  magic 0xCAFEBABE
///     0x14     4  version, 2
///     0x28    24  gain of each lens
///     0x58    24  shutter of each lens
///    0x340   192  table of the planes: 6 lenses x 4 planes, 8 bytes each
///
///   a plane in the table:
///        0     4  offset of the JPEG from the beginning of the whole, bytes
///        4     4  size of the JPEG, bytes; 0 if there is none
///
/// Gains and shutters are numbers of the camera's registers, whose units depend on the model. Some cameras write the
/// whole register of IIDC, whose highest bit says that the feature is there and whose lowest 12 bits are the number.
/// drivers/ladybug/ladybug_image.hpp reads the other fields.
namespace hueline::drivers {

constexpr std::size_t kHeadLenses = 6;
constexpr std::size_t kCellPlaces = 4;
constexpr std::size_t kJpegPlanesHeaderSize = 0x400;

/// The places of the planes of one exposure. The spans refer to the bytes that were read; they own nothing.
struct JpegPlanes {
  /// The JPEG of planes[lens][slot]. It is empty if the table has none, or if it lies outside the bytes.
  std::array<std::array<std::span<const std::byte>, kCellPlaces>, kHeadLenses> planes;
  /// Says why a plane is empty: it is missing, it begins inside the header, or it ends after the bytes that came. Empty
  /// if the plane is there.
  std::array<std::array<std::string, kCellPlaces>, kHeadLenses> why_empty;
  /// Numbers of each lens's registers. JpegPlanesLayout says what one step is.
  std::array<std::uint32_t, kHeadLenses> gains{}, shutters{};
  /// Size of the whole as its header says, bytes. Fewer bytes may have come. More may follow, because the camera's
  /// buffer is larger.
  std::size_t size = 0;
};

/// How the planes are combined into one picture.
struct JpegPlanesLayout {
  /// Number of lens images in one row of the picture: 1, 2, 3 or 6. Lens 0 is in the upper left corner.
  std::uint32_t lens_columns = 1;
  /// The place in the 2 x 2 cell of each slot's plane: 0 upper left, 1 upper right, 2 lower left, 3 lower right.
  /// Published readers disagree about the cameras' order, so it is a setting.
  std::array<std::uint8_t, kCellPlaces> plane_places{0, 1, 2, 3};
  /// Lenses whose pixels are used. The planes of the others are not decoded, and their pixels are 0.
  std::array<bool, kHeadLenses> is_used{true, true, true, true, true, true};
  /// What one step of JpegPlanes::shutters and gains means; 0: it is not known, and they are not used.
  nanoseconds shutter_step{0};
  double gain_step_dB = 0;

  std::uint32_t lens_rows() const { return static_cast<std::uint32_t>(kHeadLenses) / lens_columns; }
  void visit(Keys& keys);
  /// Returns the part of a picture of this size that a lens has.
  PixelRegion region_of(std::size_t lens, std::uint32_t width, std::uint32_t height) const;
  /// Returns what the camera says of each lens's exposure, in a picture of this size; nothing if no step is known.
  std::vector<ReportedExposure> reported(const JpegPlanes& planes, std::uint32_t width, std::uint32_t height) const;
  /// Takes only those lenses whose images, in a picture of this size, overlap one of `regions`.
  void use_only(const std::vector<PixelRegion>& regions, std::uint32_t width, std::uint32_t height);
  /// Checks the layout for a picture of this size, in pixels.
  KeyError validate(std::uint32_t width, std::uint32_t height) const;
};

/// Reads the header and the table of the planes. Errors: Truncated (fewer bytes than the header has), Malformed (the
/// magic), Unsupported (another version). A plane outside the bytes is no error here; see JpegPlanes::why_empty.
Result<JpegPlanes> read_jpeg_planes(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
