#pragma once

#include <memory>
#include <optional>

#include "drivers/device.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "drivers/transport/udp_source.hpp"

namespace hueline::drivers {

/// Where a device that sends datagrams is read from: the network, or a capture file.
struct DatagramInput {
  std::optional<UdpSource::Config> udp;
  std::optional<PcapSource::Config> pcap;

  void visit(Keys& keys);
  Arrivals arrivals() const { return pcap ? Arrivals::Recorded : Arrivals::Live; }
  std::unique_ptr<PacketSource> make(SensorId sensor, const BufferPool& pool) const;
};

}  // namespace hueline::drivers
