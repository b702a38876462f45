#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <thread>

#include "sim/devices/player.hpp"
#include "sim/wire/novatel_encode.hpp"
#include "tests/sim/recorded.hpp"
#include "tests/sim/short_drive.hpp"

namespace hueline::sim {
namespace {

using namespace std::chrono_literals;
using test::load;

/// The test's end of a socket, by plain system calls.
class Peer {
 public:
  explicit Peer(int fd) : fd_(fd) {}
  Peer(const Peer&) = delete;
  ~Peer() { ::close(fd_); }
  static int udp(std::uint16_t& port) {
    const int fd = ::socket(AF_INET, SOCK_DGRAM, 0);
    const int size = 4 << 20;
    ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &size, sizeof(size));
    sockaddr_in a = loopback(0);
    EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof(a)), 0);
    socklen_t n = sizeof(a);
    ::getsockname(fd, reinterpret_cast<sockaddr*>(&a), &n);
    port = ntohs(a.sin_port);
    return fd;
  }
  static int tcp(std::uint16_t port, int receive_buffer = 0) {
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    if (receive_buffer > 0) ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer));
    sockaddr_in a = loopback(port);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&a), sizeof(a)), 0);
    return fd;
  }
  static int local(const std::string& path) {
    const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    sockaddr_un a{};
    a.sun_family = AF_UNIX;
    std::strncpy(a.sun_path, path.c_str(), sizeof(a.sun_path) - 1);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&a), sizeof(a)), 0);
    return fd;
  }
  void say(const std::string& text) { EXPECT_EQ(::send(fd_, text.data(), text.size(), 0), ssize_t(text.size())); }
  /// Calls recv once. Returns an empty value if nothing came within `wait`.
  Bytes hear(std::chrono::milliseconds wait = 300ms) {
    pollfd p{fd_, POLLIN, 0};
    if (::poll(&p, 1, static_cast<int>(wait.count())) <= 0) return {};
    Bytes bytes(65536);
    const ssize_t n = ::recv(fd_, bytes.data(), bytes.size(), 0);
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return bytes;
  }
  std::string hear_text(std::size_t size) {
    std::string text;
    while (text.size() < size) {
      const Bytes b = hear();
      if (b.empty()) break;
      text.append(reinterpret_cast<const char*>(b.data()), b.size());
    }
    return text;
  }

 private:
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_port = htons(port);
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return a;
  }
  int fd_;
};

/// Reads everything that a peer sends, in a thread of its own, so that no buffer of the kernel decides the result of a
/// test.
class Listener {
 public:
  explicit Listener(Peer& peer)
      : thread_([this, &peer](const std::stop_token& stop) {
          for (;;) {
            const bool was_over = stop.stop_requested();
            Bytes b = peer.hear(100ms);
            if (b.empty() && was_over) return;
            size_ += b.size();
            if (!b.empty()) heard_.push_back(std::move(b));
          }
        }) {}
  /// Returns everything until a silence of 100 ms after this call.
  const std::vector<Bytes>& finish() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    return heard_;
  }
  Bytes finish_stream() {
    Bytes stream;
    for (const Bytes& b : finish()) stream.insert(stream.end(), b.begin(), b.end());
    return stream;
  }
  std::size_t size() const { return size_; }

 private:
  std::vector<Bytes> heard_;
  std::atomic<std::size_t> size_ = 0;
  std::jthread thread_;
};

std::string socket_path() { return "/tmp/hueline-pps-test-" + std::to_string(::getpid()); }

constexpr std::string_view kAnswer = "\r\n<OK\r\n[ICOM1]";

TEST(PosSubscriptions, ObeysLogCommandsAsAReceiverDoes) {
  PosSubscriptions s;
  EXPECT_EQ(s.execute("LOG INSPVASB ONTIME 0.1"), kAnswer);
  EXPECT_EQ(s.execute("log icom1 timeb ontime 1"), kAnswer);
  EXPECT_EQ(s.execute("LOG MARK1TIMEB ONNEW"), kAnswer);
  EXPECT_EQ(s.execute("LOG BESTPOSB ONCE"), kAnswer);
  EXPECT_THAT(s.execute("LOG INSPVASA ONTIME 1"), testing::HasSubstr("<ERROR"));  // ASCII logs are not offered
  EXPECT_THAT(s.execute("LOG NOSUCHB ONNEW"), testing::HasSubstr("<ERROR"));
  EXPECT_THAT(s.execute("LOG TIMEB ONTIME zero"), testing::HasSubstr("Period"));
  EXPECT_THAT(s.execute("LOG TIMEB SOMETIMES"), testing::HasSubstr("Trigger"));
  EXPECT_THAT(s.execute("MAKECOFFEE"), testing::HasSubstr("<ERROR"));
  EXPECT_EQ(s.execute("   "), "");

  const auto pva = [](std::int64_t ms) {
    return encode_pva(NovatelId::Inspvas, novatel_header(ms * 1'000'000), PvaFields{});
  };
  int sent = 0;
  for (std::int64_t ms = 35; ms < 2035; ms += 5) sent += s.wants(peek_novatel(pva(ms))) ? 1 : 0;
  EXPECT_EQ(sent, 20);  // 100, 200 ... 2000
  EXPECT_TRUE(s.wants(peek_novatel(encode_mark1_time(novatel_header(7'000'000), {}))));
  EXPECT_TRUE(s.wants(peek_novatel(encode_bestpos(novatel_header(7'000'000), {}))));
  EXPECT_FALSE(s.wants(peek_novatel(encode_bestpos(novatel_header(8'000'000), {}))));
  EXPECT_FALSE(s.wants(peek_novatel(encode_pvax(novatel_header(0), {}))));
  EXPECT_EQ(s.execute("UNLOG MARK1TIMEB"), kAnswer);
  EXPECT_FALSE(s.wants(peek_novatel(encode_mark1_time(novatel_header(7'000'000), {}))));
  EXPECT_EQ(s.execute("UNLOGALL TRUE"), kAnswer);
  EXPECT_TRUE(s.empty());
}

