#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>
#include <utility>

#include "drivers/can/can_errors.hpp"
#include "drivers/transport/can_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "drivers/wheel/wheel_decoder.hpp"
#include "sim/devices/can_sender.hpp"
#include "sim/wire/can_encode.hpp"
#include "tests/support/replugs.hpp"

// CanSource and WheelDecoder on the kernel's own CAN: runs in the guest of tests/vm (can.sh).
namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

void sh(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

/// A program at the other end of the cable.
class Sender {
 public:
  explicit Sender(const std::string& interface) : fd_(::socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    const int on = 1;
    EXPECT_EQ(::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)), 0);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0) << interface;
  }
  ~Sender() { ::close(fd_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;
  template <class Frame>
  bool send(const Frame& frame) const {
    return ::write(fd_, &frame, sizeof(frame)) == static_cast<ssize_t>(sizeof(frame));
  }

 private:
  int fd_;
};

::can_frame frame(canid_t id, std::initializer_list<int> bytes) {
  ::can_frame out{};
  out.can_id = id;
  for (const int byte : bytes) out.data[out.len++] = static_cast<__u8>(byte);
  return out;
}

CanSource::Config on(const std::string& interface) {
  CanSource::Config config;
  config.interface = interface;
  return config;
}

struct Heard {
  std::vector<CanFrame> frames;
  std::vector<HostTime> received;
  std::vector<Packet> packets;
  std::map<FaultKind, std::uint64_t> faults;
  std::optional<Error> error;
};
/// All that comes until nothing came for 0.2 s, or the source gives up.
Heard hear(CanSource& source, int silence = 2) {
  Heard heard;
  for (int silent = 0; silent < silence;) {
    Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code != ErrorCode::TimedOut) {
        heard.error = packet.error();
        return heard;
      }
      ++silent;
      continue;
    }
    silent = 0;
    if (packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(packet->sensor, packet->received, packet->bytes.bytes());
      heard.faults[fault->kind] += fault->count;
      continue;
    }
    CanPacket parsed;
    EXPECT_TRUE(decode_can_packet(packet->bytes.bytes(), parsed).ok());
    heard.frames.push_back(parsed.frames.at(0));
    heard.received.push_back(packet->received);
    heard.packets.push_back(std::move(*packet));
  }
  return heard;
}

TEST(Can, FramesComeAsTheyWereSentWithTheKernelsStamp) {
  CanSource source(on("vx0"), BufferPool(1 << 20));
  const Status opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const Sender other("vx1");
  const HostTime before = host_now();
  const auto first = frame(0x0B2, {1, 2, 3});
  ASSERT_TRUE(other.send(first));
  ASSERT_TRUE(other.send(frame(0x18FEBF0B | CAN_EFF_FLAG, {9, 8, 7, 6, 5, 4, 3, 2})));
  ASSERT_TRUE(other.send(frame(0x321 | CAN_RTR_FLAG, {})));
  canfd_frame fd{};
  fd.can_id = 0x5A1;
  fd.len = 64;
  fd.flags = CANFD_BRS;
  fd.data[63] = 0x77;
  ASSERT_TRUE(other.send(fd));
  const HostTime after = host_now();
  std::this_thread::sleep_for(milliseconds(300));  // a stamp of the reading would be seen
  const Heard heard = hear(source);
  ASSERT_EQ(heard.frames.size(), 4u);
  EXPECT_EQ(heard.frames[0].id, 0xB2u);
  EXPECT_THAT(heard.frames[0].bytes(), testing::ElementsAre(1, 2, 3));
  EXPECT_FALSE(heard.frames[0].is_local) << "vxcan: from the other end";
  EXPECT_EQ(std::memcmp(heard.packets[0].bytes.data() + kCanHeaderSize, &first, sizeof(first)), 0)
      << "the kernel's own bytes";
  EXPECT_TRUE(heard.frames[1].is_extended);
  EXPECT_EQ(heard.frames[1].id, 0x18FEBF0Bu);
  EXPECT_TRUE(heard.frames[2].is_remote);
  EXPECT_TRUE(heard.frames[3].is_fd);
  EXPECT_EQ(heard.frames[3].length, 64);
  EXPECT_EQ(heard.frames[3].data[63], 0x77);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GE(heard.received[i], before - milliseconds(1)) << i;
    EXPECT_LE(heard.received[i], after + milliseconds(20)) << i;
    if (i > 0) {
      EXPECT_GE(heard.received[i], heard.received[i - 1]);
    }
  }
  GTEST_LOG_(INFO) << "stamped " << (heard.received[0] - before).count() / 1000 << " us after the write began";
}

