#pragma once

#include <cstddef>
#include <cstdint>

namespace hueline {

/// Where the samples of an uncompressed image lie in the bytes of a packet. Neighbouring rows are alike, which is what
/// storage/packed_rows.hpp makes use of.
struct PixelRows {
  std::uint32_t offset = 0;       ///< bytes before the first row
  std::uint32_t stride = 0;       ///< bytes from row to row
  std::uint32_t rows = 0;         ///< 0: the packet has no such image
  std::uint8_t sample_bytes = 1;  ///< 1, or 2 in little-endian order
  std::uint8_t colour_rows = 1;   ///< rows down to the next sample of the same colour: 2 in a Bayer mosaic

  /// Returns whether the rows are possible and lie within so many bytes.
  bool fit(std::size_t bytes) const {
    return rows > 0 && stride > 0 && (sample_bytes == 1 || sample_bytes == 2) && stride % sample_bytes == 0 &&
           (colour_rows == 1 || colour_rows == 2) && std::uint64_t{offset} + std::uint64_t{stride} * rows <= bytes;
  }
  bool operator==(const PixelRows&) const = default;
};

}  // namespace hueline