TEST(PosServer, ASilentClientLosesLogsAndHoldsUpNobody) {
  PosServer::Config config;
  config.port = 0;
  config.client_buffer_bytes = 20'000;
  auto server = PosServer::open(config).value();
  Peer deaf(Peer::tcp(server->port(), 4096)), keen(Peer::tcp(server->port()));
  deaf.say("LOG INSPVASB ONNEW\r\n");
  keen.say("LOG INSPVASB ONNEW\r\n");
  EXPECT_EQ(keen.hear_text(kAnswer.size()), kAnswer);
  for (int i = 0; i < 100 && server->listening_clients() < 2; ++i) std::this_thread::sleep_for(10ms);
  ASSERT_EQ(server->listening_clients(), 2);

  constexpr std::size_t kLogs = 60'000;
  Listener listener(keen);
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  for (std::size_t i = 1; i <= kLogs; ++i) {
    server->publish(encode_pva(NovatelId::Inspvas, novatel_header(static_cast<GpsNs>(i) * 5'000'000), PvaFields{}));
    while (i % 100 == 0 && listener.size() < i * 104 && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(100us);
    }
  }
  EXPECT_EQ(listener.finish_stream().size(), kLogs * 104);
  const auto counts = server->counts();
  EXPECT_GT(counts.logs_dropped, 0U);
  EXPECT_EQ(counts.logs_sent + counts.logs_dropped, 2 * kLogs);
}

TEST(PpsServer, RefusesAPathThatIsNotASocketAndCleansUp) {
  const std::string path = socket_path() + "-file";
  ::close(::open(path.c_str(), O_CREAT | O_WRONLY, 0600));
  EXPECT_EQ(PpsServer::open({path}).error().code, ErrorCode::Invalid);
  ::unlink(path.c_str());
  { auto server = PpsServer::open({path}).value(); }
  EXPECT_NE(::access(path.c_str(), F_OK), 0);
}

Player::Config laser_alone() {
  Player::Config config;
  config.camera.reset();
  config.pos.reset();
  config.pps.reset();
  return config;
}

TEST(Player, SaysWhoIsMissing) {
  Player::Config config;
  config.camera.reset();
  config.pos->port = 0;
  config.pps->path = socket_path();
  auto player = Player::open(config).value();
  const Status ready = player->wait_until_ready(50'000'000, {});
  EXPECT_EQ(ready.error().code, ErrorCode::TimedOut);
  EXPECT_THAT(ready.error().message, testing::AllOf(testing::HasSubstr("POS"), testing::HasSubstr("PPS")));
  config.speed = 0;
  EXPECT_THAT(Player::open(config).error().message, testing::HasSubstr("speed"));
}

