#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "drivers/gige/bayer_jpeg.hpp"
#include "drivers/gige/jpeg_planes.hpp"

namespace hueline::drivers {

/// Makes the mosaic of one exposure of a six-lens head from its 24 JPEGs (jpeg_planes.hpp). A lens with a plane that is
/// missing, cut short or broken is lost alone: Image::lost names its rectangle, whose pixels are 0, and a Fault
/// Malformed has the number of such lenses and the reason of the first one. If all lenses are lost, there is no Image.
/// Lenses that are not used are not decoded: their pixels are 0.
/// Thread safety: none; one thread calls all functions.
class PlanesDecoder {
 public:
  /// `width` and `height` are those of the mosaic, in pixels. Layouts are checked by JpegPlanesLayout::validate().
  PlanesDecoder(std::uint32_t width, std::uint32_t height, const JpegPlanesLayout& layout)
      : width_(width), height_(height), layout_(layout), mosaics_(std::numeric_limits<std::size_t>::max()) {}

  /// Decodes `planes`, a part of `packet`, and appends `image` with its pixels, or faults. `image` has everything but
  /// its size and pixels. All bytes of the packet are counted.
  void decode(std::span<const std::byte> planes, const Packet& packet, Image image, DecodeCounts& counts,
              std::vector<Measurement>& out);

 private:
  /// Decodes one lens into the mosaic. Returns why the lens is lost, or an empty text.
  std::string decode_lens(std::size_t lens, const JpegPlanes& planes, std::uint8_t* mosaic);

  const std::uint32_t width_, height_;
  const JpegPlanesLayout layout_;
  BayerJpegDecoder jpeg_;
  BufferPool mosaics_;  // grows with the number of mosaics that are held; released ones are reused
};

}  // namespace hueline::drivers
