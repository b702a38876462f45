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
#include "drivers/transport/ip_extractor.hpp"
#include "drivers/transport/tcp_streams.hpp"

namespace hueline::drivers {

/// Reads the UDP datagrams or the TCP streams of a pcap or pcapng file as fast as they are asked for. `received` is the
/// time stamp of the capture, since 1970-01-01 UTC: the clock of the computer that captured takes the place of
/// HostTime. So do not use this source together with live sources in one drive.
///
/// All whole datagrams are delivered. Then next() returns Truncated or Malformed once, with the offset, if the file is
/// damaged, and EndOfData from then on. Fault packets:
/// - Malformed, before the end: the number of frames that were not delivered, because the capture cut them off, their
///   headers are broken, they are fragments of a datagram that never became whole, or their link type is not read.
/// - WrongDevice, before the end: the file holds no datagram of the device; the detail says what it holds instead.
/// - WrongDevice, with Protocol::Udp: a datagram comes from another network card than the first one or, without a
///   `source_address`, from another address. It is delivered after its fault.
///
/// With Protocol::Tcp the source delivers what one device sends by TCP, in pieces of any size. Of each connection that
/// is the side that `ports` and `source_address` name, and without them the side with the lower port: devices are
/// servers. Fault packets:
/// - Disconnected and Reconnected, before the piece after a gap: bytes are missing in the capture, or the device has a
///   new connection. Decoders begin anew there.
/// - WrongDevice: another connection sends at the same time. Its bytes are left out; those of two streams mixed would
/// be
///   neither.
///
/// Thread safety: none; one thread calls all functions.
class PcapSource final : public PacketSource {
 public:
  enum class Protocol : std::uint8_t {
    Udp,
    Tcp,  ///< one device's stream
    All,  ///< all datagrams and all streams, for programs that recognise devices themselves; flow() tells them apart
  };
  struct Config {
    std::string path;
    /// Ports that are read: the destination of datagrams, the sender's port of streams. If empty, all ports.
    std::vector<std::uint16_t> ports;
    std::string source_address;         ///< IPv4 or IPv6 address of the device; if empty, all addresses
    Protocol protocol = Protocol::Udp;  ///< not a key; see StreamInput

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
  /// Returns the network card that sent the latest datagram. Scanners as they come from the maker have the same
  /// address.
  const HardwareAddress& sender_card() const { return sender_card_; }
  /// Returns the port to which the latest datagram was sent.
  std::uint16_t destination_port() const { return destination_port_; }
  /// Returns the stream that the latest packet, or fault before a packet, is of. Nothing: it is of a datagram.
  const std::optional<TcpFlow>& flow() const { return flow_; }
  /// Returns what became of the frames so far.
  const ExtractCounts& counts() const { return extractor_.counts(); }
  /// Returns the number of datagrams that were skipped because of their port or their source address.
  std::uint64_t filtered() const { return filtered_; }

 private:
  bool is_wanted(const IpAddress& source, std::uint16_t port) const;
  void skip(const IpAddress& source, std::uint16_t port);
  void take(const UdpDatagram& datagram);
  void take(TcpPiece piece);
  bool is_of_device(const TcpPiece& piece);
  void watch_sender();
  void tell(FaultKind kind, std::uint64_t count, std::string detail);
  void finish(Error why);
  std::string others() const;

  Config config_;
  std::optional<IpAddress> source_;
  std::optional<CaptureFile> file_;
  IpExtractor extractor_;
  TcpStreams streams_;
  std::optional<Error> read_;   // why no more frames follow, until all is delivered
  std::optional<Error> ended_;  // what next() returns when nothing waits
  std::optional<IpAddress> first_sender_;
  std::optional<TcpFlow> flow_;
  std::optional<TcpFlow> device_flow_;  // the stream that is delivered, with Protocol::Tcp
  std::optional<TcpFlow> told_flow_;    // another one that was told last
  HostTime piece_heard_{};              // time of the latest piece of device_flow_
  IpAddress sender_{};
  HardwareAddress sender_card_{}, first_card_{};  // first_card_: of first_sender_
  std::uint16_t destination_port_ = 0;
  HostTime first_heard_{};      // time of the first sender's latest datagram
  std::deque<Packet> waiting_;  // faults, and the datagram after them
  HostTime last_{};
  std::uint64_t filtered_ = 0, delivered_ = 0;
  std::map<std::uint16_t, std::uint64_t> other_ports_;  // what was skipped, by port; bounded in number
  std::map<IpAddress, std::uint64_t> other_sources_;
};

}  // namespace hueline::drivers
