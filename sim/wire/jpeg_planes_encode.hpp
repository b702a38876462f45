#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "sim/wire/little_endian.hpp"

/// An exposure as a Ladybug sends it in its JPEG modes: 24 grey JPEGs, one a lens and place of the Bayer cell
/// (docs/formats.md, "JPEG planes"). Pure function, reentrant.
namespace hueline::sim {

struct JpegPlanesImage {
  std::span<const std::uint8_t> mosaic;  ///< width x height bytes, lens images side by side
  std::uint32_t width = 0, height = 0;
  std::uint32_t lens_columns = 3, lens_rows = 2;
  std::size_t lenses = 6;    ///< at most 6; the table's other entries are zero
  std::int64_t unix_us = 0;  ///< what the head's clock says
  std::uint32_t sequence = 0;
  std::uint32_t exposure_us = 0;
  int quality = 85;  ///< of the JPEGs, 1 .. 100
};

/// Invalid: a mosaic that is not made of lens images of even sides. Exhausted: no memory for the encoder.
Result<Bytes> encode_jpeg_planes(const JpegPlanesImage& image);

}  // namespace hueline::sim
