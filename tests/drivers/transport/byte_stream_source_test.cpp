// TCP with a server in the test, the serial line on a pseudo-terminal, and files.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "drivers/transport/file_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "drivers/transport/serial_source.hpp"
#include "drivers/transport/tcp_source.hpp"

namespace hueline::drivers {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

/// A receiver's port in the test's own thread. Connections wait in the backlog.
class Server {
 public:
  explicit Server(int port = 0) : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const int on = 1;
    ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::listen(listener_.get(), 4), 0);
    socklen_t size = sizeof(address);
    ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
  }
  Descriptor accept() { return Descriptor(::accept(listener_.get(), nullptr, nullptr)); }
  int port() const { return port_; }

 private:
  Descriptor listener_;
  int port_ = 0;
};

void send_text(const Descriptor& to, std::string_view text) {
  ASSERT_EQ(::write(to.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
}
std::string receive_text(const Descriptor& from, std::size_t size) {
  std::string text(size, '\0');
  std::size_t at = 0;
  while (at < size) {
    pollfd ready{from.get(), POLLIN, 0};
    if (::poll(&ready, 1, 2000) <= 0) break;
    const ssize_t n = ::read(from.get(), text.data() + at, size - at);
    if (n <= 0) break;
    at += static_cast<std::size_t>(n);
  }
  text.resize(at);
  return text;
}
std::string text_of(const Packet& packet) {
  return {reinterpret_cast<const char*>(packet.bytes.data()), packet.bytes.size()};
}
/// Reads packets until they have `size` bytes.
std::string gather(PacketSource& source, std::size_t size) {
  std::string all;
  for (int tries = 0; all.size() < size && tries < 50; ++tries) {
    auto packet = source.next({});
    if (packet.ok())
      all += text_of(*packet);
    else if (packet.error().code != ErrorCode::TimedOut)
      break;
  }
  return all;
}
ErrorCode error_of(PacketSource& source) {
  auto packet = source.next({});
  return packet.ok() ? ErrorCode::EndOfData : packet.error().code;
}

TcpSource::Config tcp(int port, std::string dialogue = {}) {
  TcpSource::Config config;
  config.host = "127.0.0.1";
  config.port = port;
  config.connect_timeout = std::chrono::milliseconds(500);
  config.stream.dialogue = std::move(dialogue);
  return config;
}

TEST(TcpSource, SendsTheDialogueAndStampsWhatComes) {
  Server server;
  TcpSource source(tcp(server.port(), "UNLOGALL\r\nLOG TIMEB ONTIME 1\r\n"));
  ASSERT_TRUE(source.open().ok());
  Descriptor peer = server.accept();
  EXPECT_EQ(receive_text(peer, 30), "UNLOGALL\r\nLOG TIMEB ONTIME 1\r\n");
  const HostTime before = host_now();
  send_text(peer, "<OK");
  auto packet = source.next({});
  ASSERT_TRUE(packet.ok()) << packet.error().message;
  EXPECT_EQ(text_of(*packet), "<OK");
  EXPECT_EQ(packet->kind, PacketKind::Wire);
  EXPECT_GE(packet->received, before);
  EXPECT_LE(packet->received, host_now());
}

TEST(TcpSource, NobodyThere) {
  int port = 0;
  {
    Server gone;
    port = gone.port();
  }
  TcpSource source(tcp(port));
  const Status opened = source.open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Unavailable);
  EXPECT_NE(opened.error().message.find(std::to_string(port)), std::string::npos);
  EXPECT_EQ(error_of(source), ErrorCode::Disconnected);
}

TEST(TcpSource, SilenceIsTimedOutAndSoonEnough) {
  Server server;
  TcpSource source(tcp(server.port()));
  ASSERT_TRUE(source.open().ok());
  const HostTime before = host_now();
  EXPECT_EQ(error_of(source), ErrorCode::TimedOut);
  EXPECT_LT(host_now() - before, std::chrono::seconds(1));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(source.next(stop.get_token()).error().code, ErrorCode::Stopped);
}

TEST(TcpSource, ClosedPeerIsDisconnectedAfterItsLastBytesAndCanComeBack) {
  Server server;
  TcpSource source(tcp(server.port(), "HELLO"));
  ASSERT_TRUE(source.open().ok());
  {
    Descriptor peer = server.accept();
    EXPECT_EQ(receive_text(peer, 5), "HELLO");
    send_text(peer, "last words");
  }
  EXPECT_EQ(gather(source, 10), "last words");
  EXPECT_EQ(error_of(source), ErrorCode::Disconnected);
  ASSERT_TRUE(source.open().ok());
  Descriptor again = server.accept();
  EXPECT_EQ(receive_text(again, 5), "HELLO");
  send_text(again, "back");
  EXPECT_EQ(gather(source, 4), "back");
}

TEST(TcpSource, ResetByPeerIsDisconnected) {
  Server server;
  TcpSource source(tcp(server.port()));
  ASSERT_TRUE(source.open().ok());
  Descriptor peer = server.accept();
  const linger abort{1, 0};
  ::setsockopt(peer.get(), SOL_SOCKET, SO_LINGER, &abort, sizeof(abort));
  peer.close();
  EXPECT_EQ(error_of(source), ErrorCode::Disconnected);
}

TEST(TcpSource, BytesOfAnyKindComeWholeInChunks) {
  Server server;
  auto config = tcp(server.port());
  config.stream.chunk_bytes = 1000;
  TcpSource source(config);
  ASSERT_TRUE(source.open().ok());
  Descriptor peer = server.accept();
  std::string garbage(30000, '\0');
  for (std::size_t i = 0; i < garbage.size(); ++i) garbage[i] = static_cast<char>(i * 31 + i / 256);
  send_text(peer, garbage);
  std::string all;
  while (all.size() < garbage.size()) {
    auto packet = source.next({});
    ASSERT_TRUE(packet.ok()) << packet.error().message;
    EXPECT_LE(packet->bytes.size(), 1000u);
    all += text_of(*packet);
  }
  EXPECT_EQ(all, garbage);
}

TEST(TcpSource, PeerThatDoesNotReadTheDialogueDoesNotBlockForever) {
  Server server;
  auto config = tcp(server.port(), std::string(8 << 20, 'x'));  // more than the kernel buffers
  config.stream.write_timeout = std::chrono::milliseconds(200);
  TcpSource source(config);
  const Status opened = source.open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Unavailable);
}

