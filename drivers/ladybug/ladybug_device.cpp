#include "drivers/ladybug/ladybug_device.hpp"

#include <utility>

#include "drivers/guest/guest_source.hpp"

namespace hueline::drivers {

void LadybugDevice::visit(Keys& keys) {
  keys.one_of({"file", "usb"});
  file_.visit(keys);
  keys.section({"usb", "", "The camera itself, on USB. `{}` leaves all settings to the camera."}, usb_);
  decoder_.visit(keys);
  keys.duration({"exposure_us", "us",
                 "The exposure. Half of it is added to the time of its start, if the images do not say how long they "
                 "were exposed (`shutter_step_us`). With `usb` it is set in the camera, whose automatic exposure is "
                 "turned off; 0 leaves that to the camera.",
                 "0"},
                exposure_, {0, 1'000'000});
}

KeyError LadybugDevice::validate() const {
  if (usb_)
    if (KeyError wrong = settings().validate(); !wrong.empty()) return wrong;
  return decoder_.validate();
}

LadybugSettings LadybugDevice::settings() const {
  LadybugSettings out = *usb_;
  out.exposure = exposure_;
  return out;
}

std::unique_ptr<PacketSource> LadybugDevice::make_source(const BufferPool&) const {
  if (!usb_) return std::make_unique<PgrSource>(file_);
  // libusb runs in a process of its own (hueline-guest), which may be ended if a call does not return.
  GuestSource::Config guest;
  guest.driver = kLadybug.word;
  guest.text = settings().to_text();
  guest.slots = usb_->images_in_flight;
  return std::make_unique<GuestSource>(std::move(guest));
}

std::unique_ptr<Decoder> LadybugDevice::make_decoder() const { return std::make_unique<LadybugDecoder>(decoder_); }

void LadybugDevice::use_only(const std::vector<PixelRegion>& regions) {
  decoder_.planes.use_only(regions, decoder_.width, decoder_.height);
}

constinit const DeviceType kLadybug{"ladybug", Role::Camera, true, make_device<LadybugDevice>};

}  // namespace hueline::drivers
