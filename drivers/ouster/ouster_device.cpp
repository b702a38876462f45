#include "drivers/ouster/ouster_device.hpp"

#include <string>

#include "drivers/ouster/ouster_decoder.hpp"
#include "drivers/ouster/ouster_file.hpp"
#include "drivers/ouster/ouster_listener.hpp"
#include "drivers/transport/datagram_input.hpp"

namespace hueline::drivers {
namespace {

class OusterDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    input_.visit(keys);
    keys.text(required("metadata", "",
                       "The file with the scanner's metadata: the JSON text that it gives at "
                       "http://ADDRESS/api/v1/sensor/metadata. They hold the angles of its beams and the layout of "
                       "its packets. The recording holds a copy, which a replay uses."),
              metadata_);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return input_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override {
    // A packet has up to 37 kB, which Ethernet frames carry in fragments.
    DatagramInput input = input_;
    if (input.udp) input.udp->max_datagram_bytes = 65536;
    return std::make_unique<OusterFileSource>(input.make(pool), metadata_);
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<OusterDecoder>(decoder_); }

 private:
  DatagramInput input_;
  std::string metadata_;
  OusterDecoder::Config decoder_;
};

}  // namespace

// A packet spans 16 columns: 0.4 ms (2048x20) to 3.1 ms (512x10). A scanner sends up to 2560 packets a second.
constinit const DeviceType kOuster{
    .word = "ouster",
    .role = Role::Laser,
    .is_sheddable = true,
    .make = make_device<OusterDevice>,
    .laser = {.latency_min = std::chrono::microseconds(400), .pending_limit = 16384},
    .files = {.capture = {.kind = "an Ouster", .has_signature = false, .listen = listen_for_ouster}}};

}  // namespace hueline::drivers
