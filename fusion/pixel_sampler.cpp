#include "fusion/pixel_sampler.hpp"

#include <algorithm>

namespace hueline::fusion {

RawView view_of(const Image& image) {
  RawView view;
  const std::size_t row_bytes = static_cast<std::size_t>(image.width) * (image.format == PixelFormat::Rgb8 ? 3 : 1);
  const std::size_t stride = image.stride != 0 ? image.stride : row_bytes;
  if (image.width == 0 || image.height == 0 || stride < row_bytes || image.pixel_offset > image.buffer.size())
    return view;
  const std::span<const std::byte> pixels = image.pixels();
  if (pixels.size() < stride * (image.height - 1) + row_bytes) return view;
  view.data = reinterpret_cast<const std::uint8_t*>(pixels.data());
  view.stride = stride;
  view.width = image.width;
  view.height = image.height;
  view.format = image.format;
  return view;
}

std::uint64_t content_of(const RawView& view) {
  constexpr std::size_t kPixels = 16384;
  std::uint64_t hash = 0xcbf29ce484222325ull;
  const std::size_t size = view.stride * (view.height - 1) + view.width,
                    least = std::max<std::size_t>(1, size / kPixels);
  // A step that is divisible by neither 2 nor 3 reaches every place of a Bayer cell and every colour of a triplet.
  const std::size_t step = least / 6 * 6 + 1;
  for (std::size_t at = 0; at < size; at += step) hash = (hash ^ view.data[at]) * 0x100000001b3ull;
  return hash;
}

}  // namespace hueline::fusion
