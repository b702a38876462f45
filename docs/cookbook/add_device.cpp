// Makes a device of a rig from a range finder that hueline does not know: each line of its text is a range in metres.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "config/rig.hpp"
#include "drivers/transport/file_source.hpp"

using namespace hueline;

class FinderDecoder final : public Decoder {
 public:
  void decode(const Packet& packet, std::vector<Measurement>& out) override {
    LaserBatch batch{packet.sensor, packet.received, packet.sequence, {}, {}};
    for (const std::byte byte : packet.bytes.bytes()) {
      line_ += static_cast<char>(byte);
      if (byte != std::byte{'\n'}) continue;
      LaserReturn& one = batch.returns.emplace_back();
      one.y = one.range_m = std::strtof(line_.c_str(), nullptr);
      counts_.decoded_bytes += line_.size();
      line_.clear();
    }
    out.push_back(std::move(batch));
  }
  void reset() override { line_.clear(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  std::string line_;  // a line may begin in one packet and end in the next
  DecodeCounts counts_;
};
struct Finder final : drivers::Device {
  void visit(Keys& keys) override { keys.text(required("file", "", "What the range finder wrote."), file.path); }
  KeyError validate() const override { return {}; }
  drivers::Arrivals arrivals() const override { return drivers::Arrivals::Unknown; }
  std::unique_ptr<PacketSource> make_source(const BufferPool&) const override {
    return std::make_unique<drivers::FileSource>(file);
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<FinderDecoder>(); }
  drivers::FileSource::Config file;
};
const drivers::DeviceType kFinder{"finder", drivers::Role::Laser, true, drivers::make_device<Finder>};

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: add_device FILE\n"), 2;
  const drivers::DeviceType* types[] = {&kFinder};
  const std::string mount = "T_body_scanner: {position_m: [0, 0, 1], quaternion_wxyz: [1, 0, 0, 0]}";
  const std::string head = "rig: t\ncolouring: {method: lens}\nsensors:\n  - {name: f, driver: finder, file: ";
  const std::string text = head + argv[1] + ", " + mount + "}\n";
  const config::Rig rig = config::parse_rig(text, "rig.yaml", types);
  const auto source = rig.sensors[0].device->make_source(BufferPool(1 << 20));
  const auto decoder = rig.sensors[0].device->make_decoder();
  if (const Status opened = source->open(); !opened.ok()) return std::puts(opened.error().message.c_str()), 3;
  std::vector<Measurement> out;
  for (auto packet = source->next({}); packet.ok(); packet = source->next({})) decoder->decode(*packet, out);
  for (const Measurement& one : out)
    for (const LaserReturn& at : std::get<LaserBatch>(one).returns) std::printf("%.3f m\n", double{at.range_m});
}
