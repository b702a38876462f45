#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <thread>

#include "drivers/gige/genicam_config.hpp"
#include "drivers/guest/guest_source.hpp"
#include "drivers/transport/host_clock.hpp"

// GuestSource with a guest that does whatever a library can do to its process. The test does not limit how long things
// take on a busy computer; the limits below only end a test that would never end.
namespace hueline::drivers {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr nanoseconds kForever = 60s;

GuestSource::Config bad_guest(const std::string& mode) {
  GuestSource::Config config;
  config.program = guest::guest_program().parent_path() / "bad_guest";
  config.driver = "bad";
  config.text = mode;
  config.slots = 8;
  config.started_within = std::chrono::milliseconds(30'000);  // under a sanitizer, on a busy machine
  config.hung_after = std::chrono::milliseconds(3000);
  return config;
}

Status open(GuestSource& source) {
  const HostTime begin = host_now();
  for (;;)
    if (Status opened = source.open();
        opened.ok() || opened.error().code != ErrorCode::TimedOut || host_now() - begin > kForever)
      return opened;
}

struct Heard {
  std::vector<Packet> packets;
  std::vector<Fault> faults;
  Error ended{ErrorCode::TimedOut, "nothing ended it"};
};
Heard listen(GuestSource& source, std::size_t packets, bool keep = false) {
  Heard heard;
  const HostTime begin = host_now();
  for (std::size_t count = 0; count < packets && host_now() - begin < kForever;) {
    auto packet = source.next({});
    if (!packet) {
      if (packet.error().code == ErrorCode::TimedOut) continue;
      heard.ended = packet.error();
      break;
    }
    if (packet->kind == PacketKind::Fault) {
      heard.faults.push_back(*decode_fault(packet->sensor, packet->received, packet->bytes.bytes()));
      continue;
    }
    ++count;
    if (!keep) heard.packets.clear();
    heard.packets.push_back(std::move(*packet));
  }
  return heard;
}

bool is_full_of(const Packet& packet, int number) {
  return packet.bytes.size() == 100'000 &&
         std::ranges::all_of(packet.bytes.bytes(), [&](std::byte b) { return b == static_cast<std::byte>(number); });
}

bool is_gone(pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  if (!std::getline(stat, line)) return true;
  return line[line.rfind(')') + 2] == 'Z';
}

TEST(Guest, PacketsComeInOrderAndInTheMemoryThatTheGuestWrote) {
  GuestSource source(bad_guest("behaves"));
  ASSERT_TRUE(open(source).ok());
  const Heard heard = listen(source, 8, true);
  ASSERT_EQ(heard.packets.size(), 8U);
  std::vector<const std::byte*> places;
  for (int i = 0; i < 8; ++i) {
    const Packet& packet = heard.packets[static_cast<std::size_t>(i)];
    EXPECT_TRUE(is_full_of(packet, i + 1)) << i;
    EXPECT_LE(packet.received, host_now());
    places.push_back(packet.bytes.data());
  }
  std::ranges::sort(places);
  EXPECT_EQ(std::unique(places.begin(), places.end()), places.end()) << "a slot was lent twice";
  // Every slot is held here, so the guest has nothing to write into. It goes on when one is returned.
  EXPECT_EQ(source.next({}).error().code, ErrorCode::TimedOut);
}

TEST(Guest, SlotsGoRoundForAsLongAsTheDeviceSends) {
  GuestSource source(bad_guest("behaves"));
  ASSERT_TRUE(open(source).ok());
  EXPECT_TRUE(is_full_of(listen(source, 200).packets.back(), 200));
}

TEST(Guest, PacketsMayNeedMoreMemoryThanTheLimitOfItsLibrary) {
  auto config = bad_guest("has large packets");
  config.slots = 48;
  GuestSource source(config);
  const Status opened = open(source);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ(listen(source, 1).packets.size(), 1U);
}

TEST(Guest, WhatIsReadIsNotWrittenByASuccessor) {
  std::vector<Packet> held;
  {
    GuestSource source(bad_guest("behaves"));
    for (int life = 0; life < 3; ++life) {
      ASSERT_TRUE(open(source).ok());
      auto heard = listen(source, 2, true);
      ASSERT_EQ(heard.packets.size(), 2U);
      std::ranges::move(heard.packets, std::back_inserter(held));
      listen(source, 20);
      ASSERT_EQ(::kill(source.guest_pid(), SIGKILL), 0);
      EXPECT_EQ(listen(source, 1000).ended.code, ErrorCode::Disconnected);
    }
  }
  for (std::size_t i = 0; i < held.size(); ++i) EXPECT_TRUE(is_full_of(held[i], static_cast<int>(i % 2 + 1))) << i;
}

struct Misdeed {
  const char* mode;
  const char* told;
};
class GuestMisdeed : public testing::TestWithParam<Misdeed> {};

TEST_P(GuestMisdeed, IsAFaultOfItsDeviceAndANewGuestIsStarted) {
  GuestSource source(bad_guest(GetParam().mode));
  const bool takes_seconds = GetParam().told == std::string("hangs");
  for (int life = takes_seconds ? 1 : 0; life < 2; ++life) {
    ASSERT_TRUE(open(source).ok());
    const pid_t pid = source.guest_pid();
    const Heard heard = listen(source, 1000);
    EXPECT_EQ(heard.ended.code, ErrorCode::Disconnected);
    EXPECT_THAT(heard.ended.message, HasSubstr(GetParam().told));
    EXPECT_TRUE(std::ranges::all_of(heard.ended.message, [](char c) { return c >= 0x20 && c < 0x7f; }))
        << heard.ended.message;
    EXPECT_TRUE(is_gone(pid));
    EXPECT_EQ(source.guest_pid(), 0);
  }
}
const std::vector<Misdeed> kMisdeeds {
  {"aborts", "signal 6"}, {"aborts", "resource deadlock avoided?[2J"},
#if !defined(HUELINE_SANITIZE_ADDRESS) && !defined(HUELINE_SANITIZE_THREAD)  // which have their own ends for these
      {"reads nowhere", "signal 11"}, {"eats memory", "bad_alloc"},
#endif
      {"exits", "status 7"}, {"exits well", "status 0"}, {"hangs", "hangs"}, {"stops", "hangs"},
      {"gives a slot twice", "slot 0"}, {"gives no slot", "slot 4000000000"}, {"gives too much", "slot 1"},
      {"gives nothing", "slot 1"}, {"stamps the future", "stamped a packet"}, {"stamps the past", "stamped a packet"},
      {"stamps a loss anyhow", "stamped a loss"}, {"wants memory again", "twice for memory"},
      {"says nothing known", "not known"}, {"says half", "wrong size"}, {"says an empty word", "hung up"},
      {"says it runs again", "twice"}, {"tells of losses without end", "losses a second"},
      {"claims an end", "all is well"},
};
INSTANTIATE_TEST_SUITE_P(All, GuestMisdeed, testing::ValuesIn(kMisdeeds), [](const auto& one) {
  std::string name = std::to_string(one.index) + "_" + one.param.mode;
  std::ranges::replace(name, ' ', '_');
  return name;
});

TEST(Guest, MisdeedsBeforeTheDeviceRunsAreErrorsOfOpen) {
  for (const char* mode : {"dies in open", "wants too much memory", "wants no memory", "gives before it has memory"}) {
    GuestSource source(bad_guest(mode));
    const Status opened = open(source);
    ASSERT_FALSE(opened.ok()) << mode;
    EXPECT_EQ(opened.error().code, ErrorCode::Unavailable) << mode << opened.error().message;
    EXPECT_EQ(source.guest_pid(), 0);
  }
}

TEST(Guest, ARefusalOfTheDeviceIsHandedOnInPrintableWords) {
  GuestSource source(bad_guest("refuses"));
  const Status opened = open(source);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Invalid);
  EXPECT_EQ(opened.error().message, "no such setting: ?[31m??");
}

TEST(Guest, AMissingProgramIsUnavailable) {
  auto config = bad_guest("behaves");
  config.program = "/nowhere/hueline-guest";
  GuestSource source(config);
  const Status opened = open(source);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Unavailable);
  EXPECT_THAT(opened.error().message, HasSubstr("/nowhere/hueline-guest"));
}

