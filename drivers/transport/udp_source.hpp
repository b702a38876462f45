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

/// Datagrams of one device over IPv4 UDP, on one or several ports; the decoder tells them apart by their content.
/// `received` is the kernel's stamp of the datagram's arrival (SO_TIMESTAMPNS), converted to HostTime; packets of one
/// read are in the order of their stamps. The kernel begins to stamp a moment after the first socket of the computer
/// asks for it; datagrams before have the time at which they were read.
///
/// Fault packets: Overflow (the kernel's socket buffer or the pool was full; the kernel tells of a drop on the next
/// datagram that it delivers), WrongDevice (from another address than the rig's; one a second at most, counted, not
/// delivered), Malformed (longer than max_datagram_bytes: delivered cut off, after its fault). Thread-bound.
class UdpSource final : public PacketSource {
 public:
  struct Config {
    std::vector<std::uint16_t> ports;      ///< one or more
    std::string bind_address = "0.0.0.0";  ///< the interface's own address, or 0.0.0.0 for all
    std::string source_address;            ///< only from this device; empty: from anybody, and a second one is told
    std::string multicast_group;           ///< joined if not empty
    std::string multicast_interface;       ///< address of the interface to join on; empty: the kernel's choice
    /// Asked of the kernel for each port: 4 MiB hold 2 s of 750 datagrams of 1.2 kB a second. More than
    /// net.core.rmem_max needs CAP_NET_ADMIN; what was granted: receive_buffer_bytes().
    int receive_buffer_bytes = 4 << 20;
    std::size_t max_datagram_bytes = 2048;
    int batch = 64;  ///< datagrams taken by one system call

    void visit(Keys& keys);
    KeyError validate() const;
  };

  UdpSource(SensorId sensor, Config config, BufferPool pool);
  ~UdpSource() override;
  UdpSource(const UdpSource&) = delete;
  UdpSource& operator=(const UdpSource&) = delete;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// The port that each socket is bound to, in the order of Config::ports: differs only where 0 (any) was asked for.
  /// After open().
  std::vector<std::uint16_t> bound_ports() const;
  /// The smallest buffer that the kernel granted, in bytes of its own counting (overhead included). After open().
  int receive_buffer_bytes() const;

 private:
  struct Socket {
    int fd = -1;
    std::uint32_t kernel_drops = 0;  ///< running total of SO_RXQ_OVFL
  };
  struct Datagram;

  Status open_socket(std::uint16_t port);
  Status read(Socket& socket);
  void deliver(Socket& socket, Datagram& datagram, const ClockOffset& offset);
  template <class Detail>
  void note_stranger(HostTime received, Detail&& detail);
  void push_fault(HostTime time, FaultKind kind, std::uint64_t count, std::string detail);
  void push(Packet packet);

  SensorId sensor_;
  Config config_;
  BufferPool pool_;
  std::vector<Socket> sockets_;
  std::vector<Datagram> datagrams_;  ///< one a slot of the batch; buffers that were not used stay for the next read
  std::deque<Packet> pending_;
  Fault strangers_{.count = 0, .detail = {}};  // datagrams of other senders, of the reading under way
  std::optional<std::uint32_t> first_sender_;  // network byte order
  HostTime first_heard_{};                     // when it spoke last
  in_addr_t source_ = INADDR_ANY;
};

}  // namespace hueline::drivers
