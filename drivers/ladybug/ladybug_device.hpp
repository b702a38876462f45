#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/ladybug/ladybug_decoder.hpp"
#include "drivers/ladybug/ladybug_settings.hpp"
#include "drivers/ladybug/pgr_source.hpp"

namespace hueline::drivers {

/// A Ladybug of a rig, whose images come over USB or are read from its stream files.
class LadybugDevice final : public CameraDevice {
 public:
  void visit(Keys& keys) override;
  KeyError validate() const override;
  Arrivals arrivals() const override { return usb_ ? Arrivals::Live : Arrivals::Unknown; }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override;
  std::unique_ptr<Decoder> make_decoder() const override;

  nanoseconds exposure() const override { return exposure_; }
  bool must_report() const override {
    return exposure_ == nanoseconds(0) && decoder_.planes.shutter_step > nanoseconds(0);
  }
  PixelFormat sent_format() const override { return PixelFormat::Mono8; }
  void use_only(const std::vector<PixelRegion>& regions) override;

 private:
  LadybugSettings settings() const;

  PgrSource::Config file_;
  std::optional<LadybugSettings> usb_;  // without the exposure, which settings() adds
  LadybugDecoder::Config decoder_;
  nanoseconds exposure_{0};
};

/// The device type with `driver: ladybug`.
extern const DeviceType kLadybug;

}  // namespace hueline::drivers
