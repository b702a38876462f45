#include "sim/devices/camera_image.hpp"

#include <fmt/format.h>

#include <cstddef>

#include "sim/wire/little_endian.hpp"

namespace hueline::sim {

Result<Buffer> cut_region(const CameraImage& image, const CameraRegion& region) {
  if (image.pixels.size() != std::size_t{image.width} * image.height) {
    return Error{ErrorCode::Invalid,
                 fmt::format("image {} does not hold {} x {} bytes", image.sequence, image.width, image.height)};
  }
  if (image.ignores_region) return image.pixels;
  if (region.width == image.width && region.height == image.height && region.offset_x == 0 && region.offset_y == 0) {
    return image.pixels;
  }
  if (region.width == 0 || region.height == 0 || region.width > image.width || region.height > image.height ||
      region.offset_x > image.width - region.width || region.offset_y > image.height - region.height) {
    return Error{ErrorCode::Invalid,
                 fmt::format("the client's region {} x {} at ({}, {}) is not inside the image of {} x {}", region.width,
                             region.height, region.offset_x, region.offset_y, image.width, image.height)};
  }
  Bytes cut;
  cut.reserve(std::size_t{region.width} * region.height);
  for (std::uint32_t row = 0; row < region.height; ++row) {
    const auto from =
        image.pixels.bytes().subspan(std::size_t{region.offset_y + row} * image.width + region.offset_x, region.width);
    cut.insert(cut.end(), from.begin(), from.end());
  }
  return Buffer::copy_of(cut);
}

}  // namespace hueline::sim
