#include "runtime/lens_image.hpp"

namespace hueline::runtime {

using calibration::GreyImage;

namespace {

int grey_of_rgb(const std::uint8_t* p) { return (p[0] + 2 * p[1] + p[2]) / 4; }

/// Returns the mean of each `cell` x `cell` pixels. `value` returns the pixel of a column and a row.
template <class Value>
GreyImage means(int width, int height, int cell, Value value) {
  GreyImage out;
  out.width = width / cell;
  out.height = height / cell;
  out.pixels.reserve(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      int sum = 0;
      for (int j = 0; j < cell; ++j)
        for (int i = 0; i < cell; ++i) sum += value(x * cell + i, y * cell + j);
      out.pixels.push_back(static_cast<std::uint8_t>(cell == 1 ? sum : (sum + cell * cell / 2) / (cell * cell)));
    }
  return out;
}

}  // namespace

GreyImage grey_lens_image(const Image& image, const fusion::LensMount& lens, int cell) {
  const std::size_t wide = lens.intrinsics.width, high = lens.intrinsics.height;
  if (lens.x_offset + wide > image.width || lens.y_offset + high > image.height) return {};
  const int w = static_cast<int>(wide), h = static_cast<int>(high);
  const auto* pixels = reinterpret_cast<const std::uint8_t*>(image.pixels().data());
  const auto row = [&](int y) { return pixels + (lens.y_offset + static_cast<std::size_t>(y)) * image.stride; };
  const auto at = [&](int x, int y) -> int { return row(y)[lens.x_offset + static_cast<std::size_t>(x)]; };
  if (image.format == PixelFormat::Rgb8)
    return means(w, h, cell,
                 [&](int x, int y) { return grey_of_rgb(row(y) + 3 * (lens.x_offset + static_cast<std::size_t>(x))); });
  // Cells of an even width have as many pixels of each colour as (R + 2 G + B) / 4 asks for.
  if (image.format == PixelFormat::Mono8 || cell % 2 == 0) return means(w, h, cell, at);
  // Weights 1 2 1 in both directions take (R + 2 G + B) / 4 out of a Bayer mosaic wherever they stand.
  return means(w, h, cell, [&](int x, int y) {
    const int l = x ? x - 1 : 1, r = x + 1 < w ? x + 1 : w - 2, u = y ? y - 1 : 1, d = y + 1 < h ? y + 1 : h - 2;
    return (at(l, u) + at(r, u) + at(l, d) + at(r, d) + 2 * (at(x, u) + at(x, d) + at(l, y) + at(r, y)) +
            4 * at(x, y)) /
           16;
  });
}

}  // namespace hueline::runtime
