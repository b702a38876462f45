#include "drivers/v4l2/v4l2_device.hpp"

#include "drivers/v4l2/v4l2_decoder.hpp"
#include "drivers/v4l2/v4l2_pixels.hpp"
#include "drivers/v4l2/v4l2_source.hpp"

namespace hueline::drivers {

std::unique_ptr<PacketSource> V4l2Device::make_source(const BufferPool&) const {
  return std::make_unique<V4l2Source>(config_);
}

std::unique_ptr<Decoder> V4l2Device::make_decoder() const {
  return std::make_unique<V4l2Decoder>(
      V4l2Decoder::Config{.width = config_.width, .height = config_.height, .fourcc = config_.fourcc});
}

PixelFormat V4l2Device::sent_format() const {
  const V4l2Format* format = find_v4l2_format(config_.fourcc);
  return format ? format->image : PixelFormat::Mono8;
}

PixelRows V4l2Device::pixel_rows(std::span<const std::byte> packet) const {
  const auto header = decode_v4l2_header(packet);
  if (!header.ok() || header->stride == 0) return {};
  const V4l2Format* format = find_v4l2_format(header->fourcc);
  if (!format || format->packing == V4l2Packing::Jpeg) return {};
  // Colour differences of NV12 stand in further rows.
  return {.offset = kV4l2HeaderSize,
          .stride = header->stride,
          .rows = header->used_bytes / header->stride,
          .sample_bytes = static_cast<std::uint8_t>(format->packing == V4l2Packing::Words ? 2 : 1),
          .colour_rows = rows_of_pattern(format->image)};
}

constinit const DeviceType kV4l2{"v4l2", Role::Camera, true, make_device<V4l2Device>};

}  // namespace hueline::drivers
