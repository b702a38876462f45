#pragma once

#include <memory>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/ladybug/ladybug_decoder.hpp"
#include "drivers/ladybug/pgr_source.hpp"

namespace hueline::drivers {

/// A Ladybug of a rig, whose images are read from its stream files.
class LadybugDevice final : public CameraDevice {
 public:
  void visit(Keys& keys) override;
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return Arrivals::Unknown; }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override;
  std::unique_ptr<Decoder> make_decoder() const override;

  nanoseconds exposure() const override { return exposure_; }
  PixelFormat sent_format() const override { return PixelFormat::Mono8; }
  void use_only(const std::vector<PixelRegion>& regions) override;

 private:
  PgrSource::Config file_;
  LadybugDecoder::Config decoder_;
  nanoseconds exposure_{0};
};

/// The device type with `driver: ladybug`.
extern const DeviceType kLadybug;

}  // namespace hueline::drivers
