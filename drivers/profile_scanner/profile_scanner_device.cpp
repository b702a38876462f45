#include "drivers/profile_scanner/profile_scanner_device.hpp"

#include <memory>
#include <string>

#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/profile_scanner/profile_scanner_wire.hpp"
#include "drivers/transport/datagram_device.hpp"

namespace hueline::drivers {
namespace {

/// The datagrams begin with a signature and say which scanner sent them.
class ProfileListener final : public CaptureListener {
 public:
  std::optional<HeardDevice> listen(const Packet& datagram, const std::string&) override {
    const auto header = decode_profile_header(datagram.bytes.bytes());
    if (!header.ok()) return {};
    return HeardDevice{"profile scanner " + std::to_string(header->scanner),
                       std::make_unique<ProfileScannerDecoder>(ProfileScannerDecoder::Config{})};
  }
  bool is_decodable(const Packet& datagram) const override { return is_profile_datagram(datagram.bytes.bytes()); }
};

}  // namespace

// A datagram spans 0.05 to 1 ms, depending on the scanner's rate and the datagram's size. A fast scanner sends 18000
// datagrams a second.
constinit const DeviceType kProfileScanner{
    .word = "profile_scanner",
    .role = Role::Laser,
    .is_sheddable = true,
    .make = make_device<DatagramDevice<ProfileScannerDecoder>>,
    .laser = {.latency_min = std::chrono::microseconds(500), .pending_limit = 65536},
    .files = {.capture = {.kind = "a profile scanner",
                          .has_signature = true,
                          .listen = [](const std::string&) -> std::unique_ptr<CaptureListener> {
                            return std::make_unique<ProfileListener>();
                          }}}};

}  // namespace hueline::drivers
