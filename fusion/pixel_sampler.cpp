#include "fusion/pixel_sampler.hpp"

namespace hueline::fusion {

RawView view_of(const Image& image) {
  RawView view;
  const std::size_t row_bytes = static_cast<std::size_t>(image.width) * (image.format == PixelFormat::Rgb8 ? 3 : 1);
  const std::size_t stride = image.stride != 0 ? image.stride : row_bytes;
  if (image.width == 0 || image.height == 0 || stride < row_bytes || image.pixel_offset > image.buffer.size()) return view;
  const std::span<const std::byte> pixels = image.pixels();
  if (pixels.size() < stride * (image.height - 1) + row_bytes) return view;
  view.data = reinterpret_cast<const std::uint8_t*>(pixels.data());
  view.stride = stride;
  view.width = image.width;
  view.height = image.height;
  view.format = image.format;
  return view;
}

}  // namespace hueline::fusion
