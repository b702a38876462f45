#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/measurements.hpp"

/// Samples the colour at a sub-pixel place of a raw image, without demosaicing the rest of it. The four pixels around
/// the place are demosaiced with the linear filters of Malvar, He and Cutler (High-quality linear interpolation for
/// demosaicing of Bayer-patterned color images, ICASSP 2004): edges of things change all colours alike, so what a
/// pixel's own colour does around it corrects the others, and edges get less coloured fringes. Between the four pixels
/// the interpolation is bilinear. It is exact for a colour that changes linearly.
namespace hueline::fusion {

/// A colour, 0 to 255 in each channel. Mono8 gives three equal values.
struct Rgb {
  float red = 0, green = 0, blue = 0;
};

/// The pixels of an image in memory that somebody else owns.
struct RawView {
  const std::uint8_t* data = nullptr;
  std::size_t stride = 0;  ///< bytes for each row
  std::uint32_t width = 0, height = 0;
  PixelFormat format = PixelFormat::Mono8;
};
/// Returns a view of the image's pixels. Its data are null if the image's buffer is too small for the image's size.
RawView view_of(const Image& image);

/// Returns a number that is equal for two pictures only if about ten thousand pixels all over them are equal. Two
/// exposures of a real sensor never are.
std::uint64_t content_of(const RawView& view);

/// sample() reads pixels up to this far from the requested place, px.
constexpr int kSampleReach = 3;
/// Pixels farther away than this have a share of an eighth at most in what sample() returns, px.
constexpr int kMixedReach = 2;
/// sample_pixel() reads pixels up to this far, px.
constexpr int kPixelReach = 1;

namespace detail {

inline float at(const std::uint8_t* row, std::ptrdiff_t x) { return static_cast<float>(row[x]); }

/// A pixel of a mosaic and what is around it, as sums.
struct Surroundings {
  Surroundings(const std::uint8_t* p, std::ptrdiff_t row)
      : own(p[0]),
        beside(p[-1] + p[1]),
        above(p[-row] + p[row]),
        beside2(p[-2] + p[2]),
        above2(p[-2 * row] + p[2 * row]),
        corners(p[-row - 1] + p[-row + 1] + p[row - 1] + p[row + 1]) {}
  int own, beside, above, beside2, above2, corners;

