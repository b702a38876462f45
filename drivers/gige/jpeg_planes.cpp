#include "drivers/gige/jpeg_planes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kSizeAt = 0x08, kMagicAt = 0x10, kVersionAt = 0x14, kGainsAt = 0x28, kShuttersAt = 0x58,
                      kTableAt = 0x340;
// Beyond these a number is no shutter and no gain.
constexpr nanoseconds kLongestShutter{std::chrono::seconds(1)};
constexpr double kMostGain_dB = 100;
constexpr std::uint32_t kMagic = 0xCAFEBABE, kVersion = 2;
static_assert(kTableAt + kHeadLenses * kCellPlaces * 8 == kJpegPlanesHeaderSize);

std::uint32_t get_be32(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
  return value;
}

/// Returns the number in what a camera writes of a register.
std::uint32_t number_of_register(std::uint32_t value) {
  constexpr std::uint32_t kIsThere = 0x8000'0000, kNumber = 0xFFF;
  return (value & kIsThere) != 0 ? value & kNumber : value;
}

}  // namespace

void JpegPlanesLayout::visit(Keys& keys) {
  keys.whole({"lens_columns", "",
              "For `jpeg_planes`: the number of lens images in one row of the image (1, 2, 3 or 6). Lens 0 is in the "
              "upper left corner. `offset_px` of a lens says where its image lies."},
             lens_columns, {1, 6});
  keys.wholes({"plane_places", "",
               "For `jpeg_planes`: the places in the Bayer cell of the first to fourth plane, each place once. 0 is "
               "upper left, 1 upper right, 2 lower left, 3 lower right."},
              plane_places, {0, 3});
  keys.duration(
      {"shutter_step_us", "us",
       "For `jpeg_planes`: the time of one step of the shutters that the camera writes into its images. It is "
       "needed if the camera exposes automatically, because the middle of an exposure then changes with its "
       "shutter.",
       "0: not known, the shutters are not used"},
      shutter_step, {0, 1e5});
  keys.number({"gain_step_dB", "dB", "For `jpeg_planes`: one step of the gains that the camera writes into its images.",
               "0: not known, the gains are not used"},
              gain_step_dB, {-1, 1});
}

PixelRegion JpegPlanesLayout::region_of(std::size_t lens, std::uint32_t width, std::uint32_t height) const {
  const auto index = static_cast<std::uint32_t>(lens);
  const std::uint32_t lens_width = width / lens_columns, lens_height = height / lens_rows();
  return {index % lens_columns * lens_width, index / lens_columns * lens_height, lens_width, lens_height};
}

std::vector<ReportedExposure> JpegPlanesLayout::reported(const JpegPlanes& planes, std::uint32_t width,
                                                         std::uint32_t height) const {
  std::vector<ReportedExposure> out;
  if (shutter_step == nanoseconds(0) && gain_step_dB == 0) return out;
  for (std::size_t lens = 0; lens < kHeadLenses; ++lens) {
    ReportedExposure one{.region = region_of(lens, width, height)};
    const nanoseconds shutter = shutter_step * std::int64_t{number_of_register(planes.shutters[lens])};
    if (shutter <= kLongestShutter) one.duration = shutter;
    const double gain_dB = gain_step_dB * number_of_register(planes.gains[lens]);
    if (gain_step_dB != 0 && std::abs(gain_dB) <= kMostGain_dB)
      one.gain = static_cast<float>(portable::pow(10.0, gain_dB / 20));
    out.push_back(one);
  }
  return out;
}

void JpegPlanesLayout::use_only(const std::vector<PixelRegion>& regions, std::uint32_t width, std::uint32_t height) {
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    const PixelRegion own = region_of(i, width, height);
    is_used[i] = std::any_of(regions.begin(), regions.end(), [&](const PixelRegion& region) {
      return region.x < own.x + own.width && own.x < region.x + region.width && region.y < own.y + own.height &&
             own.y < region.y + region.height;
    });
  }
}

KeyError JpegPlanesLayout::validate(std::uint32_t width, std::uint32_t height) const {
  if (lens_columns == 0 || kHeadLenses % lens_columns != 0)
    return not_allowed("lens_columns", std::to_string(lens_columns), "1, 2, 3 or 6");
  unsigned places = 0;
  for (const std::uint8_t place : plane_places) places |= place < kCellPlaces ? 1u << place : 0u;
  if (places != 0xF)
    return not_allowed("plane_places", fmt::format("[{}]", fmt::join(plane_places, ", ")),
                       "the places 0, 1, 2 and 3 of the cell, each once");
  if (width == 0 || width % (2 * lens_columns) != 0)
    return not_allowed("width", std::to_string(width), fmt::format("{} lens images of an even width", lens_columns));
  if (height == 0 || height % (2 * lens_rows()) != 0)
    return not_allowed("height", std::to_string(height), fmt::format("{} lens images of an even height", lens_rows()));
  return {};
}

Result<JpegPlanes> read_jpeg_planes(std::span<const std::byte> bytes) {
  if (bytes.size() < kJpegPlanesHeaderSize)
    return Error{ErrorCode::Truncated,
                 fmt::format("JPEG planes of {} bytes; the head alone has {}", bytes.size(), kJpegPlanesHeaderSize)};
  if (const std::uint32_t magic = get_be32(bytes, kMagicAt); magic != kMagic)
    return Error{ErrorCode::Malformed, fmt::format("JPEG planes with 0x{:08x} where 0x{:08x} belongs", magic, kMagic)};
  if (const std::uint32_t version = get_be32(bytes, kVersionAt); version != kVersion)
    return Error{ErrorCode::Unsupported,
                 fmt::format("JPEG planes of version {}; version {} is read", version, kVersion)};
  JpegPlanes out;
  out.size = get_be32(bytes, kSizeAt);
  for (std::size_t lens = 0; lens < kHeadLenses; ++lens) {
    out.gains[lens] = get_be32(bytes, kGainsAt + 4 * lens);
    out.shutters[lens] = get_be32(bytes, kShuttersAt + 4 * lens);
  }
  for (std::size_t lens = 0; lens < kHeadLenses; ++lens)
    for (std::size_t slot = 0; slot < kCellPlaces; ++slot) {
      const std::size_t entry = kTableAt + 8 * (kCellPlaces * lens + slot);
      const std::size_t offset = get_be32(bytes, entry), size = get_be32(bytes, entry + 4);
      if (size == 0) {
        out.why_empty[lens][slot] = "is not there";
      } else if (offset < kJpegPlanesHeaderSize) {
        out.why_empty[lens][slot] = fmt::format("begins at byte {}, inside the head", offset);
      } else if (offset > bytes.size() || size > bytes.size() - offset) {
        out.why_empty[lens][slot] = fmt::format("ends at byte {}; {} came", offset + size, bytes.size());
      } else {
        out.planes[lens][slot] = bytes.subspan(offset, size);
      }
    }
  return out;
}

}  // namespace hueline::drivers
