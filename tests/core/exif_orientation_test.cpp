#include "core/exif_orientation.hpp"

#include <gtest/gtest.h>

#include <string>

namespace hueline {
namespace {

using namespace std::string_literals;

std::string big(std::uint32_t value, int bytes) {
  std::string out;
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>(value >> (8 * i));
  return out;
}

/// EXIF data with a text, an orientation and nothing else.
std::string exif_of(int orientation, bool is_little) {
  const auto number = [&](std::uint32_t value, int bytes) {
    std::string out = big(value, bytes);
    return is_little ? std::string(out.rbegin(), out.rend()) : out;
  };
  const auto value = static_cast<std::uint32_t>(orientation);
  return (is_little ? "II"s : "MM"s) + number(42, 2) + number(8, 4) + number(2, 2) +  //
         number(0x0100, 2) + number(4, 2) + number(1, 4) + number(7, 4) +             // ImageWidth
         number(0x0112, 2) + number(3, 2) + number(1, 4) + number(value, 2) + "\0\0"s + number(0, 4);
}

std::string jpeg_of(const std::string& exif) {
  const std::string content = "Exif\0\0"s + exif;
  return "\xFF\xD8\xFF\xE0\x00\x04JF\xFF\xFF\xE1"s + big(static_cast<std::uint32_t>(content.size() + 2), 2) + content +
         "\xFF\xDA\x00\x02"s;
}

TEST(ExifOrientation, IsReadFromJpegAndPng) {
  for (int orientation = 1; orientation <= 8; ++orientation)
    for (const bool is_little : {true, false}) {
      const std::string exif = exif_of(orientation, is_little);
      EXPECT_EQ(exif_orientation(jpeg_of(exif)), orientation);
      EXPECT_EQ(exif_orientation("\x89PNG\r\n\x1A\n"s + big(2, 4) + "tEXtab" + "crc0" +
                                 big(static_cast<std::uint32_t>(exif.size()), 4) + "eXIf" + exif + "crc1"),
                orientation);
    }
}

TEST(ExifOrientation, IsOneWhereTheFileDoesNotSay) {
  EXPECT_EQ(exif_orientation(""), 1);
  EXPECT_EQ(exif_orientation("\xFF\xD8\xFF\xDA\x00\x02"s), 1);
  EXPECT_EQ(exif_orientation(jpeg_of(exif_of(0, true))), 1);
  EXPECT_EQ(exif_orientation(jpeg_of(exif_of(9, false))), 1);
  const std::string whole = jpeg_of(exif_of(6, true));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const int found = exif_orientation(whole.substr(0, length));
    EXPECT_TRUE(found == 1 || found == 6) << length;
  }
}

/// The first row and the first column of the stored image, by the words of the EXIF standard.
TEST(ExifOrientation, TurnsAsTheStandardSays) {
  // a b c
  // d e f
  const std::string stored = "abcdef";
  const std::pair<int, const char*> shown[] = {{1, "abcdef"}, {2, "cbafed"}, {3, "fedcba"}, {4, "defabc"},
                                               {5, "adbecf"}, {6, "daebfc"}, {7, "fcebda"}, {8, "cfbead"}};
  for (const auto& [orientation, wanted] : shown) {
    int width = 3, height = 2;
    std::vector<char> pixels(stored.begin(), stored.end());
    turn_as_shown(orientation, width, height, pixels);
    EXPECT_EQ(std::string(pixels.begin(), pixels.end()), wanted) << orientation;
    EXPECT_EQ(width, swaps_sides(orientation) ? 2 : 3);
    EXPECT_EQ(height, swaps_sides(orientation) ? 3 : 2);
  }
}

}  // namespace
}  // namespace hueline
