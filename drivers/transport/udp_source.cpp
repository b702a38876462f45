#include "drivers/transport/udp_source.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "drivers/transport/first_sender.hpp"
#include "drivers/transport/socket_option.hpp"

namespace hueline::drivers {
namespace {

constexpr int kDatagramWait_ms = 100;

std::optional<in_addr_t> parse_address(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1) return {};
  return address.s_addr;
}

std::string to_text(in_addr_t address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  const in_addr in{address};
  return ::inet_ntop(AF_INET, &in, text.data(), text.size()) ? text.data() : "?";
}

}  // namespace

/// One slot of a read: where recvmmsg() stores one datagram.
struct UdpSource::Datagram {
  MutableBuffer buffer;  ///< empty when the pool is full; the datagram is then read into one byte and counted
  std::byte nowhere{};
  sockaddr_in from{};
  alignas(cmsghdr) std::array<char, 128> control{};
  iovec vector{};
  std::uint32_t length = 0;  ///< on the wire, even if the datagram was cut off
  bool is_truncated = false;
  std::optional<nanoseconds> stamp;  ///< CLOCK_REALTIME
  std::optional<std::uint32_t> kernel_drops;
};

void UdpSource::Config::visit(Keys& keys) {
  keys.wholes(
      required("ports", "",
               "The UDP ports of the device. The decoder distinguishes by content what comes on several ports."),
      ports, {1, 65535}, {1});
  keys.text({"bind_address", "",
             "The computer's own address on the interface that the device is connected to. 0.0.0.0 listens on all "
             "interfaces."},
            bind_address, kIpv4Address);
  keys.text({"source_address", "",
             "The device's address. Datagrams from other addresses cause fault WrongDevice. Without it, datagrams from "
             "every address are used, and a second sender causes the same fault.",
             "any"},
            source_address, kIpv4Address);
  keys.text({"multicast_group", "", "The multicast group to join, within 224.0.0.0 to 239.255.255.255.", "none"},
            multicast_group, kIpv4Address);
  keys.text({"multicast_interface", "", "The computer's own address on the interface that joins the group.",
             "the kernel's choice"},
            multicast_interface, kIpv4Address);
  keys.whole(
      {"receive_buffer_bytes", "bytes",
       "The size of the kernel's receive buffer of each port. A size above net.core.rmem_max needs CAP_NET_ADMIN."},
      receive_buffer_bytes, {4096, 1 << 30});
}

KeyError UdpSource::Config::validate() const {
  Config in_files = *this;
  for (std::uint16_t& port : in_files.ports)
    port = std::max<std::uint16_t>(port, 1);  // a program may ask for port 0 (any free port), a rig file may not
  if (KeyError wrong = check_keys(in_files); !wrong.empty()) return wrong;
  for (std::size_t i = 0; i < ports.size(); ++i)
    if (ports[i] != 0 && std::count(ports.begin(), ports.begin() + static_cast<std::ptrdiff_t>(i), ports[i]) > 0)
      return {"ports", fmt::format("names {} twice; allowed: 1 to 65535, each once", ports[i])};
  if (bind_address.empty()) return not_allowed("bind_address", "empty", kIpv4Address.allowed);
  if (!multicast_group.empty() && !IN_MULTICAST(ntohl(*parse_address(multicast_group))))
    return not_allowed("multicast_group", multicast_group, "224.0.0.0 to 239.255.255.255");
  if (max_datagram_bytes < 64 || max_datagram_bytes > 65536)
    return not_allowed("max_datagram_bytes", std::to_string(max_datagram_bytes), "64 to 65536");
  if (batch < 1 || batch > 1024) return not_allowed("batch", std::to_string(batch), "1 to 1024");
  return {};
}

UdpSource::UdpSource(Config config, BufferPool pool) : config_(std::move(config)), pool_(std::move(pool)) {}

UdpSource::~UdpSource() { close(); }

void UdpSource::close() {
  for (const Socket& socket : sockets_)
    if (socket.fd >= 0) ::close(socket.fd);
  sockets_.clear();
}

Status UdpSource::open() {
  close();
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  source_ = config_.source_address.empty() ? INADDR_ANY : *parse_address(config_.source_address);
  first_sender_.reset();
  datagrams_.resize(static_cast<std::size_t>(config_.batch));
  for (const std::uint16_t port : config_.ports)
    if (Status opened = open_socket(port); !opened) {
      close();
      return opened;
    }
  return {};
}