TEST(Guest, ClosingDoesNotWaitForALibrary) {
  for (const char* mode : {"hangs in open", "hangs in close"}) {
    GuestSource source(bad_guest(mode));
    if (mode == std::string("hangs in close")) {
      ASSERT_TRUE(open(source).ok());
    } else {
      EXPECT_EQ(source.open().error().code, ErrorCode::TimedOut);
    }
    const pid_t pid = source.guest_pid();
    source.close();
    EXPECT_TRUE(is_gone(pid)) << mode;
  }
}

TEST(Guest, EndsWithAProgramThatIsKilled) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t host = ::fork();
  if (host == 0) {
    GuestSource source(bad_guest("behaves"));
    const bool is_open = open(source).ok();
    const pid_t pid = is_open ? source.guest_pid() : 0;
    if (::write(ends[1], &pid, sizeof(pid)) != sizeof(pid)) ::_exit(1);
    for (;;) (void)source.next({});
  }
  pid_t guest = 0;
  ASSERT_EQ(::read(ends[0], &guest, sizeof(guest)), static_cast<ssize_t>(sizeof(guest)));
  ASSERT_GT(guest, 0);
  EXPECT_FALSE(is_gone(guest));
  ::kill(host, SIGKILL);
  ::waitpid(host, nullptr, 0);
  for (const HostTime begin = host_now(); !is_gone(guest) && host_now() - begin < kForever;)
    std::this_thread::sleep_for(10ms);
  EXPECT_TRUE(is_gone(guest));
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(Guest, HasNoRightsAndNoFilesButItsOwn) {
  const int secret = ::open("/dev/zero", O_RDONLY);  // without O_CLOEXEC
  GuestSource source(bad_guest("tells its rights"));
  const std::string told = open(source).error().message;
  ::close(secret);
  EXPECT_THAT(told, HasSubstr("NoNewPrivs: 1"));
  EXPECT_THAT(told, HasSubstr("core:0"));
  EXPECT_THAT(told.substr(told.find("files:")), testing::StartsWith("files: 0 1 2 3"));
  EXPECT_LE(std::ranges::count(told.substr(told.find("files:")), ' '), 6)
      << told;  // and the two that it reads this from
  constexpr std::uint64_t kMost = 1u << CAP_NET_RAW | 1u << CAP_SYS_NICE;
  for (const char* set : {"CapPrm: ", "CapEff: "})
    EXPECT_EQ(std::stoull(told.substr(told.find(set) + 8), nullptr, 16) & ~kMost, 0U) << told;
  if (::geteuid() == 0) {
    EXPECT_EQ(std::stoull(told.substr(told.find("CapBnd: ") + 8), nullptr, 16) & ~kMost, 0U) << told;
  }
}

