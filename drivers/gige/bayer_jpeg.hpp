#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace hueline::drivers {

/// Four grey JPEGs, one a place of the Bayer cell, -> the mosaic, in one pass: the planes of a row of cells are decoded
/// side by side, and only the finished rows of the mosaic go to memory. The accurate DCT is used, whose SIMD and plain
/// forms agree bit for bit: the same bytes on every machine. A decoder is kept for reuse, because its tables and memory
/// are. Thread-bound.
class BayerJpegDecoder {
 public:
  /// What the mosaic is written to.
  struct Mosaic {
    std::uint8_t* upper_left = nullptr;
    std::size_t stride = 0;               ///< bytes a row
    std::uint32_t width = 0, height = 0;  ///< even, pixels
  };
  /// By place: upper left, upper right, lower left, lower right.
  using Planes = std::array<std::span<const std::byte>, 4>;
  /// Which plane is broken, and why.
  struct Problem {
    std::size_t place = 0;
    std::string why;  ///< empty: none is
  };

  BayerJpegDecoder();
  ~BayerJpegDecoder();
  BayerJpegDecoder(const BayerJpegDecoder&) = delete;
  BayerJpegDecoder& operator=(const BayerJpegDecoder&) = delete;

  /// Broken is a plane that is no baseline grey JPEG of 8 bits and half the mosaic's size, that ends early, or that its
  /// decoder can only mend by guessing. The mosaic then holds some of the rows. Never aborts, whatever the bytes.
  Problem decode(const Planes& planes, const Mosaic& mosaic);

 private:
  struct Pair;
  std::unique_ptr<Pair> pair_;
};

}  // namespace hueline::drivers