Status UdpSource::open_socket(std::uint16_t port) {
  const std::string where = fmt::format("UDP {}:{}", config_.bind_address, port);
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return io_error("open a socket for " + where, errno);
  sockets_.push_back({fd, 0});

  const bool is_multicast = !config_.multicast_group.empty();
  // Several programs may share a multicast port. A unicast port that is in use shall give an error, instead of half of
  // the datagrams.
  if (is_multicast && !set_socket_option(fd, SOL_SOCKET, SO_REUSEADDR, 1)) return io_error("share " + where, errno);
  if (!set_socket_option(fd, SOL_SOCKET, SO_RCVBUFFORCE, config_.receive_buffer_bytes) &&
      !set_socket_option(fd, SOL_SOCKET, SO_RCVBUF, config_.receive_buffer_bytes))
    return io_error("set the receive buffer of " + where, errno);
  if (!set_socket_option(fd, SOL_SOCKET, SO_TIMESTAMPNS, 1))
    return io_error("ask for arrival stamps on " + where, errno);
  if (!set_socket_option(fd, SOL_SOCKET, SO_RXQ_OVFL, 1))
    return io_error("ask for the drop counter of " + where, errno);

  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = *parse_address(config_.bind_address);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int why = errno;
    Error error = io_error("bind " + where, why);
    // Asking again can help: the interface may come up later, or the other program may end.
    if (why == EADDRNOTAVAIL || why == EADDRINUSE) error.code = ErrorCode::Unavailable;
    if (why == EADDRINUSE) error.message += "; another program listens there, such as a capture";
    if (why == EADDRNOTAVAIL)
      error.message +=
          "; bind_address is this computer's own address in the sensor's network, which `ip address` shows";
    return error;
  }
  if (is_multicast) {
    ip_mreq group{};
    group.imr_multiaddr.s_addr = *parse_address(config_.multicast_group);
    group.imr_interface.s_addr =
        config_.multicast_interface.empty() ? INADDR_ANY : *parse_address(config_.multicast_interface);
    if (!set_socket_option(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, group)) {
      const int why = errno;
      Error error = io_error(fmt::format("join multicast group {}", config_.multicast_group), why);
      if (why == ENODEV || why == EADDRNOTAVAIL) error.code = ErrorCode::Unavailable;
      return error;
    }
  }
  return {};
}

std::vector<std::uint16_t> UdpSource::bound_ports() const {
  std::vector<std::uint16_t> ports;
  for (const Socket& socket : sockets_) {
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    ::getsockname(socket.fd, reinterpret_cast<sockaddr*>(&address), &size);
    ports.push_back(ntohs(address.sin_port));
  }
  return ports;
}

int UdpSource::receive_buffer_bytes() const {
  int smallest = sockets_.empty() ? 0 : 1 << 30;
  for (const Socket& socket : sockets_) {
    int granted = 0;
    socklen_t size = sizeof(granted);
    ::getsockopt(socket.fd, SOL_SOCKET, SO_RCVBUF, &granted, &size);
    smallest = std::min(smallest, granted);
  }
  return smallest;
}

Result<Packet> UdpSource::next(std::stop_token stop) {
  if (sockets_.empty()) return Error{ErrorCode::Disconnected, "UDP source is not open"};
  if (pending_.empty()) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    std::vector<pollfd> waiting;
    for (const Socket& socket : sockets_) waiting.push_back({socket.fd, POLLIN, 0});
    const int ready = ::poll(waiting.data(), waiting.size(), kDatagramWait_ms);
    if (ready < 0 && errno != EINTR) return io_error("wait for datagrams", errno);
    if (ready <= 0) return Error{ErrorCode::TimedOut, "no datagram"};
    for (std::size_t i = 0; i < sockets_.size(); ++i)
      if (waiting[i].revents != 0)
        if (Status status = read(sockets_[i]); !status) return status.error();
    // A fault has the stamp of the datagram that showed it, and the stable sort keeps it before that datagram.
    if (sockets_.size() > 1)
      std::stable_sort(pending_.begin(), pending_.end(),
                       [](const Packet& a, const Packet& b) { return a.received < b.received; });
    if (pending_.empty()) return Error{ErrorCode::TimedOut, "no datagram from the device"};
  }
  Packet packet = std::move(pending_.front());
  pending_.pop_front();
  return packet;
}

