#include "drivers/transport/datagram_input.hpp"

namespace hueline::drivers {

void DatagramInput::visit(Keys& keys) {
  keys.one_of({"udp", "pcap"});
  keys.section({"udp", "", "The device on the network."}, udp);
  keys.section({"pcap", "", "A capture file instead of the device."}, pcap);
}

std::unique_ptr<PacketSource> DatagramInput::make(const BufferPool& pool) const {
  if (pcap) return std::make_unique<PcapSource>(*pcap);
  return std::make_unique<UdpSource>(udp.value(), pool);
}

}  // namespace hueline::drivers
