#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/measurements.hpp"

/// Samples the colour at a sub-pixel place of a raw image, without demosaicing the rest of it. The interpolation is
/// bilinear on the lattice of each colour: red and blue on squares of 2 px, green on a diagonal lattice of sqrt(2) px.
/// It is exact for a colour that changes linearly.
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

/// The sampler reads pixels up to this far from the requested place, px.
constexpr int kSampleReach = 2;

namespace detail {

inline float at(const std::uint8_t* row, std::ptrdiff_t x) { return static_cast<float>(row[x]); }

/// Interpolates bilinearly on the square lattice of pixels with the parity (px, py), whose spacing is 2.
inline float sample_square(const RawView& image, int x, int y, float fx, float fy, int px, int py) {
  const int odd_x = (x ^ px) & 1, odd_y = (y ^ py) & 1;
  const float wx = 0.5f * (fx + static_cast<float>(odd_x)), wy = 0.5f * (fy + static_cast<float>(odd_y));
  const std::uint8_t* upper = image.data + static_cast<std::size_t>(y - odd_y) * image.stride;
  const std::uint8_t* lower = upper + 2 * image.stride;
  const std::ptrdiff_t left = x - odd_x;
  const float a = at(upper, left), b = at(upper, left + 2), c = at(lower, left), d = at(lower, left + 2);
  const float top = a + wx * (b - a), bottom = c + wx * (d - c);
  return top + wy * (bottom - top);
}

/// Interpolates bilinearly on the diagonal lattice of pixels with one parity of (x + y), whose spacing is sqrt(2).
inline float sample_diagonal(const RawView& image, int x, int y, float fx, float fy, int parity) {
  const int sum = x + y - parity, difference = x - y - parity;
  const float a = 0.5f * (fx + fy + static_cast<float>(sum & 1)),
              b = 0.5f * (fx - fy + static_cast<float>(difference & 1));
  const int a_whole = a >= 1.0f ? 1 : 0;                    // a is in [0, 1.5)
  const int b_whole = b >= 1.0f ? 1 : (b < 0.0f ? -1 : 0);  // b is in (-0.5, 1)
  const int m = (sum >> 1) + a_whole, n = (difference >> 1) + b_whole;
  const float wa = a - static_cast<float>(a_whole), wb = b - static_cast<float>(b_whole);
  const std::ptrdiff_t left = m + n + parity;
  const std::uint8_t* middle = image.data + static_cast<std::size_t>(m - n) * image.stride;
  const float west = at(middle, left), south = at(middle + image.stride, left + 1);
  const float north = at(middle - image.stride, left + 1), east = at(middle, left + 2);
  const float near_row = west + wa * (south - west), far_row = north + wa * (east - north);
  return near_row + wb * (far_row - near_row);
}

inline float sample_plain(const RawView& image, int x, int y, float fx, float fy, int step, int channel) {
  const std::uint8_t* upper = image.data + static_cast<std::size_t>(y) * image.stride + x * step + channel;
  const std::uint8_t* lower = upper + image.stride;
  const float a = at(upper, 0), b = at(upper, step), c = at(lower, 0), d = at(lower, step);
  const float top = a + fx * (b - a), bottom = c + fx * (d - c);
  return top + fy * (bottom - top);
}

}  // namespace detail

/// Returns the colour at column x + fx and row y + fy; fx and fy are in [0, 1). The caller ensures that the place is at
/// least kSampleReach inside the image.
inline Rgb sample(const RawView& image, int x, int y, float fx, float fy) {
  using namespace detail;
  int red_x = 0, red_y = 0;
  switch (image.format) {
    case PixelFormat::Mono8: {
      const float grey = sample_plain(image, x, y, fx, fy, 1, 0);
      return {grey, grey, grey};
    }
    case PixelFormat::Rgb8:
      return {sample_plain(image, x, y, fx, fy, 3, 0), sample_plain(image, x, y, fx, fy, 3, 1),
              sample_plain(image, x, y, fx, fy, 3, 2)};
    case PixelFormat::BayerRG8:
      break;
    case PixelFormat::BayerGR8:
      red_x = 1;
      break;
    case PixelFormat::BayerGB8:
      red_y = 1;
      break;
    case PixelFormat::BayerBG8:
      red_x = red_y = 1;
      break;
  }
  // In the 2 x 2 cell, blue is diagonally opposite to red; green is at the other two places.
  return {sample_square(image, x, y, fx, fy, red_x, red_y), sample_diagonal(image, x, y, fx, fy, 1 ^ red_x ^ red_y),
          sample_square(image, x, y, fx, fy, 1 ^ red_x, 1 ^ red_y)};
}

}  // namespace hueline::fusion
