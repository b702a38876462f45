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

constinit const DeviceType kV4l2{"v4l2", Role::Camera, true, make_device<V4l2Device>};

}  // namespace hueline::drivers
