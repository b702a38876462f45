#include "storage/image_view.hpp"

#include <turbojpeg.h>

#include <algorithm>
#include <memory>
#include <string>

namespace hueline::storage {
namespace {

/// Returns which colour (0 red, 1 green, 2 blue) stands at the four places of a quad: (0,0), (1,0), (0,1), (1,1).
std::array<std::size_t, 4> quad_colours(PixelFormat format) {
  switch (format) {
    case PixelFormat::BayerRG8:
      return {0, 1, 1, 2};
    case PixelFormat::BayerBG8:
      return {2, 1, 1, 0};
    case PixelFormat::BayerGR8:
      return {1, 0, 2, 1};
    case PixelFormat::BayerGB8:
      return {1, 2, 0, 1};
    default:
      return {};
  }
}

}  // namespace

std::uint32_t reduction(const Image& image, int longest_px) {
  const bool is_bayer = image.format != PixelFormat::Rgb8 && image.format != PixelFormat::Mono8;
  const std::uint32_t longest = std::max(image.width, image.height);
  std::uint32_t cell = (longest + static_cast<std::uint32_t>(longest_px) - 1) / static_cast<std::uint32_t>(longest_px);
  if (is_bayer) cell += cell & 1;  // whole quads only
  cell = std::min(cell, std::min(image.width, image.height));
  if (is_bayer) cell = std::max(cell & ~1u, 2u);
  return cell;
}

Result<RgbImage> reduced_view(const Image& image, int longest_px) {
  const bool rgb = image.format == PixelFormat::Rgb8, mono = image.format == PixelFormat::Mono8;
  const std::uint64_t row_bytes = std::uint64_t{image.width} * (rgb ? 3 : 1);
  if (image.width < 2 || image.height < 2 || image.stride < row_bytes || image.pixel_offset > image.buffer.size() ||
      std::uint64_t{image.stride} * (image.height - 1) + row_bytes > image.pixels().size() || longest_px < 1)
    return Error{ErrorCode::Invalid, "an image of " + std::to_string(image.width) + " x " +
                                         std::to_string(image.height) + " pixels does not fit its " +
                                         std::to_string(image.buffer.size()) + " bytes"};
  const std::uint32_t cell = reduction(image, longest_px);
  const std::array<std::size_t, 4> quad = quad_colours(image.format);
  const auto* const pixels = reinterpret_cast<const std::uint8_t*>(image.pixels().data());

  RgbImage view(static_cast<int>(image.width / cell), static_cast<int>(image.height / cell), {});
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      std::uint64_t sum[3] = {0, 0, 0}, count[3] = {0, 0, 0};
      for (std::uint32_t dy = 0; dy < cell; ++dy) {
        const std::uint8_t* row = pixels + (static_cast<std::size_t>(y) * cell + dy) * image.stride;
        for (std::uint32_t dx = 0; dx < cell; ++dx) {
          const std::size_t column = static_cast<std::size_t>(x) * cell + dx;
          if (rgb) {
            for (std::size_t k = 0; k < 3; ++k) sum[k] += row[3 * column + k], ++count[k];
          } else if (mono) {
            for (std::size_t k = 0; k < 3; ++k) sum[k] += row[column], ++count[k];
          } else {
            const std::size_t k = quad[(dy & 1) * 2 + (dx & 1)];
            sum[k] += row[column], ++count[k];
          }
        }
      }
      for (std::size_t k = 0; k < 3; ++k)
        view.at(x, y)[k] = static_cast<std::uint8_t>((sum[k] + count[k] / 2) / count[k]);
    }
  return view;
}

Result<Bytes> encode_jpeg(const RgbImage& image, int quality) {
  if (image.width <= 0 || image.height <= 0 || quality < 1 || quality > 100)
    return Error{ErrorCode::Invalid, "a JPEG needs pixels and a quality from 1 to 100"};
  struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
  };
  const std::unique_ptr<void, Destroy> handle(tjInitCompress());
  if (!handle) return Error{ErrorCode::Exhausted, "no memory for a JPEG encoder"};
  Bytes out(tjBufSize(image.width, image.height, TJSAMP_420));
  auto* at = reinterpret_cast<unsigned char*>(out.data());
  unsigned long size = out.size();
  // The accurate DCT is used because its SIMD form and its plain form agree bit for bit.
  if (tjCompress2(handle.get(), image.pixels.data()->data(), image.width, 0, image.height, TJPF_RGB, &at, &size,
                  TJSAMP_420, quality, TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT) != 0)
    return Error{ErrorCode::Invalid, std::string("JPEG: ") + tjGetErrorStr2(handle.get())};
  out.resize(size);
  return out;
}

}  // namespace hueline::storage
