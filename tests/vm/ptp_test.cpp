#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "drivers/pps/ptp_clock.hpp"
#include "drivers/pps/ptp_decoder.hpp"
#include "drivers/transport/file_descriptor.hpp"
#include "drivers/transport/host_clock.hpp"

// PtpClock on a real /dev/ptp0: runs in the guest of tests/vm (ptp.sh). The clock is the computer's own and an offset
// (hueline_ptp.c), so where its seconds begin is known exactly.
namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr const char* kPath = "/dev/ptp0";

void sh(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

class Ptp : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    const char* modules = std::getenv("HUELINE_MODULES");
    ASSERT_NE(modules, nullptr);
    sh(std::string("insmod ") + modules + "/hueline_ptp.ko comparison=" + std::to_string(GetParam()));
    for (int i = 0; i < 100 && ::access(kPath, R_OK) != 0; ++i) ::usleep(10'000);
  }
  void TearDown() override { sh("rmmod hueline_ptp"); }

  /// Sets the clock to TAI of that UTC, as ptp4l does.
  static void set(const UtcTime& utc) {
    const FileDescriptor clock(::open(kPath, O_RDWR | O_CLOEXEC));
    ASSERT_TRUE(clock);
    const nanoseconds tai = from_utc(utc)->time_since_epoch() + seconds(315'964'819);
    const timespec time{tai.count() / 1'000'000'000, tai.count() % 1'000'000'000};
    constexpr clockid_t kOfDescriptor = 3;  // FD_TO_CLOCKID of the kernel
    ASSERT_EQ(
        ::clock_settime(static_cast<clockid_t>((~static_cast<unsigned>(clock.get()) << 3U) | kOfDescriptor), &time), 0);
  }
  /// By how much the clock is ahead of CLOCK_MONOTONIC_RAW.
  static nanoseconds offset() {
    std::int64_t ns = 0;
    std::ifstream("/sys/module/hueline_ptp/parameters/offset_ns") >> ns;
    return nanoseconds(ns);
  }
};

struct Heard {
  std::vector<PpsEdge> edges;
  std::vector<TimeLabel> labels;
  std::vector<Fault> faults;
  std::optional<Error> error;
};
Heard hear(PtpClock& clock, PtpDecoder& decoder, nanoseconds time) {
  Heard heard;
  std::vector<Measurement> out;
  for (const HostTime begin = host_now(); host_now() - begin < time;) {
    const auto packet = clock.next({});
    if (packet) {
      decoder.decode(*packet, out);
    } else if (packet.error().code != ErrorCode::TimedOut) {
      heard.error = packet.error();
      break;
    }
  }
  for (const Measurement& m : out) {
    if (const auto* edge = std::get_if<PpsEdge>(&m)) heard.edges.push_back(*edge);
    if (const auto* label = std::get_if<TimeLabel>(&m)) heard.labels.push_back(*label);
    if (const auto* fault = std::get_if<Fault>(&m)) heard.faults.push_back(*fault);
  }
  return heard;
}

TEST_P(Ptp, ItsSecondsLieWhereTheyAreAndHaveTheirNames) {
  set({2026, 3, 1, 12, 0, 0, 0});
  PtpClock clock(kPath);
  const Status opened = clock.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  PtpDecoder decoder(PtpScale::Tai);
  const Heard heard = hear(clock, decoder, seconds(8));
  // A machine that stands still for more than 20 ms may lose one.
  ASSERT_GE(heard.edges.size(), 6u);
  ASSERT_EQ(heard.labels.size(), heard.edges.size());
  std::vector<double> off_us;
  for (std::size_t i = 0; i < heard.edges.size(); ++i) {
    // GPS time of the second, on the clock, on the computer's clock.
    const nanoseconds tai = heard.labels[i].second.time_since_epoch() + seconds(315'964'819);
    const HostTime truth(tai - offset());
    off_us.push_back(std::abs(static_cast<double>((heard.edges[i].edge - truth).count())) * 1e-3);
    EXPECT_TRUE(heard.labels[i].is_valid);
    EXPECT_LT(std::abs(to_seconds(heard.labels[i].second - *from_utc({2026, 3, 1, 12, 0, 4, 0}))), 30);
  }
  std::ranges::sort(off_us);
  std::printf("comparison %d: edges off by %.3f us (median), %.3f us (largest) of %zu\n", GetParam(),
              off_us[off_us.size() / 2], off_us.back(), off_us.size());
  // The packet says how uncertain a comparison is; one by the hardware is exact.
  EXPECT_LT(off_us[off_us.size() / 2], GetParam() == 2 ? 0.001 : 20);
  EXPECT_LE(off_us.back(), 50);
}

