#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace hueline::drivers {

/// Decodes four grey JPEGs, one for each place of the Bayer cell, into one mosaic, in one pass: the planes of one row
/// of cells are decoded side by side, and only finished rows of the mosaic are written to memory.
/// It uses the accurate DCT, whose SIMD and plain versions agree bit for bit, so every machine gives the same bytes.
/// Keep a decoder and use it again, because its tables and memory are reused.
/// Thread safety: none; one thread calls all functions.
class BayerJpegDecoder {
 public:
  /// Where the mosaic is written.
  struct Mosaic {
    std::uint8_t* upper_left = nullptr;
    std::size_t stride = 0;               ///< from one row to the next, bytes
    std::uint32_t width = 0, height = 0;  ///< pixels; both even
  };
  /// The JPEGs in the order of their places in the cell: upper left, upper right, lower left, lower right.
  using Planes = std::array<std::span<const std::byte>, 4>;
  /// Tells which plane is broken, and why.
  struct Problem {
    std::size_t place = 0;
    std::string why;  ///< empty if no plane is broken
  };

  BayerJpegDecoder();
  ~BayerJpegDecoder();
  BayerJpegDecoder(const BayerJpegDecoder&) = delete;
  BayerJpegDecoder& operator=(const BayerJpegDecoder&) = delete;

  /// Decodes `planes` into `mosaic`. Returns the first plane that is broken. A plane is broken if it is not a baseline
  /// grey JPEG of 8 bits and half the mosaic's size, if it ends early, or if libjpeg could repair it only by guessing.
  /// The mosaic then holds only some of the rows. Never aborts, whatever the bytes are.
  Problem decode(const Planes& planes, const Mosaic& mosaic);

 private:
  struct Pair;
  std::unique_ptr<Pair> pair_;
};

}  // namespace hueline::drivers
