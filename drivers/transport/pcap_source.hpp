#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/keys.hpp"
#include "core/packet.hpp"
#include "drivers/transport/capture_file.hpp"
#include "drivers/transport/udp_extractor.hpp"

namespace hueline::drivers {

/// Reads the UDP datagrams of a pcap or pcapng file as fast as they are asked for. `received` is the time stamp of the
/// capture, since 1970-01-01 UTC: the clock of the computer that captured takes the place of HostTime. So do not use
/// this source together with live sources in one drive.
///
/// All whole datagrams are delivered. Then next() returns Truncated or Malformed once, with the offset, if the file is
/// damaged, and EndOfData from then on. Fault packets:
/// - Malformed, before the end: the number of frames that were not delivered, because the capture cut them off, their
///   headers are broken, they are fragments of a datagram that never became whole, or their link type is not read.
/// - WrongDevice, before the end: the file holds no datagram of the device; the detail says what it holds instead.
/// - WrongDevice, without a `source_address`: a datagram comes from another address than the first one. It is delivered
///   after its fault.
///
/// Thread safety: none; one thread calls all functions.
class PcapSource final : public PacketSource {
 public:
  struct Config {
    std::string path;
    std::vector<std::uint16_t> ports;  ///< destination ports that are read; if empty, all ports
    std::string source_address;        ///< IPv4 or IPv6 address of the device; if empty, all addresses

    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit PcapSource(Config config) : config_(std::move(config)) {}

  /// Opens the file. When called again, it begins at the first frame of the file again.
  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { file_.reset(); }

  /// Returns the address that sent the latest datagram of the device.
  const IpAddress& sender() const { return sender_; }
  /// Returns the port to which the latest datagram was sent.
  std::uint16_t destination_port() const { return destination_port_; }
  /// Returns what became of the frames so far.
  const ExtractCounts& counts() const { return extractor_.counts(); }
  /// Returns the number of datagrams that were skipped because of their port or their source address.
  std::uint64_t filtered() const { return filtered_; }

 private:
  bool is_wanted(const UdpDatagram& datagram) const;
  void watch_sender(const UdpDatagram& datagram);
  void tell(FaultKind kind, std::uint64_t count, std::string detail);
  void finish(Error why);
  std::string others() const;

  Config config_;
  std::optional<IpAddress> source_;
  std::optional<CaptureFile> file_;
  UdpExtractor extractor_;
  std::optional<Error> ended_;
  std::optional<IpAddress> first_sender_;
  IpAddress sender_{};
  std::uint16_t destination_port_ = 0;
  HostTime first_heard_{};      // time of the first sender's latest datagram
  std::deque<Packet> waiting_;  // faults, and the datagram after them
  HostTime last_{};
  std::uint64_t filtered_ = 0, delivered_ = 0;
  std::map<std::uint16_t, std::uint64_t> other_ports_;  // skipped datagrams by port; bounded in number
  std::map<IpAddress, std::uint64_t> other_sources_;
};

}  // namespace hueline::drivers