  /// The colours that the pixel does not have, times 16. For a red or blue pixel: green, and blue or red.
  int green() const { return 8 * own + 4 * (beside + above) - 2 * (beside2 + above2); }
  int opposite() const { return 12 * own + 4 * corners - 3 * (beside2 + above2); }
  /// For a green pixel: the colour of the pixels beside it, and of those above and below it.
  int of_row() const { return 10 * own + 8 * beside - 2 * corners - 2 * beside2 + above2; }
  int of_column() const { return 10 * own + 8 * above - 2 * corners - 2 * above2 + beside2; }
};

/// Interpolates in a mosaic whose red pixels have the parity (red_x, red_y).
inline Rgb sample_mosaic(const RawView& image, int x, int y, float fx, float fy, int red_x, int red_y) {
  const auto stride = static_cast<std::ptrdiff_t>(image.stride);
  const std::uint8_t* first = image.data + y * stride + x;
  // Of the four pixels around the place one is red, one blue, and two are green, one of them in the red pixel's row.
  const std::ptrdiff_t right = (x ^ red_x) & 1, below = (y ^ red_y) & 1;
  const std::uint8_t *red_row = first + below * stride, *blue_row = first + (1 - below) * stride;
  const Surroundings red(red_row + right, stride), beside_red(red_row + 1 - right, stride),
      above_red(blue_row + right, stride), blue(blue_row + 1 - right, stride);
  const float column = right != 0 ? fx : 1.0f - fx, line = below != 0 ? fy : 1.0f - fy;
  const float of_red = column * line, of_beside = (1.0f - column) * line, of_above = column * (1.0f - line),
              of_blue = (1.0f - column) * (1.0f - line);
  const auto mix = [&](int at_red, int at_beside, int at_above, int at_blue) {
    const auto value = [](int times_16) { return static_cast<float>(std::clamp(times_16, 0, 16 * 255)); };
    return (of_red * value(at_red) + of_beside * value(at_beside) + of_above * value(at_above) +
            of_blue * value(at_blue)) *
           (1 / 16.0f);
  };
  return {mix(16 * red.own, beside_red.of_row(), above_red.of_column(), blue.opposite()),
          mix(red.green(), 16 * beside_red.own, 16 * above_red.own, blue.green()),
          mix(red.opposite(), beside_red.of_column(), above_red.of_row(), 16 * blue.own)};
}

inline float sample_plain(const RawView& image, int x, int y, float fx, float fy, int step, int channel) {
  const std::uint8_t* upper = image.data + static_cast<std::size_t>(y) * image.stride + x * step + channel;
  const std::uint8_t* lower = upper + image.stride;
  const float a = at(upper, 0), b = at(upper, step), c = at(lower, 0), d = at(lower, step);
  const float top = a + fx * (b - a), bottom = c + fx * (d - c);
  return top + fy * (bottom - top);
}

}  // namespace detail

/// The least significant bits of the column and the row of a mosaic's red pixels.
struct RedParity {
  int x, y;
};
/// Returns nothing if the format is no mosaic.
constexpr std::optional<RedParity> red_parity(PixelFormat format) {
  switch (format) {
    case PixelFormat::Mono8:
    case PixelFormat::Rgb8:
      return std::nullopt;
    case PixelFormat::BayerRG8:
      return RedParity{0, 0};
    case PixelFormat::BayerGR8:
      return RedParity{1, 0};
    case PixelFormat::BayerGB8:
      return RedParity{0, 1};
    case PixelFormat::BayerBG8:
      return RedParity{1, 1};
  }
  return std::nullopt;
}

/// Returns the colour at column x + fx and row y + fy; fx and fy are in [0, 1). The caller ensures that the place is at
/// least kSampleReach inside the image.
inline Rgb sample(const RawView& image, int x, int y, float fx, float fy) {
  using namespace detail;
  if (const auto red = red_parity(image.format)) return sample_mosaic(image, x, y, fx, fy, red->x, red->y);
  if (image.format == PixelFormat::Rgb8)
    return {sample_plain(image, x, y, fx, fy, 3, 0), sample_plain(image, x, y, fx, fy, 3, 1),
            sample_plain(image, x, y, fx, fy, 3, 2)};
  const float grey = sample_plain(image, x, y, fx, fy, 1, 0);
  return {grey, grey, grey};
}

/// Returns the colour at the pixel in column x and row y. Of a mosaic it uses only the eight pixels around it, as an
/// image's margin has no more, so edges get more coloured fringes than with sample(). The caller ensures that the pixel
/// is at least kPixelReach inside the image.
inline Rgb sample_pixel(const RawView& image, int x, int y) {
  const auto row = static_cast<std::ptrdiff_t>(image.stride);
  const auto red = red_parity(image.format);
  if (!red) return sample(image, x, y, 0, 0);
  const std::uint8_t* p = image.data + y * row + x;
  const auto mean = [](int sum, int count) { return static_cast<float>(sum) / static_cast<float>(count); };
  const float own = p[0];
  const int beside = p[-1] + p[1], above = p[-row] + p[row];
  const bool is_red_row = (y & 1) == red->y;
  if (is_red_row == ((x & 1) == red->x)) {
    const float green = mean(beside + above, 4),
                opposite = mean(p[-row - 1] + p[-row + 1] + p[row - 1] + p[row + 1], 4);
    return is_red_row ? Rgb{own, green, opposite} : Rgb{opposite, green, own};
  }
  const float of_row = mean(beside, 2), of_column = mean(above, 2);
  return is_red_row ? Rgb{of_row, own, of_column} : Rgb{of_column, own, of_row};
}

/// Places in one image, one element for each: what sample() takes.
struct ImagePlaces {
  std::vector<std::int32_t> x, y;
  std::vector<float> fx, fy;
  std::size_t size() const { return x.size(); }
  void resize(std::size_t size) {
    x.resize(size);
    y.resize(size);
    fx.resize(size);
    fy.resize(size);
  }
};

/// Writes what sample() returns for each place to `out`. Uses the widest vector instructions that the processor has;
/// the results have the same bits with each of them.
void sample_each(const RawView& image, const ImagePlaces& places, Rgb* out);

}  // namespace hueline::fusion
