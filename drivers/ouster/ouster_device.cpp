#include "drivers/ouster/ouster_device.hpp"

#include <memory>
#include <string>

#include "drivers/ouster/ouster_asking.hpp"
#include "drivers/ouster/ouster_decoder.hpp"
#include "drivers/ouster/ouster_file.hpp"
#include "drivers/ouster/ouster_listener.hpp"
#include "drivers/transport/datagram_input.hpp"
#include "drivers/transport/described_source.hpp"

namespace hueline::drivers {
namespace {

class OusterDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    input_.visit(keys);
    keys.one_of({"metadata", "ask"});
    keys.text(
        {"metadata", "",
         "The file with the scanner's metadata: the JSON text that it gives at "
         "http://ADDRESS/api/v1/sensor/metadata. They hold the angles of its beams and the layout of its packets. "
         "The recording holds a copy, which a replay uses."},
        metadata_);
    keys.text(
        {"ask", "",
         "The scanner's own address. It is asked for its metadata, every 10 s in case that they change, and every "
         "second whether its clock is locked. The recording holds the answers. Not with `pcap`."},
        ask_, kIpv4Address);
    decoder_.visit(keys);
  }
  KeyError validate() const override {
    if (!ask_.empty() && input_.pcap) return not_allowed("ask", ask_, "with udp only; a capture needs metadata");
    return decoder_.validate();
  }
  Arrivals arrivals() const override { return input_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override {
    // A packet has up to 41 kB, which Ethernet frames carry in fragments.
    DatagramInput input = input_;
    if (input.udp) input.udp->max_datagram_bytes = 65536;
    if (!ask_.empty()) return std::make_unique<OusterAskingSource>(input.make(pool), OusterAskingSource::Config{ask_});
    return std::make_unique<DescribedSource>(input.make(pool), [path = metadata_] { return describe_ouster(path); });
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<OusterDecoder>(decoder_); }

 private:
  DatagramInput input_;
  std::string metadata_, ask_;
  OusterDecoder::Config decoder_;
};

}  // namespace

// A packet spans 16 columns: 0.8 ms (1024x20, 2048x10) to 3.1 ms (512x10). A scanner sends up to 1280 packets a second.
constinit const DeviceType kOuster{
    .word = "ouster",
    .role = Role::Laser,
    .is_sheddable = true,
    .make = make_device<OusterDevice>,
    .laser = {.latency_min = std::chrono::microseconds(700), .pending_limit = 16384},
    .files = {.capture = {.kind = "an Ouster", .has_signature = false, .listen = listen_for_ouster}}};

}  // namespace hueline::drivers
