#pragma once

#include <string>

#include "storage/png.hpp"

/// The few shapes that a picture of a cloud needs. Every function clips at the picture's border.
namespace hueline::storage {

/// Draws a filled rectangle. (x, y) is its upper left pixel.
void fill_rectangle(RgbImage& image, int x, int y, int width, int height, Rgb colour);
/// Draws a filled triangle. Corners are in pixels.
void fill_triangle(RgbImage& image, const std::array<std::array<double, 2>, 3>& corners, Rgb colour);
/// Draws digits, '.', ' ', 'm', 'k' and 'N' as 5 x 7 dots of `size` pixels each. Other characters stay empty.
void draw_text(RgbImage& image, int x, int y, const std::string& text, int size, Rgb colour);
/// Returns the width of that text in pixels.
int text_width(const std::string& text, int size);

}  // namespace hueline::storage
