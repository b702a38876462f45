#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/wire/little_endian.hpp"

/// Encodes exposures as a Ladybug sends them in its JPEG modes: 24 grey JPEGs, one for each lens and each place of the
/// Bayer cell (docs/formats.md, "JPEG planes"). Pure function, reentrant.
namespace hueline::sim {

/// An exposure to encode.
struct JpegPlanesImage {
  std::span<const std::uint8_t> mosaic;  ///< width x height bytes; the images of the lenses stand side by side
  std::uint32_t width = 0, height = 0;
  std::uint32_t lens_columns = 3, lens_rows = 2;
  std::size_t lenses = 6;    ///< at most 6; the entries of missing lenses in the table are zero
  std::int64_t unix_us = 0;  ///< time by the head's clock
  std::uint32_t sequence = 0;
  /// Shutter and gain of each lens, written in us and in steps of 0.1 dB from -40 dB; a gain of 0 is written as 0.
  std::vector<CameraExposure::Report> reports;
  int quality = 85;  ///< quality of the JPEGs, 1 .. 100
};

/// Returns the bytes of the camera's buffer. Errors: Invalid (the mosaic does not consist of lens images with even
/// sides), Exhausted (no memory for the encoder).
Result<Bytes> encode_jpeg_planes(const JpegPlanesImage& image);

}  // namespace hueline::sim