TEST(TcpSource, ConfigNamesTheWrongKey) {
  auto config = tcp(0);
  EXPECT_NE(config.validate().text().find("port"), std::string::npos);
  EXPECT_EQ(TcpSource(config).open().error().code, ErrorCode::Invalid);
  config = tcp(1);
  config.stream.chunk_bytes = 1;
  EXPECT_NE(config.validate().text().find("chunk_bytes"), std::string::npos);
}

/// The device's end of a pseudo-terminal.
struct Pty {
  Descriptor master{::posix_openpt(O_RDWR | O_NOCTTY)};
  std::string device;
  Pty() {
    EXPECT_EQ(::grantpt(master.get()), 0);
    EXPECT_EQ(::unlockpt(master.get()), 0);
    char path[128] = {};
    EXPECT_EQ(::ptsname_r(master.get(), path, sizeof(path)), 0);
    device = path;
  }
};

TEST(TcpSource, AHostIsAnAddressOrAName) {
  for (const char* host : {"192.168.1.2", "::1", "fe80::1%eth0", "localhost", "pos-lv", "novatel_7.local",
                           "receiver.example.org.", "3com", "a"}) {
    TcpSource::Config config = tcp(3001);
    config.host = host;
    EXPECT_TRUE(config.validate().empty()) << host << ": " << config.validate().text();
  }
  for (const std::string& host : {std::string("not a host"), std::string("192.168.1.300"), std::string("192.168.1"),
                                  std::string("10"), std::string("192.168.1.2:3001"), std::string("http://pos"),
                                  std::string("a..b"), std::string("-a"), std::string("."), std::string(64, 'a')}) {
    TcpSource::Config config = tcp(3001);
    config.host = host;
    EXPECT_EQ(config.validate().text(),
              "host is '" + host + "'; allowed: an IPv4 or IPv6 address, or the name of a computer");
  }
}

TEST(SerialSource, RawBytesBothWays) {
  Pty pty;
  SerialSource::Config config;
  config.device = pty.device;
  config.baud = 460800;
  config.stream.dialogue = "LOG TIMEB\r\n";
  SerialSource source(config);
  ASSERT_TRUE(source.open().ok());
  EXPECT_EQ(receive_text(pty.master, 11), "LOG TIMEB\r\n");  // no CR/LF conversion on the way out
  // Bytes that a terminal would interpret: XON, XOFF, interrupt, end of file, CR, DEL, and 0xFF, which parity marking
  // doubles.
  const std::string tricky("\x11\x13\x03\x04\r\n\x7F\xFF\xAA\x44\x12\x00\x1A", 13);
  send_text(pty.master, tricky);
  EXPECT_EQ(gather(source, tricky.size()), tricky);
  EXPECT_EQ(error_of(source), ErrorCode::TimedOut);
  pollfd ready{pty.master.get(), POLLIN, 0};
  EXPECT_EQ(::poll(&ready, 1, 0), 0) << "the port echoes";
}

TEST(SerialSource, UnpluggedIsDisconnected) {
  Pty pty;
  SerialSource::Config config;
  config.device = pty.device;
  SerialSource source(config);
  ASSERT_TRUE(source.open().ok());
  pty.master.close();
  EXPECT_EQ(error_of(source), ErrorCode::Disconnected);
  EXPECT_EQ(source.open().error().code, ErrorCode::Unavailable);  // the device file is gone with it
}

TEST(SerialSource, WhatIsNoSerialPort) {
  SerialSource::Config config;
  config.device = "/dev/null";
  EXPECT_EQ(SerialSource(config).open().error().code, ErrorCode::Invalid);
  config.device = "/dev/nothing_of_this_name";
  EXPECT_EQ(SerialSource(config).open().error().code, ErrorCode::Unavailable);
  config.baud = 1;
  EXPECT_NE(config.validate().text().find("baud"), std::string::npos);
}

TEST(FileSource, ReadsTheFileInPiecesWithCountedTimes) {
  const std::string path = ::testing::TempDir() + "hueline_file_source_" + std::to_string(::getpid());
  std::ofstream(path, std::ios::binary) << "abcdefghij";
  FileSource::Config config;
  config.path = path;
  config.chunk_bytes = 4;
  config.first_received = host_time_ns(100);
  config.interval = nanoseconds(10);
  FileSource source(config);
  for (int round = 0; round < 2; ++round) {  // opening again begins again
    ASSERT_TRUE(source.open().ok());
    const char* expected[] = {"abcd", "efgh", "ij"};
    for (int i = 0; i < 3; ++i) {
      auto packet = source.next({});
      ASSERT_TRUE(packet.ok());
      EXPECT_EQ(text_of(*packet), expected[i]);
      EXPECT_EQ(packet->received, host_time_ns(100 + 10 * i));
    }
    EXPECT_EQ(source.next({}).error().code, ErrorCode::EndOfData);
  }
  ::unlink(path.c_str());
  EXPECT_EQ(source.open().error().code, ErrorCode::Unavailable);
}

}  // namespace
}  // namespace hueline::drivers
