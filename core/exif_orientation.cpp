#include "core/exif_orientation.hpp"

#include <array>
#include <cstdint>

namespace hueline {
namespace {

/// Reads an unsigned number of `size` bytes. 0 beyond the end.
std::uint32_t number_at(std::string_view bytes, std::size_t at, std::size_t size, bool is_little_endian) {
  if (at > bytes.size() || bytes.size() - at < size) return 0;
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < size; ++i)
    out = out << 8 | static_cast<unsigned char>(bytes[at + (is_little_endian ? size - 1 - i : i)]);
  return out;
}

/// Reads the orientation of the first directory of a TIFF, which EXIF data are.
int orientation_in(std::string_view tiff) {
  constexpr std::uint32_t kTag = 0x0112, kShort = 3;
  constexpr std::size_t kEntry = 12;
  const bool is_little = tiff.starts_with("II");
  if (!is_little && !tiff.starts_with("MM")) return 1;
  const std::size_t directory = number_at(tiff, 4, 4, is_little);
  const std::size_t entries = number_at(tiff, directory, 2, is_little);
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t at = directory + 2 + i * kEntry;
    if (at + kEntry > tiff.size()) break;
    if (number_at(tiff, at, 2, is_little) != kTag || number_at(tiff, at + 2, 2, is_little) != kShort) continue;
    const std::uint32_t value = number_at(tiff, at + 8, 2, is_little);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

/// Returns the EXIF data of a JPEG; empty: it has none.
std::string_view exif_of_jpeg(std::string_view jpeg) {
  constexpr std::string_view kName("Exif\0\0", 6);
  constexpr std::uint32_t kApp1 = 0xE1, kScan = 0xDA;
  for (std::size_t at = 2; at + 4 <= jpeg.size() && jpeg[at] == '\xFF';) {
    const std::uint32_t marker = number_at(jpeg, at + 1, 1, false);
    if (marker == 0xFF) {  // a filling byte
      ++at;
      continue;
    }
    const std::size_t length = number_at(jpeg, at + 2, 2, false);
    if (marker == kScan || length < 2) break;
    const std::string_view content = jpeg.substr(at + 4, length - 2);
    if (marker == kApp1 && content.starts_with(kName)) return content.substr(kName.size());
    at += 2 + length;
  }
  return {};
}

/// Returns the EXIF data of a PNG; empty: it has none.
std::string_view exif_of_png(std::string_view png) {
  for (std::size_t at = 8; at + 8 <= png.size();) {
    const std::size_t length = number_at(png, at, 4, false);
    if (png.substr(at + 4, 4) == "eXIf") return png.substr(at + 8, length);
    if (length > png.size()) break;
    at += 12 + length;
  }
  return {};
}

}  // namespace

int exif_orientation(std::string_view file) {
  if (file.starts_with("\xFF\xD8")) return orientation_in(exif_of_jpeg(file));
  if (file.starts_with("\x89PNG\r\n\x1A\n")) return orientation_in(exif_of_png(file));
  return 1;
}

const char* orientation_words(int orientation) {
  constexpr std::array<const char*, 8> kWords{"as stored",
                                              "mirrored left to right",
                                              "turned by 180 deg",
                                              "mirrored top to bottom",
                                              "mirrored and turned by 90 deg to the left",
                                              "turned by 90 deg to the right",
                                              "mirrored and turned by 90 deg to the right",
                                              "turned by 90 deg to the left"};
  return kWords[orientation >= 1 && orientation <= 8 ? static_cast<std::size_t>(orientation - 1) : 0];
}

}  // namespace hueline
