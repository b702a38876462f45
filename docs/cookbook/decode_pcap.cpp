// Decodes a capture file of a Velodyne VLP-16, and prints the number of its returns and the range of the farthest.
#include <algorithm>
#include <cstdio>

#include "drivers/transport/pcap_source.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"

int main(int argc, char** argv) {
  using namespace hueline;
  if (argc != 2) return std::fprintf(stderr, "usage: decode_pcap FILE.pcap\n"), 2;
  drivers::PcapSource source({.path = argv[1], .ports = {}, .source_address = {}});
  if (const Status opened = source.open(); !opened.ok())
    return std::fprintf(stderr, "%s\n", opened.error().message.c_str()), 3;
  drivers::VelodyneDecoder decoder({});

  std::vector<Measurement> measurements;
  std::size_t returns = 0;
  float farthest_m = 0;
  for (;;) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      return std::fprintf(stderr, "%s\n", packet.error().message.c_str()), 3;
    }
    if (packet->kind != PacketKind::Wire) continue;  // the source reports a fault
    decoder.decode(*packet, measurements);
    for (const Measurement& measurement : measurements) {
      if (const auto* batch = std::get_if<LaserBatch>(&measurement)) {
        for (const LaserReturn& one : batch->returns) farthest_m = std::max(farthest_m, one.range_m);
        returns += batch->returns.size();
      } else if (const auto* fault = std::get_if<Fault>(&measurement)) {
        std::fprintf(stderr, "%s: %s\n", name(fault->kind), fault->detail.c_str());
      }
    }
    measurements.clear();
  }
  std::printf("%zu returns, the farthest at %.1f m\n", returns, static_cast<double>(farthest_m));
}
