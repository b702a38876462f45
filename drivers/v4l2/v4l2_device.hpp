#pragma once

#include <memory>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/v4l2/v4l2_config.hpp"

namespace hueline::drivers {

/// A V4L2 camera of a rig.
class V4l2Device final : public CameraDevice {
 public:
  void visit(Keys& keys) override { config_.visit(keys); }
  KeyError validate() const override { return config_.validate(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override;
  std::unique_ptr<Decoder> make_decoder() const override;

  nanoseconds exposure() const override { return config_.exposure.value_or(nanoseconds(0)); }
  PixelFormat sent_format() const override;
  PixelRows pixel_rows(std::span<const std::byte> packet) const override;
  void use_only(const std::vector<PixelRegion>&) override {}

 private:
  V4l2Config config_;
};

/// The device type with `driver: v4l2`.
extern const DeviceType kV4l2;

}  // namespace hueline::drivers
