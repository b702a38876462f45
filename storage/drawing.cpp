#include "storage/drawing.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::storage {
namespace {

constexpr int kGlyphWidth = 5, kGlyphHeight = 7;

struct Glyph {
  char character;
  std::array<std::uint8_t, kGlyphHeight> rows;  // bit 4 is the left column
};
constexpr Glyph kGlyphs[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},     {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'3', {31, 2, 4, 2, 1, 17, 14}},     {'4', {2, 6, 10, 18, 31, 2, 2}},    {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},      {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},   {'.', {0, 0, 0, 0, 0, 12, 12}},     {'m', {0, 0, 26, 21, 21, 21, 21}},
    {'k', {16, 16, 18, 20, 24, 20, 18}}, {'N', {17, 25, 25, 21, 19, 19, 17}}};

}  // namespace

void fill_rectangle(RgbImage& image, int x, int y, int width, int height, Rgb colour) {
  for (int row = std::max(0, y); row < std::min(image.height, y + height); ++row)
    for (int column = std::max(0, x); column < std::min(image.width, x + width); ++column)
      image.at(column, row) = colour;
}

void fill_triangle(RgbImage& image, const std::array<std::array<double, 2>, 3>& c, Rgb colour) {
  const auto [left, right] = std::minmax({c[0][0], c[1][0], c[2][0]});
  const auto [top, bottom] = std::minmax({c[0][1], c[1][1], c[2][1]});
  const auto side = [&](std::size_t a, std::size_t b, double x, double y) {
    return (c[b][0] - c[a][0]) * (y - c[a][1]) - (c[b][1] - c[a][1]) * (x - c[a][0]);
  };
  for (int y = static_cast<int>(std::floor(top)); y <= static_cast<int>(bottom); ++y)
    for (int x = static_cast<int>(std::floor(left)); x <= static_cast<int>(right); ++x) {
      const double s[] = {side(0, 1, x, y), side(1, 2, x, y), side(2, 0, x, y)};
      const bool inside = (s[0] >= 0 && s[1] >= 0 && s[2] >= 0) || (s[0] <= 0 && s[1] <= 0 && s[2] <= 0);
      if (inside && image.contains(x, y)) image.at(x, y) = colour;
    }
}

void draw_text(RgbImage& image, int x, int y, const std::string& text, int size, Rgb colour) {
  for (const char character : text) {
    for (const Glyph& glyph : kGlyphs) {
      if (glyph.character != character) continue;
      for (int row = 0; row < kGlyphHeight; ++row)
        for (int column = 0; column < kGlyphWidth; ++column)
          if (glyph.rows[static_cast<std::size_t>(row)] >> (kGlyphWidth - 1 - column) & 1)
            fill_rectangle(image, x + column * size, y + row * size, size, size, colour);
    }
    x += (kGlyphWidth + 1) * size;
  }
}

int text_width(const std::string& text, int size) {
  return static_cast<int>(text.size()) * (kGlyphWidth + 1) * size - size;
}

}  // namespace hueline::storage
