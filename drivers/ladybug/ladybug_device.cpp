#include "drivers/ladybug/ladybug_device.hpp"

namespace hueline::drivers {

void LadybugDevice::visit(Keys& keys) {
  file_.visit(keys);
  decoder_.visit(keys);
  keys.duration({"exposure_us", "us", "The exposure. Half of it is added to the time of its start.", "0"}, exposure_,
                {0, 1'000'000});
}

std::unique_ptr<PacketSource> LadybugDevice::make_source(const BufferPool&) const {
  return std::make_unique<PgrSource>(file_);
}

std::unique_ptr<Decoder> LadybugDevice::make_decoder() const { return std::make_unique<LadybugDecoder>(decoder_); }

void LadybugDevice::use_only(const std::vector<PixelRegion>& regions) {
  decoder_.planes.use_only(regions, decoder_.width, decoder_.height);
}

constinit const DeviceType kLadybug{"ladybug", Role::Camera, true, make_device<LadybugDevice>};

}  // namespace hueline::drivers
