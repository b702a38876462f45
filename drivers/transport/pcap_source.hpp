#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/packet.hpp"
#include "drivers/transport/capture_file.hpp"
#include "drivers/transport/udp_extractor.hpp"

namespace hueline::drivers {

/// The UDP datagrams of a pcap or pcapng file, as fast as they are asked for. `received` is the capture's stamp: the
/// clock of the computer that captured stands for HostTime, with its zero at 1970-01-01 UTC. Do not mix with live
/// sources in one drive.
///
/// Everything whole is delivered; then Truncated or Malformed with the offset, once, then EndOfData. Before that a
/// Fault Malformed counts frames that were cut off, broken or fragments that never became whole, and a Fault
/// WrongDevice says what the capture holds instead, if it holds no datagram of the device. Without a `source_address`
/// datagrams of several devices are delivered as they come, and a Fault WrongDevice counts those that are not the first
/// one's. Thread-bound.
class PcapSource final : public PacketSource {
 public:
  struct Config {
    std::string path;
    std::vector<std::uint16_t> ports;  ///< destination ports; empty: all
    std::string source_address;        ///< IPv4 or IPv6 of the device; empty: all

    void visit(Keys& keys);
    KeyError validate() const;
  };

  PcapSource(SensorId sensor, Config config) : sensor_(sensor), config_(std::move(config)) {}

  /// Begins at the file's first frame again.
  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { file_.reset(); }

  /// Who sent the datagram that next() gave last.
  const IpAddress& sender() const { return sender_; }
  const ExtractCounts& counts() const { return extractor_.counts(); }
  /// Datagrams to other ports or from other devices: passed over.
  std::uint64_t filtered() const { return filtered_; }

 private:
  bool is_wanted(const UdpDatagram& datagram) const;
  void watch_sender(const UdpDatagram& datagram);
  void tell(const Fault& fault);
  void finish(Error why);
  std::string others() const;

  SensorId sensor_;
  Config config_;
  std::optional<IpAddress> source_;
  std::optional<CaptureFile> file_;
  UdpExtractor extractor_;
  std::optional<Error> ended_;
  std::optional<IpAddress> first_sender_;
  IpAddress sender_{};
  HostTime first_heard_{};      // when the first sender spoke last
  std::deque<Packet> waiting_;  // faults, and the datagram behind them
  HostTime last_{};
  std::uint64_t filtered_ = 0, delivered_ = 0;
  std::map<std::uint16_t, std::uint64_t> other_ports_;  // of what was passed over, bounded
  std::map<IpAddress, std::uint64_t> other_sources_;
};

}  // namespace hueline::drivers
