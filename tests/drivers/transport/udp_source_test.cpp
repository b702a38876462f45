#include "drivers/transport/udp_source.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace hueline::drivers {
namespace {

/// Sends from its own loopback address, as another device would.
class Sender {
 public:
  explicit Sender(const char* from = "127.0.0.1") : fd_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address = make(from, 0);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  ~Sender() { ::close(fd_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void send(std::uint16_t port, const std::string& text) const { send_to("127.0.0.1", port, text); }
  void send_to(const char* to, std::uint16_t port, const std::string& text) const {
    sockaddr_in address = make(to, port);
    ASSERT_EQ(::sendto(fd_, text.data(), text.size(), 0, reinterpret_cast<sockaddr*>(&address), sizeof(address)),
              static_cast<ssize_t>(text.size()));
  }
  void multicast_by(const char* interface) const {
    in_addr address{};
    ::inet_pton(AF_INET, interface, &address);
    ASSERT_EQ(::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &address, sizeof(address)), 0);
  }

 private:
  static sockaddr_in make(const char* ip, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    ::inet_pton(AF_INET, ip, &address.sin_addr);
    return address;
  }
  int fd_;
};

UdpSource::Config loopback(std::size_t ports = 1) {
  UdpSource::Config config;
  config.bind_address = "127.0.0.1";
  config.ports.assign(ports, 0);
  return config;
}

std::string text(const Packet& packet) {
  return {reinterpret_cast<const char*>(packet.bytes.data()), packet.bytes.size()};
}

struct Received {
  std::vector<Packet> wire;
  std::vector<Fault> faults;
  std::uint64_t count(FaultKind kind) const {
    std::uint64_t n = 0;
    for (const Fault& fault : faults)
      if (fault.kind == kind) n += fault.count;
    return n;
  }
};

/// Reads all packets, until the source returns TimedOut.
Received drain(UdpSource& source) {
  Received received;
  for (;;) {
    Result<Packet> packet = source.next({});
    if (!packet) {
      EXPECT_EQ(packet.error().code, ErrorCode::TimedOut) << packet.error().message;
      return received;
    }
    if (packet->kind == PacketKind::Wire) {
      received.wire.push_back(*packet);
    } else {
      Result<Fault> fault = decode_fault(packet->sensor, packet->received, packet->bytes.bytes());
      EXPECT_TRUE(fault.ok());
      received.faults.push_back(*fault);
    }
  }
}

TEST(UdpSource, DeliversDatagramsWholeWithTheirArrivalTime) {
  UdpSource source(loopback(), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender sender;
  drain(source);  // the kernel begins to stamp arrivals a moment after the first socket has asked for it
  const HostTime before = host_now();
  for (int i = 0; i < 100; ++i) sender.send(source.bound_ports()[0], std::string(1206, static_cast<char>(i)));
  const HostTime after = host_now();
  const Received received = drain(source);
  EXPECT_TRUE(received.faults.empty());
  ASSERT_EQ(received.wire.size(), 100u);
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(text(received.wire[i]), std::string(1206, static_cast<char>(i)));
    // `received` is the kernel's stamp, not the time of reading: the reader began after the last datagram was sent. 50
    // us allow for slewing of the clocks.
    EXPECT_GE(received.wire[i].received, before - std::chrono::microseconds(50));
    EXPECT_LE(received.wire[i].received, after + std::chrono::microseconds(50));
    if (i > 0) {
      EXPECT_GE(received.wire[i].received, received.wire[i - 1].received - std::chrono::microseconds(1));
    }
  }
}

TEST(UdpSource, TwoPortsAreOneSourceInOrderOfArrival) {
  UdpSource source(loopback(2), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender sender;
  const auto ports = source.bound_ports();
  drain(source);  // the kernel begins to stamp arrivals a moment after the first socket has asked for it
  for (int i = 0; i < 20; ++i) {
    sender.send(ports[1], "position " + std::to_string(i));
    sender.send(ports[0], "data " + std::to_string(i));
  }
  const Received received = drain(source);
  ASSERT_EQ(received.wire.size(), 40u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(text(received.wire[2 * i]), "position " + std::to_string(i));
    EXPECT_EQ(text(received.wire[2 * i + 1]), "data " + std::to_string(i));
  }
}

TEST(UdpSource, EveryDatagramThatTheKernelDroppedIsCounted) {
  UdpSource::Config config = loopback();
  config.receive_buffer_bytes = 4096;
  UdpSource source(config, BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender sender;
  const std::uint16_t port = source.bound_ports()[0];
  constexpr std::uint64_t kSent = 200;
  for (std::uint64_t i = 0; i < kSent; ++i) sender.send(port, std::string(1206, 'x'));
  Received received = drain(source);
  const std::uint64_t delivered = received.wire.size();
  EXPECT_LT(delivered, kSent);
  sender.send(port, "one more, which tells");
  received = drain(source);
  ASSERT_EQ(received.wire.size(), 1u);
  EXPECT_EQ(delivered + received.count(FaultKind::Overflow), kSent);
}

TEST(UdpSource, AFullPoolIsCountedAndRecoversWhenBuffersComeBack) {
  UdpSource::Config config = loopback();
  config.batch = 8;
  UdpSource source(config, BufferPool(16 * 2048));
  ASSERT_TRUE(source.open().ok());
  const Sender sender;
  const std::uint16_t port = source.bound_ports()[0];
  for (int i = 0; i < 40; ++i) sender.send(port, std::to_string(i));
  {
    const Received received = drain(source);
    EXPECT_EQ(received.wire.size(), 16u);
    EXPECT_EQ(received.count(FaultKind::Overflow), 24u);
  }
  sender.send(port, "again");
  const Received received = drain(source);
  ASSERT_EQ(received.wire.size(), 1u);
  EXPECT_EQ(text(received.wire[0]), "again");
}

TEST(UdpSource, AnotherDeviceIsNotDeliveredButCounted) {
  UdpSource::Config config = loopback();
  config.source_address = "127.0.0.3";
  UdpSource source(config, BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender right("127.0.0.3"), wrong("127.0.0.9");
  const std::uint16_t port = source.bound_ports()[0];
  for (int i = 0; i < 30; ++i) wrong.send(port, "not ours");
  right.send(port, "ours");
  Received received = drain(source);
  ASSERT_EQ(received.wire.size(), 1u);
  EXPECT_EQ(text(received.wire[0]), "ours");
  // One fault for the datagrams of one read.
  ASSERT_GE(received.faults.size(), 1u);
  EXPECT_LT(received.faults.size(), 30u);
  EXPECT_EQ(received.faults[0].kind, FaultKind::WrongDevice);
  EXPECT_NE(received.faults[0].detail.find("127.0.0.9"), std::string::npos) << received.faults[0].detail;
  EXPECT_EQ(received.count(FaultKind::WrongDevice), 30u);
}

/// Without a source_address both senders are delivered, and the second one is reported.
TEST(UdpSource, ASecondDeviceIsTold) {
  UdpSource source(loopback(), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender first("127.0.0.3"), second("127.0.0.9");
  const std::uint16_t port = source.bound_ports()[0];
  first.send(port, "a");
  EXPECT_TRUE(drain(source).faults.empty());
  second.send(port, "b");
  second.send(port, "b");
  const Received received = drain(source);
  EXPECT_EQ(received.wire.size(), 2u);
  ASSERT_EQ(received.count(FaultKind::WrongDevice), 2u);
  EXPECT_NE(received.faults[0].detail.find("127.0.0.3 and of 127.0.0.9"), std::string::npos)
      << received.faults[0].detail;
}

TEST(UdpSource, ADatagramTooLongIsFlaggedBeforeItsStump) {
  UdpSource::Config config = loopback();
  config.max_datagram_bytes = 100;
  UdpSource source(config, BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender sender;
  sender.send(source.bound_ports()[0], std::string(101, 'a'));
  sender.send(source.bound_ports()[0], std::string(100, 'b'));
  const Received received = drain(source);
  ASSERT_EQ(received.wire.size(), 2u);
  EXPECT_EQ(text(received.wire[0]), std::string(100, 'a'));
  EXPECT_EQ(text(received.wire[1]), std::string(100, 'b'));
  EXPECT_EQ(received.count(FaultKind::Malformed), 1u);
}

TEST(UdpSource, JoinsAMulticastGroup) {
  UdpSource::Config config = loopback();
  config.bind_address = "0.0.0.0";
  config.multicast_group = "239.255.77.1";
  config.multicast_interface = "127.0.0.1";
  UdpSource source(config, BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender sender;
  sender.multicast_by("127.0.0.1");
  sender.send_to("239.255.77.1", source.bound_ports()[0], "to all");
  const Received received = drain(source);
  ASSERT_EQ(received.wire.size(), 1u);
  EXPECT_EQ(text(received.wire[0]), "to all");
}

TEST(UdpSource, SaysWhatItCannotOpen) {
  UdpSource first(loopback(), BufferPool(1 << 20));
  ASSERT_TRUE(first.open().ok());
  UdpSource::Config config = loopback();
  config.ports = first.bound_ports();
  UdpSource second(config, BufferPool(1 << 20));
  const Status taken = second.open();
  ASSERT_FALSE(taken.ok());
  EXPECT_EQ(taken.error().code, ErrorCode::Unavailable);
  EXPECT_NE(taken.error().message.find("another program listens there"), std::string::npos) << taken.error().message;
  EXPECT_NE(taken.error().message.find(std::to_string(config.ports[0])), std::string::npos) << taken.error().message;

  config.bind_address = "127.0.0.256";
  const Status wrong = UdpSource(config, BufferPool(1 << 20)).open();
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::Invalid);
  EXPECT_NE(wrong.error().message.find("bind_address"), std::string::npos);
}

TEST(UdpSource, APortIsNamedOnce) {
  UdpSource::Config config = loopback();
  config.ports = {2368, 8308};
  EXPECT_TRUE(config.validate().empty());
  config.ports = {2368, 8308, 2368};
  EXPECT_EQ(config.validate(), "ports names 2368 twice; allowed: 1 to 65535, each once");
  config.ports = {0, 0};  // the kernel chooses two
  EXPECT_TRUE(config.validate().empty());
}

TEST(UdpSource, SilenceTimesOutAndAStopIsObeyed) {
  UdpSource source(loopback(), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const HostTime before = host_now();
  EXPECT_EQ(source.next({}).error().code, ErrorCode::TimedOut);
  EXPECT_GE(host_now() - before, std::chrono::milliseconds(90));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(source.next(stop.get_token()).error().code, ErrorCode::Stopped);
  source.close();
  EXPECT_EQ(source.next({}).error().code, ErrorCode::Disconnected);
  EXPECT_TRUE(source.open().ok());
}

}  // namespace
}  // namespace hueline::drivers
