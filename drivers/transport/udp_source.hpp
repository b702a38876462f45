#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/buffer.hpp"
#include "core/fault.hpp"
#include "core/keys.hpp"
#include "core/packet.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

/// Receives the datagrams of one device over IPv4 UDP, on one or several ports. The decoder tells apart by content what
/// came on which port.
///
/// `received` is the kernel's time stamp of the datagram's arrival (SO_TIMESTAMPNS), converted to HostTime. Packets of
/// one read are sorted by it. The kernel begins to stamp shortly after the first socket of the computer asks for
/// stamps; until then `received` is the time of the read.
///
/// Fault packets:
/// - Overflow: the kernel's socket buffer or the pool was full. The kernel reports a drop with the next datagram that
///   it delivers.
/// - WrongDevice: datagrams from another address than `source_address`, which are not delivered. Without a
///   `source_address`: datagrams from another address than the first one, which are delivered. There is one fault for
///   each read of a socket, with their number.
/// - Malformed: a datagram is longer than `max_datagram_bytes`. It is delivered after its fault, cut off.
///
/// Thread safety: none; one thread calls all functions.
class UdpSource final : public PacketSource {
 public:
  struct Config {
    std::vector<std::uint16_t> ports;      ///< one or more; 0 lets the kernel choose
    std::string bind_address = "0.0.0.0";  ///< address of the interface, or 0.0.0.0 for all interfaces
    std::string source_address;            ///< address of the device; if empty, any, and a second sender is reported
    std::string multicast_group;           ///< multicast group that is joined; if empty, none
    /// Address of the interface on which the group is joined; if empty, the kernel chooses.
    std::string multicast_interface;
    /// Size of the receive buffer that is requested from the kernel for each port. 4 MiB hold 2 s of 750 datagrams
    /// of 1.2 kB a second. More than net.core.rmem_max requires CAP_NET_ADMIN; receive_buffer_bytes() returns what was
    /// granted.
    int receive_buffer_bytes = 4 << 20;
    std::size_t max_datagram_bytes = 2048;
    int batch = 64;  ///< largest number of datagrams that one system call takes

    void visit(Keys& keys);
    KeyError validate() const;
  };

  UdpSource(Config config, BufferPool pool);
  ~UdpSource() override;
  UdpSource(const UdpSource&) = delete;
  UdpSource& operator=(const UdpSource&) = delete;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// Returns the port that each socket is bound to, in the order of Config::ports. It differs from Config::ports only
  /// for port 0. Call it after open().
  std::vector<std::uint16_t> bound_ports() const;
  /// Returns the smallest buffer that the kernel granted, in bytes as the kernel counts them (with its overhead). Call
  /// it after open().
  int receive_buffer_bytes() const;

 private:
  struct Socket {
    int fd = -1;
    std::uint32_t kernel_drops = 0;  ///< last value of the socket's drop counter (SO_RXQ_OVFL)
  };
  struct Datagram;

  Status open_socket(std::uint16_t port);
  Status read(Socket& socket);
  void deliver(Socket& socket, Datagram& datagram, const ClockOffset& offset);
  template <class Detail>
  void note_stranger(HostTime received, Detail&& detail);
  void push_fault(HostTime time, FaultKind kind, std::uint64_t count, std::string detail);

  Config config_;
  BufferPool pool_;
  std::vector<Socket> sockets_;
  /// One for each slot of a read; a buffer that was not used stays for the next read.
  std::vector<Datagram> datagrams_;
  std::deque<Packet> pending_;
  Fault strangers_{.count = 0, .detail = {}};  // datagrams from other senders, in the current read
  std::optional<std::uint32_t> first_sender_;  // network byte order
  HostTime first_heard_{};                     // time of the first sender's latest datagram
  in_addr_t source_ = INADDR_ANY;
};

}  // namespace hueline::drivers
