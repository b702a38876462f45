#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/measurements.hpp"

namespace hueline::drivers {

/// Decodes the JPEGs of cameras, one an image (Motion JPEG). Cameras leave out the Huffman tables; the usual ones are
/// then taken. It uses the accurate DCT, whose SIMD and plain versions agree bit for bit, so every machine gives the
/// same bytes. Keep a decoder and use it again.
/// Thread safety: none; one thread calls all functions.
class MotionJpegDecoder {
 public:
  MotionJpegDecoder();
  ~MotionJpegDecoder();
  MotionJpegDecoder(const MotionJpegDecoder&) = delete;
  MotionJpegDecoder& operator=(const MotionJpegDecoder&) = delete;

  /// What the head of a JPEG says.
  struct Head {
    std::uint32_t width = 0, height = 0;
    PixelFormat format = PixelFormat::Rgb8;  ///< Rgb8, or Mono8 if it is grey
    std::string why;                         ///< why it cannot be decoded; empty if nothing is known against it
  };
  /// Reads the head of `jpeg`. It can be decoded if it is a JPEG of 8 bits with one or three components that is not
  /// progressive: no camera sends such a one, and it would take much memory.
  Head read_head(std::span<const std::byte> jpeg);

  /// Decodes `jpeg` into rows without filling; `out` has room for the image that read_head() described. Returns why the
  /// JPEG is broken, or an empty text. It is broken if it ends early or if libjpeg could repair it only by guessing;
  /// some of the rows are then not written. Never aborts, whatever the bytes are.
  std::string decode(std::span<const std::byte> jpeg, std::byte* out);

 private:
  struct Reader;
  std::unique_ptr<Reader> reader_;
};

}  // namespace hueline::drivers