TEST(Player, EverythingArrivesOnceInOrderAndAtItsTime) {
  const Timeline timeline = *build_timeline(test::short_drive(2), {});
  Player::Config config;
  config.camera.reset();
  Peer laser(Peer::udp(config.laser->data_port)), position(Peer::udp(config.laser->position_port));
  config.pos->port = 0;
  config.pps->path = socket_path();
  auto player = Player::open(config).value();
  Peer pos(Peer::tcp(player->pos_port())), pps(Peer::local(config.pps->path));
  pos.say("UNLOGALL\r\nLOG INSPVASB ONNEW\r\nLOG TIMEB ONTIME 1\r\nLOG MARK1TIMEB ONNEW\r\n");
  ASSERT_TRUE(player->wait_until_ready(2'000'000'000, {}).ok());
  ASSERT_EQ(pos.hear_text(4 * kAnswer.size()).size(), 4 * kAnswer.size());

  Listener laser_listener(laser), position_listener(position), pos_listener(pos);
  int progressed = 0;
  const PlayReport report = player->run(timeline, {}, [&](const PlayProgress&) { ++progressed; });
  EXPECT_TRUE(report.is_complete);
  EXPECT_GE(progressed, 4);

  const std::vector<Bytes>& laser_heard = laser_listener.finish();
  const std::vector<Bytes>& position_heard = position_listener.finish();
  Bytes expected_stream;
  std::size_t data = 0, positions = 0, edges = 0;
  for (const WireEvent& e : timeline.events) {
    switch (e.channel) {
      case WireChannel::LaserData:
        ASSERT_LT(data, laser_heard.size());
        ASSERT_EQ(laser_heard[data], e.payload) << data;
        ++data;
        break;
      case WireChannel::LaserPosition:
        ASSERT_LT(positions, position_heard.size());
        ASSERT_EQ(position_heard[positions], e.payload) << positions;
        ++positions;
        break;
      case WireChannel::Pos: {
        const unsigned id = peek_novatel(e.payload).id;
        if (id == 508 || id == 101 || id == 1130) {
          expected_stream.insert(expected_stream.end(), e.payload.begin(), e.payload.end());
        }
        break;
      }
      case WireChannel::Pps: {
        const Bytes message = pps.hear();
        ASSERT_EQ(message.size(), 24U);
        EXPECT_EQ(std::memcmp(message.data(), "PPS1", 4), 0);
        EXPECT_EQ(load<std::uint32_t>(message, 4), 1U);
        EXPECT_EQ(load<std::uint64_t>(message, 8), ++edges);
        EXPECT_EQ(load<std::int64_t>(message, 16), player->host_begin_ns() + e.edge_ns);
        break;
      }
      case WireChannel::Camera:
      case WireChannel::Wheel:
        break;
    }
  }
  EXPECT_EQ(pos_listener.finish_stream(), expected_stream);
  EXPECT_EQ(laser_heard.size(), data);
  EXPECT_EQ(position_heard.size(), positions);
  EXPECT_EQ(report.of(WireChannel::LaserData).sent, data);
  EXPECT_EQ(report.of(WireChannel::Pps).sent, edges);
  EXPECT_EQ(report.of(WireChannel::LaserData).failed, 0U);
  EXPECT_LT(report.of(WireChannel::LaserData).mean_lateness_ns, 20e6);  // the machine may be busy, but the clock works
  RecordProperty("latest_us", std::to_string(report.of(WireChannel::LaserData).latest_ns / 1000));
}

TEST(Player, PlaysTimelinesThatFollowOneAnotherAsOne) {
  const Timeline timeline = *build_timeline(test::short_drive(2), {});
  const auto part = [&](std::int64_t begin_ns, std::int64_t end_ns) {
    auto out = std::make_shared<Timeline>(timeline);
    std::erase_if(out->events, [&](const WireEvent& e) { return e.at_ns < begin_ns || e.at_ns >= end_ns; });
    return std::shared_ptr<const Timeline>(out);
  };
  const std::vector<std::shared_ptr<const Timeline>> parts{part(0, 1'000'000'000), part(1'000'000'000, INT64_MAX)};
  Player::Config config = laser_alone();
  config.speed = 4;
  Peer laser(Peer::udp(config.laser->data_port));
  auto player = Player::open(config).value();
  Listener listener(laser);
  std::size_t next = 0;
  const PlayReport report =
      player->run([&] { return Result(next < parts.size() ? parts[next++] : std::shared_ptr<const Timeline>()); }, {});
  EXPECT_TRUE(report.is_complete);
  std::vector<Bytes> expected;
  for (const WireEvent& e : timeline.events)
    if (e.channel == WireChannel::LaserData) expected.push_back(e.payload);
  EXPECT_EQ(listener.finish(), expected);
  EXPECT_LT(report.of(WireChannel::LaserData).mean_lateness_ns, 20e6);
}

TEST(Player, SaysWhyThereIsNoNextTimeline) {
  auto player = Player::open(laser_alone()).value();
  const PlayReport report = player->run(
      []() -> Result<std::shared_ptr<const Timeline>> {
        return Error{ErrorCode::Invalid, "the lap is broken"};
      },
      {});
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.problem, "the lap is broken");
}

TEST(Player, StopsWhenAsked) {
  const Timeline timeline = *build_timeline(test::short_drive(5), {});
  Player::Config config = laser_alone();
  config.speed = 2;
  Peer laser(Peer::udp(config.laser->data_port));
  auto player = Player::open(config).value();
  std::stop_source stop;
  std::thread stopper([&] {
    std::this_thread::sleep_for(500ms);
    stop.request_stop();
  });
  const auto begin = std::chrono::steady_clock::now();
  const PlayReport report = player->run(timeline, stop.get_token());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1500ms);
  stopper.join();
  EXPECT_FALSE(report.is_complete);
  EXPECT_LT(report.of(WireChannel::LaserData).sent, timeline.events.size() / 2);
  EXPECT_GT(report.of(WireChannel::LaserData).sent, 100U);
}

}  // namespace
}  // namespace hueline::sim