TEST(GuestConfigText, EveryMemberComesBack) {
  GenicamConfig config;
  config.address = "10.0.0.2";
  config.features = "A=1\nB=\\2 C=3";
  config.width = 4096;
  config.pixel_format = PixelFormat::BayerGB8;
  config.exposure = std::chrono::microseconds(123);
  config.gain = 0.1;
  config.frame_rate_hz = 1e-3 / 3;
  config.trigger_activation = TriggerActivation::FallingEdge;
  config.packet_delay = nanoseconds(7);
  config.packet_resend = false;
  config.give_up_after = std::chrono::milliseconds(77);
  config.realtime_priority = 12;
  config.images_in_flight = 9999;
  const auto read = GenicamConfig::from_text(config.to_text());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->to_text(), config.to_text());
  EXPECT_EQ(read->features, config.features);
  EXPECT_EQ(read->exposure, config.exposure);
  EXPECT_EQ(read->gain, config.gain);
  EXPECT_EQ(read->frame_rate_hz, config.frame_rate_hz);
  EXPECT_EQ(read->packet_resend, false);
  EXPECT_EQ(read->packet_delay, config.packet_delay);
  EXPECT_EQ(read->width, config.width);
  EXPECT_EQ(read->pixel_format, config.pixel_format);
  EXPECT_EQ(read->trigger_activation, config.trigger_activation);
  EXPECT_EQ(read->give_up_after, config.give_up_after);
  EXPECT_EQ(read->images_in_flight, config.images_in_flight);
  EXPECT_THAT(GenicamConfig::from_text("width 70000\n").error().message, HasSubstr("0 to 65535 px"));
  EXPECT_FALSE(GenicamConfig::from_text(GenicamConfig{}.to_text())->gain.has_value());
  EXPECT_THAT(GenicamConfig::from_text("width wide\n").error().message, HasSubstr("width"));
  EXPECT_THAT(GenicamConfig::from_text("colour 3\n").error().message, HasSubstr("colour"));
  EXPECT_FALSE(GenicamConfig::from_text("width\n").ok());
}

}  // namespace
}  // namespace hueline::drivers