TEST(Can, ErrorFramesAreFramesLikeOthersAndTold) {
  CanSource source(on("vcan0"), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender same("vcan0");
  ASSERT_TRUE(same.send(frame(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0})));
  ASSERT_TRUE(same.send(frame(CAN_ERR_FLAG | CAN_ERR_RESTARTED, {0, 0, 0, 0, 0, 0, 0, 0})));
  ASSERT_TRUE(same.send(frame(0x123, {1})));
  const Heard heard = hear(source);
  ASSERT_EQ(heard.frames.size(), 3u);
  EXPECT_TRUE(heard.frames[0].is_error && heard.frames[1].is_error);
  EXPECT_EQ(explain_can_error(heard.frames[0]).at(0).kind, FaultKind::Disconnected);
  EXPECT_EQ(explain_can_error(heard.frames[1]).at(0).kind, FaultKind::Reconnected);
  EXPECT_TRUE(heard.frames[2].is_local) << "sent on the same computer";
}

TEST(Can, WhatTheSocketCouldNotHoldIsCounted) {
  CanSource::Config config = on("vx0");
  config.receive_buffer_bytes = 16384;
  CanSource source(config, BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  const Sender other("vx1");
  constexpr int kFrames = 2000;
  for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(other.send(frame(0x100, {i & 255})));
  Heard heard = hear(source);
  EXPECT_LT(heard.frames.size(), 1000u);
  // The kernel tells of a loss on the next frame that it delivers.
  ASSERT_TRUE(other.send(frame(0x101, {})));
  const Heard last = hear(source);
  ASSERT_EQ(last.frames.size(), 1u);
  const auto lost = heard.faults[FaultKind::Overflow] +
                    (last.faults.contains(FaultKind::Overflow) ? last.faults.at(FaultKind::Overflow) : 0);
  EXPECT_EQ(heard.frames.size() + lost, static_cast<std::size_t>(kFrames));
}

TEST(Can, AnInterfaceThatGoesAndComesBack) {
  CanSource source(on("vx0"), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  sh("ip link set vx0 down");
  const Heard down = hear(source, 20);
  ASSERT_TRUE(down.error);
  EXPECT_EQ(down.error->code, ErrorCode::Disconnected);
  EXPECT_THAT(down.error->message, testing::HasSubstr("set down"));
  const Status still = source.open();
  ASSERT_FALSE(still.ok());
  EXPECT_EQ(still.error().code, ErrorCode::Unavailable);
  EXPECT_THAT(still.error().message, testing::HasSubstr("is down"));
  sh("ip link set vx0 up");
  ASSERT_TRUE(source.open().ok());
  {
    const Sender other("vx1");
    ASSERT_TRUE(other.send(frame(0x123, {1})));
    EXPECT_EQ(hear(source).frames.size(), 1u);
  }
  sh("ip link del vx0");
  const Heard gone = hear(source, 20);
  ASSERT_TRUE(gone.error);
  EXPECT_EQ(gone.error->code, ErrorCode::Disconnected) << gone.error->message;
  EXPECT_EQ(source.open().error().code, ErrorCode::Unavailable);
  sh("ip link add vx0 type vxcan peer name vx1; ip link set vx0 up; ip link set vx1 up");
  ASSERT_TRUE(source.open().ok());
  const Sender other("vx1");
  ASSERT_TRUE(other.send(frame(0x124, {})));
  EXPECT_EQ(hear(source).frames.size(), 1u);
  CanSource wrong(on("lo"), BufferPool(1 << 20));
  EXPECT_EQ(wrong.open().error().code, ErrorCode::Invalid) << "an interface of another kind";
}

TEST(Can, UnpluggedAtAnyMomentItComesBack) {
  const int cycles = test::replugs(4);
  CanSource source(on("vx0"), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  std::vector<double> took_s;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    const bool is_set_down = cycle % 2 == 0;  // else the adapter itself is taken away
    {
      const Sender other("vx1");
      for (int i = 0; i <= cycle % 7; ++i) ASSERT_TRUE(other.send(frame(0x123, {i})));
    }
    const Heard before = hear(source, 1);
    ASSERT_EQ(before.frames.size(), static_cast<std::size_t>(cycle % 7 + 1)) << cycle;
    sh(is_set_down ? "ip link set vx0 down" : "ip link del vx0");
    const Heard end = hear(source, 20);
    ASSERT_TRUE(end.error.has_value()) << cycle;
    EXPECT_EQ(end.error->code, ErrorCode::Disconnected) << end.error->message;
    EXPECT_EQ(source.open().error().code, ErrorCode::Unavailable);
    sh(is_set_down ? "ip link set vx0 up"
                   : "ip link add vx0 type vxcan peer name vx1; ip link set vx0 mtu 72 up; ip link set vx1 mtu 72 up");
    const HostTime back = host_now();
    ASSERT_TRUE(source.open().ok()) << cycle;
    const Sender other("vx1");
    ASSERT_TRUE(other.send(frame(0x124, {cycle & 0xFF})));
    const Heard again = hear(source, 1);
    ASSERT_EQ(again.frames.size(), 1u) << cycle;
    took_s.push_back(to_seconds(again.received[0] - back));
  }
  test::print_returns("CAN", took_s);
}

/// A serial CAN adapter: its line is a pseudo-terminal, and this is what is at the other end.
class SerialAdapter {
 public:
  SerialAdapter() {
    termios raw{};
    ::cfmakeraw(&raw);
    EXPECT_EQ(::openpty(&wire_, &line_, nullptr, &raw, nullptr), 0);
    const int discipline = 17;  // N_SLCAN of linux/tty.h
    EXPECT_EQ(::ioctl(line_, TIOCSETD, &discipline), 0);
    char name[IFNAMSIZ] = {};
    EXPECT_EQ(::ioctl(line_, SIOCGIFNAME, name), 0);
    interface = name;
    // What the driver says to the adapter has to be read, or setting it up never ends.
    reader_ = std::jthread([this](std::stop_token stop) {
      ::fcntl(wire_, F_SETFL, O_NONBLOCK);
      char said[256];
      while (!stop.stop_requested())
        if (::read(wire_, said, sizeof(said)) <= 0) std::this_thread::sleep_for(milliseconds(5));
    });
    up();
  }
  ~SerialAdapter() {
    reader_.request_stop();
    reader_.join();
    ::close(line_);
    ::close(wire_);
  }
  void up() { sh("ip link set " + interface + " type can bitrate 500000; ip link set " + interface + " up"); }
  void down() { sh("ip link set " + interface + " down"); }
  void say(const std::string& line) const {
    const std::string all = line + "\r";
    EXPECT_EQ(::write(wire_, all.data(), all.size()), static_cast<ssize_t>(all.size()));
    std::this_thread::sleep_for(milliseconds(50));
  }
  std::string interface;

 private:
  int wire_ = -1, line_ = -1;
  std::jthread reader_;
};

WheelDecoder::Config esp19() {
  WheelDecoder::Config out;
  out.messages.resize(1);
  out.messages[0].id = 0xB2;
  for (const int start : {0, 16}) {
    CanSignal signal;
    signal.start_bit = start;
    signal.bits = 16;
    signal.scale = 0.0075 / 3.6;
    out.messages[0].speeds.push_back(signal);
  }
  return out;
}

struct Decoded {
  std::vector<WheelSpeed> wheels;
  std::vector<std::string> faults;
};
Decoded decode(WheelDecoder& decoder, const Heard& heard) {
  Decoded out;
  std::vector<Measurement> measured;
  for (const Packet& packet : heard.packets) decoder.decode(packet, measured);
  for (const Measurement& m : measured) {
    if (const auto* wheel = std::get_if<WheelSpeed>(&m)) out.wheels.push_back(*wheel);
    if (const auto* fault = std::get_if<Fault>(&m))
      out.faults.push_back(std::string(name(fault->kind)) + ": " + fault->detail);
  }
  return out;
}

TEST(Can, AnAdapterGoesOffTheBusAndComesBack) {
  SerialAdapter adapter;
  CanSource source(on(adapter.interface), BufferPool(1 << 20));
  const Status opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  WheelDecoder decoder(esp19());
  adapter.say("t0B280B1A0B1A00000000");  // 50 km/h
  adapter.say("sw128100");               // error warning
  adapter.say("e1a");                    // acknowledge missing
  adapter.say("sb255255");               // bus-off
  const Heard off = hear(source, 4);
  Decoded said = decode(decoder, off);
  ASSERT_EQ(said.wheels.size(), 1u);
  EXPECT_NEAR(*said.wheels[0].speed, 50.0025 / 3.6, 1e-9);
  EXPECT_THAT(said.faults, testing::Contains(testing::HasSubstr("Malformed: many frames break on the bus")));
  EXPECT_THAT(said.faults,
              testing::Contains(testing::AllOf(testing::HasSubstr("Disconnected: "), testing::HasSubstr("bus-off"))));
  for (const std::string& fault : said.faults) GTEST_LOG_(INFO) << fault;
  // This kind cannot be restarted by itself: somebody sets it down and up.
  adapter.down();
  const Heard down = off.error ? off : hear(source, 20);
  ASSERT_TRUE(down.error);
  EXPECT_EQ(down.error->code, ErrorCode::Disconnected);
  adapter.up();
  const Status again = source.open();
  ASSERT_TRUE(again.ok()) << again.error().message;
  adapter.say("t0B280B1A0B1A00000000");
  said = decode(decoder, hear(source));
  EXPECT_EQ(said.wheels.size(), 1u);
  EXPECT_THAT(said.faults, testing::Contains(testing::HasSubstr("Reconnected: frames come again after bus-off")));
}

TEST(Can, TheSimulatedVehicleDrivesOnAnInterface) {
  CanSource source(on("vx0"), BufferPool(1 << 20));
  ASSERT_TRUE(source.open().ok());
  sim::CanSender::Config config;
  config.interface = "vx1";
  auto bus = sim::CanSender::open(config);
  ASSERT_TRUE(bus.ok()) << bus.error().message;
  sim::WheelSample sample;
  HostTime last = host_now();
  nanoseconds longest{};  // between two messages: a busy host lets the guest wait
  for (int i = 0; i < 100; ++i) {
    sample.speed.fill(0.1 * i);
    ASSERT_TRUE((*bus)->send(sim::encode_wheel_speeds(sample)));
    ASSERT_TRUE((*bus)->send(sim::encode_wheel_pulses(sample, static_cast<std::uint32_t>(i))));
    longest = std::max(longest, host_now() - std::exchange(last, host_now()));
    std::this_thread::sleep_for(milliseconds(2));
  }
  ASSERT_TRUE((*bus)->send(sim::encode_bus_off()));
  WheelDecoder::Config rig = esp19();
  rig.max_acceleration = 1000;
  WheelDecoder decoder(rig);
  const Decoded said = decode(decoder, hear(source));
  ASSERT_EQ(said.wheels.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(*said.wheels[static_cast<std::size_t>(i)].speed, 0.1 * i, 0.0011) << i;
  EXPECT_THAT(said.faults, testing::Contains(testing::HasSubstr("bus-off")));
  // The messages have no counter: one that comes a cycle late tells of another one that never came.
  const auto by_cycle = std::ranges::count_if(
      said.faults, [](const std::string& s) { return s.find("by their cycle") != std::string::npos; });
  EXPECT_EQ(said.faults.size(), 1u + static_cast<std::size_t>(by_cycle)) << testing::PrintToString(said.faults);
  if (longest < milliseconds(3)) {
    EXPECT_EQ(by_cycle, 0);
  }
}

}  // namespace
}  // namespace hueline::drivers
