#pragma once

#include <string>

#include "storage/png.hpp"

/// The few marks that a picture of a cloud needs. All clip at the picture's border.
namespace hueline::storage {

void fill_rectangle(RgbImage& image, int x, int y, int width, int height, Rgb colour);
/// Filled; corners in pixels.
void fill_triangle(RgbImage& image, const std::array<std::array<double, 2>, 3>& corners, Rgb colour);
/// Digits, '.', ' ', 'm', 'k', 'N' of 5 x 7 dots, each dot `size` pixels; other characters stay empty.
void draw_text(RgbImage& image, int x, int y, const std::string& text, int size, Rgb colour);
/// Width of that text in pixels.
int text_width(const std::string& text, int size);

}  // namespace hueline::storage