Status UdpSource::read(Socket& socket) {
  std::vector<mmsghdr> headers(datagrams_.size());
  for (std::size_t i = 0; i < datagrams_.size(); ++i) {
    Datagram& d = datagrams_[i];
    if (!d.buffer) d.buffer = pool_.acquire(config_.max_datagram_bytes);
    d.vector = d.buffer ? iovec{d.buffer.data(), config_.max_datagram_bytes} : iovec{&d.nowhere, 1};
    msghdr& header = headers[i].msg_hdr;
    header.msg_name = &d.from;
    header.msg_namelen = sizeof(d.from);
    header.msg_iov = &d.vector;
    header.msg_iovlen = 1;
    header.msg_control = d.control.data();
    header.msg_controllen = d.control.size();
  }
  // With MSG_TRUNC, msg_len is the length on the wire.
  const int taken =
      ::recvmmsg(socket.fd, headers.data(), static_cast<unsigned>(headers.size()), MSG_DONTWAIT | MSG_TRUNC, nullptr);
  if (taken < 0) {
    const int why = errno;
    if (why == EAGAIN || why == EWOULDBLOCK || why == EINTR) return {};
    Error error = io_error("receive datagrams", why);
    if (why == ENETDOWN || why == ENODEV) error.code = ErrorCode::Disconnected;
    return error;
  }
  const ClockOffset offset = sample_clock_offset(KernelClock::Realtime);
  for (int i = 0; i < taken; ++i) {
    Datagram& d = datagrams_[static_cast<std::size_t>(i)];
    mmsghdr& header = headers[static_cast<std::size_t>(i)];
    d.length = header.msg_len;
    d.is_truncated = (header.msg_hdr.msg_flags & MSG_TRUNC) != 0;
    d.stamp.reset();
    d.kernel_drops.reset();
    for (cmsghdr* c = CMSG_FIRSTHDR(&header.msg_hdr); c; c = CMSG_NXTHDR(&header.msg_hdr, c)) {
      if (c->cmsg_level != SOL_SOCKET) continue;
      if (c->cmsg_type == SCM_TIMESTAMPNS) {
        std::timespec t{};
        std::memcpy(&t, CMSG_DATA(c), sizeof(t));
        d.stamp = to_nanoseconds(t);
      } else if (c->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t drops = 0;
        std::memcpy(&drops, CMSG_DATA(c), sizeof(drops));
        d.kernel_drops = drops;
      }
    }
    deliver(socket, d, offset);
  }
  // One fault for all such datagrams of one read, so that a flood of them costs less than the device's own datagrams.
  if (strangers_.count > 0)
    push_fault(strangers_.time, strangers_.kind, std::exchange(strangers_.count, 0), std::move(strangers_.detail));
  return {};
}

template <class Detail>
void UdpSource::note_stranger(HostTime received, Detail&& detail) {
  if (strangers_.count++ == 0) strangers_ = {kSystemSensor, FaultKind::WrongDevice, received, 1, detail()};
}

void UdpSource::deliver(Socket& socket, Datagram& d, const ClockOffset& offset) {
  const HostTime received = d.stamp ? to_host_time(*d.stamp, offset) : host_now();
  if (d.kernel_drops && *d.kernel_drops != socket.kernel_drops) {
    const std::uint32_t lost = *d.kernel_drops - socket.kernel_drops;  // correct when the kernel's 32-bit counter wraps
    socket.kernel_drops = *d.kernel_drops;
    push_fault(received, FaultKind::Overflow, lost,
               "the socket's buffer was full before this datagram: raise receive_buffer_bytes or net.core.rmem_max");
  }
  if (source_ != INADDR_ANY && d.from.sin_addr.s_addr != source_) {
    return note_stranger(received, [&] {
      return fmt::format("datagram of {} bytes from {}:{}; the rig's device is {}", d.length,
                         to_text(d.from.sin_addr.s_addr), ntohs(d.from.sin_port), config_.source_address);
    });
  }
  // Scanners send to the same port unless they are set otherwise; two scanners taken for one would give one wrong
  // cloud.
  if (!first_sender_ || received - first_heard_ > kReplacedAfter) first_sender_ = d.from.sin_addr.s_addr;
  if (d.from.sin_addr.s_addr != *first_sender_) {
    note_stranger(received, [&] {
      return fmt::format("datagrams of {} and of {} are taken for one device's: name its source_address",
                         to_text(*first_sender_), to_text(d.from.sin_addr.s_addr));
    });
  } else {
    first_heard_ = received;
  }
  if (!d.buffer)
    return push_fault(
        received, FaultKind::Overflow, 1,
        fmt::format("a datagram of {} bytes came while the pool of {} bytes was full", d.length, pool_.limit_bytes()));
  if (d.is_truncated)
    push_fault(received, FaultKind::Malformed, 1,
               fmt::format("a datagram of {} bytes was cut off to {} (max_datagram_bytes)", d.length,
                           config_.max_datagram_bytes));
  d.buffer.resize(std::min<std::size_t>(d.length, config_.max_datagram_bytes));
  Packet packet;
  packet.kind = PacketKind::Wire;
  packet.received = received;
  packet.bytes = std::move(d.buffer).share();
  pending_.push_back(std::move(packet));
}

void UdpSource::push_fault(HostTime time, FaultKind kind, std::uint64_t count, std::string detail) {
  pending_.push_back(fault_packet(time, kind, count, std::move(detail)));
}

}  // namespace hueline::drivers
