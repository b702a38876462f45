#include "survey/lens_image.hpp"

namespace hueline::survey {

using calibration::GreyImage;

GreyImage grey_lens_image(const Image& image, const fusion::LensMount& lens) {
  GreyImage out;
  const auto w = static_cast<std::size_t>(lens.intrinsics.width), h = static_cast<std::size_t>(lens.intrinsics.height);
  if (lens.x_offset + w > image.width || lens.y_offset + h > image.height) return out;
  out.width = static_cast<int>(w);
  out.height = static_cast<int>(h);
  out.pixels.resize(w * h);
  const auto* pixels = reinterpret_cast<const std::uint8_t*>(image.pixels().data());
  const auto at = [&](std::size_t x, std::size_t y) -> int {
    return pixels[(lens.y_offset + y) * image.stride + lens.x_offset + x];
  };
  for (std::size_t y = 0; y < h; ++y)
    for (std::size_t x = 0; x < w; ++x) {
      int value;
      if (image.format == PixelFormat::Rgb8) {
        const std::uint8_t* p = pixels + (lens.y_offset + y) * image.stride + 3 * (lens.x_offset + x);
        value = (p[0] + 2 * p[1] + p[2]) / 4;
      } else if (image.format == PixelFormat::Mono8) {
        value = at(x, y);
      } else {
        // Weights 1 2 1 in both directions take (R + 2 G + B) / 4 out of a Bayer mosaic wherever they stand.
        const std::size_t l = x ? x - 1 : 1, r = x + 1 < w ? x + 1 : w - 2, u = y ? y - 1 : 1,
                          d = y + 1 < h ? y + 1 : h - 2;
        value = (at(l, u) + at(r, u) + at(l, d) + at(r, d) + 2 * (at(x, u) + at(x, d) + at(l, y) + at(r, y)) +
                 4 * at(x, y)) /
                16;
      }
      out.pixels[y * w + x] = static_cast<std::uint8_t>(value);
    }
  return out;
}

}  // namespace hueline::survey
