#include "sim/devices/camera_image.hpp"

#include <fmt/format.h>

#include <cmath>
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

std::size_t CameraChunks::size() const {
  if (!is_active) return 0;
  return kTailBytes + (has_exposure ? kExposureBytes + kTailBytes : 0) + (has_gain ? kGainBytes + kTailBytes : 0);
}

Buffer with_chunks(const Buffer& pixels, const CameraImage& image, const CameraChunks& chunks) {
  if (!chunks.is_active) return pixels;
  Bytes out(pixels.bytes().begin(), pixels.bytes().end());
  const auto put = [&](std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      out.push_back(static_cast<std::byte>(value >> 8 * (chunks.is_big_endian ? size - 1 - i : i) & 0xffU));
  };
  const auto end = [&](std::uint32_t id, std::size_t size) {
    put(id, 4);
    put(size, 4);
  };
  end(CameraChunks::kImageId, pixels.size());
  if (chunks.has_exposure) {
    const std::int64_t exposure_ns = image.exposure_ns > 0 ? image.exposure_ns : chunks.exposure_ns;
    put(static_cast<std::uint64_t>(exposure_ns), CameraChunks::kExposureBytes);
    end(CameraChunks::kExposureId, CameraChunks::kExposureBytes);
  }
  if (chunks.has_gain) {
    const double dB = 20 * std::log10(image.gain > 0 ? static_cast<double>(image.gain) : 1.0);
    put(static_cast<std::uint64_t>(std::llround(100 * dB)), CameraChunks::kGainBytes);
    end(CameraChunks::kGainId, CameraChunks::kGainBytes);
  }
  return Buffer::copy_of(out);
}

}  // namespace hueline::sim
