#pragma once

#include <memory>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/gige/genicam_config.hpp"
#include "drivers/gige/image_decoder.hpp"

namespace hueline::drivers {

/// A GigE Vision or USB3 Vision camera of a rig.
class GenicamDevice final : public CameraDevice {
 public:
  void visit(Keys& keys) override;
  KeyError validate() const override;
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override;
  std::unique_ptr<Decoder> make_decoder() const override;

  nanoseconds exposure() const override { return camera_.exposure.value_or(nanoseconds(0)); }
  bool must_report() const override { return camera_.auto_exposure; }
  PixelFormat sent_format() const override { return source().pixel_format; }
  PixelRows pixel_rows(std::span<const std::byte> packet) const override;
  void use_only(const std::vector<PixelRegion>& regions) override;

  /// Returns the settings that are sent to the camera.
  GenicamConfig source() const;
  /// Returns the settings of the decoder.
  ImageDecoder::Config decoder() const;

 private:
  GenicamConfig camera_;  // all settings but the region and the pixel format, which source() adds
  std::uint32_t width_ = 0, height_ = 0;
  PixelFormat pixel_format_ = PixelFormat::BayerRG8;
  ImagePayload payload_ = ImagePayload::Rows;
  JpegPlanesLayout planes_;
};

/// The device type with `driver: genicam`.
extern const DeviceType kGenicam;

}  // namespace hueline::drivers