TEST_P(Ptp, AClockThatNobodyHasSetIsToldAndOneThatIsSetIsFollowed) {
  PtpClock clock(kPath);
  ASSERT_TRUE(clock.open().ok());
  PtpDecoder decoder(PtpScale::Tai);
  const Heard unset = hear(clock, decoder, milliseconds(2500));
  EXPECT_TRUE(unset.edges.empty());
  ASSERT_EQ(unset.faults.size(), 1u);
  EXPECT_EQ(unset.faults[0].kind, FaultKind::NoTime);
  EXPECT_THAT(unset.faults[0].detail, HasSubstr("nobody has set it"));
  set({2026, 3, 1, 12, 0, 0, 0});
  const Heard after = hear(clock, decoder, milliseconds(3500));
  ASSERT_GE(after.labels.size(), 2u);
  set({2025, 3, 1, 12, 0, 0, 500'000'000});  // set back
  const Heard back = hear(clock, decoder, milliseconds(3500));
  ASSERT_GE(back.labels.size(), 2u);
  EXPECT_LT(back.labels.back().second, *from_utc({2025, 3, 1, 12, 1, 0, 0}));
}

TEST_P(Ptp, WhatIsNoPtpClockIsRefusedAndOneThatIsGoneIsTold) {
  PtpClock absent("/dev/ptp7");
  EXPECT_EQ(absent.open().error().code, ErrorCode::Unavailable);
  PtpClock wrong("/dev/null");
  EXPECT_EQ(wrong.open().error().code, ErrorCode::Unsupported);
  PtpClock clock(kPath);
  ASSERT_TRUE(clock.open().ok());
  clock.close();
  EXPECT_EQ(clock.next({}).error().code, ErrorCode::Disconnected);
}

INSTANTIATE_TEST_SUITE_P(Kernel, Ptp, testing::Values(0, 1, 2));

/// A clock that linuxptp's phc2sys keeps at TAI: it steps the clock and changes its rate all the time.
class PtpPeer : public Ptp {
 protected:
  void SetUp() override {
    if (std::system("command -v phc2sys >/dev/null") != 0) GTEST_SKIP() << "linuxptp is not installed";
    Ptp::SetUp();
    sh("phc2sys -s CLOCK_REALTIME -c /dev/ptp0 -O 37 -m >/tmp/phc2sys.txt 2>&1 & echo $! >/tmp/phc2sys.pid");
  }
  void TearDown() override {
    if (IsSkipped()) return;
    sh("kill $(cat /tmp/phc2sys.pid); while kill -0 $(cat /tmp/phc2sys.pid) 2>/dev/null; do sleep 0.1; done");
    Ptp::TearDown();
  }
  /// By how much the wall clock is ahead of CLOCK_MONOTONIC_RAW.
  static nanoseconds wall_ahead() {
    nanoseconds best = nanoseconds::max(), ahead{};
    for (int i = 0; i < 20; ++i) {
      timespec before{}, wall{}, after{};
      ::clock_gettime(CLOCK_MONOTONIC_RAW, &before);
      ::clock_gettime(CLOCK_REALTIME, &wall);
      ::clock_gettime(CLOCK_MONOTONIC_RAW, &after);
      const auto ns = [](const timespec& t) { return seconds(t.tv_sec) + nanoseconds(t.tv_nsec); };
      if (ns(after) - ns(before) >= best) continue;
      best = ns(after) - ns(before);
      ahead = ns(wall) - ns(before) - best / 2;
    }
    return ahead;
  }
};

TEST_P(PtpPeer, SecondsOfAClockThatLinuxptpKeepsAreThoseOfUtc) {
  PtpClock clock(kPath);
  ASSERT_TRUE(clock.open().ok());
  PtpDecoder decoder(PtpScale::Tai);
  (void)hear(clock, decoder, seconds(6));  // until phc2sys has found the rate
  const Heard heard = hear(clock, decoder, seconds(6));
  const nanoseconds ahead = wall_ahead();
  ASSERT_GE(heard.edges.size(), 4u);
  ASSERT_EQ(heard.labels.size(), heard.edges.size());
  std::vector<double> off_us;
  for (std::size_t i = 0; i < heard.edges.size(); ++i) {
    // The wall clock of this guest is UTC as far as anybody here knows.
    constexpr seconds kUnixOfGps{315'964'800};
    constexpr seconds kLeap{18};
    const nanoseconds unix_time = heard.labels[i].second.time_since_epoch() + kUnixOfGps - kLeap;
    EXPECT_TRUE(heard.labels[i].is_valid);
    off_us.push_back(
        std::abs(static_cast<double>((heard.edges[i].edge.time_since_epoch() + ahead - unix_time).count())) * 1e-3);
  }
  std::ranges::sort(off_us);
  std::printf("kept by linuxptp: edges off by %.3f us (median), %.3f us (largest) of %zu; it says:\n",
              off_us[off_us.size() / 2], off_us.back(), off_us.size());
  std::fflush(stdout);
  sh("tail -3 /tmp/phc2sys.txt");
  // Two programs read clocks of an emulated computer, each with its own delays.
  EXPECT_LT(off_us[off_us.size() / 2], 50);
}

INSTANTIATE_TEST_SUITE_P(Kernel, PtpPeer, testing::Values(1));

}  // namespace
}  // namespace hueline::drivers
