#pragma once

#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

/// How a photograph is to be shown, as its EXIF data say. Its pixels have the rows and columns of the sensor, or of the
/// program that wrote it; viewers and some programs (OpenCV's imread) turn them before they show them.
namespace hueline {

/// Returns EXIF's Orientation (tag 0x0112) of a JPEG or PNG: 1 to 8. 1, as stored, if the file does not say.
int exif_orientation(std::string_view file);

/// Returns whether the shown image has the rows of the stored one as columns.
constexpr bool swaps_sides(int orientation) { return orientation >= 5; }

/// Returns what is done to the stored image to show it: "turned by 90 deg to the right".
const char* orientation_words(int orientation);

/// Turns the pixels of a stored image, row by row without gaps, as `orientation` shows it.
template <class Pixel>
void turn_as_shown(int orientation, int& width, int& height, std::vector<Pixel>& pixels) {
  if (orientation < 2 || orientation > 8) return;
  const std::size_t w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  const std::size_t shown_w = swaps_sides(orientation) ? h : w, shown_h = swaps_sides(orientation) ? w : h;
  const bool from_right = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool from_below = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  std::vector<Pixel> shown;
  shown.reserve(pixels.size());
  for (std::size_t y = 0; y < shown_h; ++y)
    for (std::size_t x = 0; x < shown_w; ++x) {
      const std::size_t column = swaps_sides(orientation) ? y : x, row = swaps_sides(orientation) ? x : y;
      shown.push_back(pixels[(from_below ? h - 1 - row : row) * w + (from_right ? w - 1 - column : column)]);
    }
  pixels = std::move(shown);
  width = static_cast<int>(shown_w), height = static_cast<int>(shown_h);
}

}  // namespace hueline
