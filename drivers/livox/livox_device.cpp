#include "drivers/livox/livox_device.hpp"

#include <memory>
#include <string>

#include "drivers/livox/livox_decoder.hpp"
#include "drivers/transport/datagram_device.hpp"

namespace hueline::drivers {
namespace {

/// Version, form and size of a packet have to agree, and the packets of the second generation contain their length.
class LivoxListener final : public CaptureListener {
 public:
  std::optional<HeardDevice> listen(const Packet& datagram, const std::string&) override {
    const auto packet = decode_livox(datagram.bytes.bytes());
    if (!packet || packet->form->returns == 0) return {};
    return HeardDevice{packet->form->generation == 1 ? "livox scanner (Mid-40, Mid-70, Tele-15, Horizon or Avia)"
                                                     : "livox scanner (Mid-360 or HAP)",
                       std::make_unique<LivoxDecoder>(LivoxDecoder::Config{}),
                       "decoded by the maker's description; no recording of such a scanner was there to check it"};
  }
  bool is_decodable(const Packet& datagram) const override { return decode_livox(datagram.bytes.bytes()).has_value(); }
};

}  // namespace

// A packet spans 0.1 to 1 ms. A HAP sends 4700 packets a second.
constinit const DeviceType kLivox{
    .word = "livox",
    .role = Role::Laser,
    .is_sheddable = true,
    .make = make_device<DatagramDevice<LivoxDecoder>>,
    .laser = {.latency_min = std::chrono::microseconds(100), .pending_limit = 16384},
    .files = {.capture = {.kind = "a Livox",
                          .has_signature = true,
                          .listen = [](const std::string&) -> std::unique_ptr<CaptureListener> {
                            return std::make_unique<LivoxListener>();
                          }}}};

}  // namespace hueline::drivers
