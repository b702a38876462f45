#pragma once

#include <memory>
#include <optional>
#include <string>

#include "drivers/device.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "drivers/transport/serial_source.hpp"
#include "drivers/transport/tcp_source.hpp"
#include "drivers/transport/udp_source.hpp"

namespace hueline::drivers {

/// A capture file of a device that sends by UDP or by TCP.
struct EitherCapture : PcapSource::Config {
  void visit(Keys& keys);
};

/// The origin of the bytes of a device that sends messages in a stream: a connection or a file of the maker. Exactly
/// one of its members is set.
struct StreamInput {
  bool has_datagrams = false;  ///< the device also sends its messages in datagrams: the key `udp` exists
  bool has_can = false;        ///< the device also sends them on a CAN bus: the caller declares the keys of a CanInput
  std::optional<TcpSource::Config> tcp;
  std::optional<SerialSource::Config> serial;
  std::optional<UdpSource::Config> udp;
  std::optional<EitherCapture> pcap;           ///< key `pcap`, if has_datagrams
  std::optional<PcapSource::Config> tcp_pcap;  ///< key `pcap`, if not
  std::string file;

  /// Declares the keys, of which, with those of a CanInput, a rig file gives exactly one. `log` says what the maker's
  /// files are.
  void visit(Keys& keys, std::string_view log);
  Arrivals arrivals() const {
    return !file.empty() ? Arrivals::Unknown : pcap || tcp_pcap ? Arrivals::Recorded : Arrivals::Live;
  }
  /// Makes the source that is set, not opened yet. `dialogue` is sent after each connection by TCP or a serial port.
  std::unique_ptr<PacketSource> make(const BufferPool& pool, const std::string& dialogue) const;
};

}  // namespace hueline::drivers
