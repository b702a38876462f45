#include "drivers/profile_scanner/profile_scanner_device.hpp"

#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/transport/datagram_input.hpp"

namespace hueline::drivers {
namespace {

class ProfileScannerDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    input_.visit(keys);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return input_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(SensorId sensor, const BufferPool& pool) const override { return input_.make(sensor, pool); }
  std::unique_ptr<Decoder> make_decoder(SensorId sensor) const override { return std::make_unique<ProfileScannerDecoder>(sensor, decoder_); }

 private:
  DatagramInput input_;
  ProfileScannerDecoder::Config decoder_;
};

}  // namespace

// A datagram spans 0.05 to 1 ms, by the scanner's rate and its size; a fast one sends 18000 a second.
constinit const DeviceType kProfileScanner{"profile_scanner", Role::Laser, true, make_device<ProfileScannerDevice>,
                                           {.latency_min = std::chrono::microseconds(500), .pending_limit = 65536}};

}  // namespace hueline::drivers
