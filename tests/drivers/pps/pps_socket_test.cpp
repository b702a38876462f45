#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "drivers/pps/pps_source.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

// The sending side: listens, accepts one client, sends messages.
class Sender {
 public:
  Sender() : folder_(std::filesystem::temp_directory_path() / ("hueline_pps_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    listen();
  }
  ~Sender() {
    hang_up();
    stop_listening();
    std::filesystem::remove_all(folder_);
  }
  std::string path() const { return folder_ / "edges"; }
  void listen() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path().c_str(), sizeof(address.sun_path) - 1);
    listener_ = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0)
        << std::strerror(errno);
    EXPECT_EQ(::listen(listener_, 1), 0);
  }
  void stop_listening() {
    ::close(listener_);
    ::unlink(path().c_str());
  }
  void accept() { client_ = ::accept(listener_, nullptr, nullptr); }
  void send(std::span<const std::byte> bytes) {
    EXPECT_EQ(::send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  void send(std::uint64_t sequence, HostTime time) { send(encode_pps({PpsEdgeKind::Assert, sequence, time})); }
  void hang_up() {
    if (client_ >= 0) ::close(std::exchange(client_, -1));
  }

 private:
  const std::filesystem::path folder_;
  int listener_ = -1, client_ = -1;
};

PpsSource source_at(const std::string& path) {
  return PpsSource({.interface = PpsSource::Interface::Socket, .path = path});
}

TEST(PpsSocket, EdgesArriveAsTheyWereSent) {
  Sender sender;
  auto source = source_at(sender.path());
  ASSERT_TRUE(source.open().ok());
  sender.accept();
  const HostTime edge = host_now() - milliseconds(2);
  sender.send(41, edge);
  sender.send(42, edge + milliseconds(1));
  const auto first = source.next({}), second = source.next({});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->received, edge);
  EXPECT_EQ(second->received, edge + milliseconds(1));
  const auto decoded = decode_pps(first->bytes.bytes());
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->sequence, 41U);
  const auto nothing = source.next({});
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().code, ErrorCode::TimedOut);
}

TEST(PpsSocket, AbsentSenderIsUnavailableAndAHungUpOneDisconnected) {
  Sender sender;
  auto source = source_at(sender.path());
  ASSERT_TRUE(source.open().ok());
  sender.accept();
  sender.hang_up();
  sender.stop_listening();
  const auto gone = source.next({});
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().code, ErrorCode::Disconnected);
  const auto refused = source.open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::Unavailable);
  EXPECT_NE(refused.error().message.find(sender.path()), std::string::npos);
  sender.listen();
  ASSERT_TRUE(source.open().ok());
  sender.accept();
  sender.send(1, host_now());
  EXPECT_TRUE(source.next({}).ok());
}

TEST(PpsSocket, WhatIsNoEdgeIsHandedOnUntouched) {
  Sender sender;
  auto source = source_at(sender.path());
  ASSERT_TRUE(source.open().ok());
  sender.accept();
  const std::array<std::byte, 40> rubbish{};
  sender.send(rubbish);
  const auto packet = source.next({});
  ASSERT_TRUE(packet.ok());
  EXPECT_FALSE(decode_pps(packet->bytes.bytes()).ok());
  EXPECT_LT(host_now() - packet->received, milliseconds(1000));
}

TEST(PpsSocket, StopIsObeyed) {
  Sender sender;
  auto source = source_at(sender.path());
  ASSERT_TRUE(source.open().ok());
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = source.next(stop.get_token());
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::Stopped);
}

TEST(PpsConfig, SaysWhichKeyIsWrong) {
  EXPECT_EQ(PpsSource::Config{}.validate(), "");
  EXPECT_NE((PpsSource::Config{.path = "pps0"}).validate().find("path"), std::string::npos);
  EXPECT_NE((PpsSource::Config{.interface = PpsSource::Interface::Socket, .path = std::string(200, '/')})
                .validate()
                .find("107"),
            std::string::npos);
}

TEST(PpsKernel, AbsentDeviceIsUnavailable) {
  PpsSource source({.path = "/dev/no_such_pps"});
  const auto opened = source.open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Unavailable);
}

TEST(PpsKernel, AFileThatIsNoPpsIsRefused) {
  PpsSource source({.path = "/dev/null"});
  const auto opened = source.open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace hueline::drivers
