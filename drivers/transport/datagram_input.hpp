#pragma once

#include <memory>
#include <optional>

#include "drivers/device.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "drivers/transport/udp_source.hpp"

namespace hueline::drivers {

/// The origin of a device's datagrams: the network or a capture file. Exactly one of the two members is set.
struct DatagramInput {
  std::optional<UdpSource::Config> udp;
  std::optional<PcapSource::Config> pcap;

  /// Declares the keys `udp` and `pcap`, of which a rig file gives exactly one.
  void visit(Keys& keys);
  Arrivals arrivals() const { return pcap ? Arrivals::Recorded : Arrivals::Live; }
  /// Makes the source that is set, not opened yet.
  std::unique_ptr<PacketSource> make(const BufferPool& pool) const;
};

}  // namespace hueline::drivers
