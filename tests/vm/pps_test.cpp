#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/io.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <thread>

#include "drivers/pps/pps_decoder.hpp"
#include "drivers/pps/pps_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "tests/support/replugs.hpp"

// PpsSource on a real /dev/pps0: runs in the guest of tests/vm (pps.sh). The pulses are made here, at an emulated
// parallel port whose strobe raises the interrupt that pps_parport stamps.
namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// After the write, for an interrupt that is not taken at once.
constexpr nanoseconds kLatest = milliseconds(15);
constexpr nanoseconds kEarliest = -std::chrono::microseconds(20);

/// Its edge lies between these: the guest's processors are threads among others of the host, and a busy host may let
/// one wait for tens of milliseconds anywhere in between.
struct Pulse {
  HostTime before{}, after{};
};

/// Raises the interrupt.
Pulse pulse() {
  constexpr unsigned short kControl = 0x37A;
  Pulse made;
  made.before = host_now();
  outb(0x10 | 8 | 4 | 1, kControl);  // interrupt enabled, strobe
  outb(0x10 | 8 | 4, kControl);
  made.after = host_now();
  return made;
}

class PpsDevice : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    // The interrupt goes to processor 0; from another one the stamp comes 0.3 ms later.
    cpu_set_t first;
    CPU_ZERO(&first);
    CPU_SET(0, &first);
    ASSERT_EQ(::sched_setaffinity(0, sizeof first, &first), 0);
    ASSERT_EQ(::ioperm(0x378, 3, 1), 0);
  }
};

struct Edges {
  std::vector<PpsEdge> edges;
  std::map<FaultKind, std::uint64_t> faults;
};
// All that comes until nothing came for `silence` tenths of a second.
Edges read(PpsSource& source, PpsDecoder& decoder, int silence = 3) {
  Edges read;
  for (int silent = 0; silent < silence;) {
    const auto packet = source.next({});
    if (!packet) {
      EXPECT_EQ(packet.error().code, ErrorCode::TimedOut) << packet.error().message;
      if (packet.error().code != ErrorCode::TimedOut) break;
      ++silent;
      continue;
    }
    silent = 0;
    std::vector<Measurement> out;
    if (packet->kind == PacketKind::Fault)
      out.push_back(*decode_fault(packet->sensor, packet->received, packet->bytes.bytes()));
    else
      decoder.decode(*packet, out);
    for (const auto& m : out) {
      if (const auto* edge = std::get_if<PpsEdge>(&m)) {
        EXPECT_EQ(packet->received, edge->edge);
        read.edges.push_back(*edge);
      } else {
        const auto& fault = std::get<Fault>(m);
        read.faults[fault.kind] += fault.count;
      }
    }
  }
  return read;
}

// Pulses at `period`, from a thread that starts 150 ms from now; `before_each` runs somewhere between them.
std::jthread pulses(std::vector<Pulse>& made, int count, milliseconds period, std::function<void(int)> between = {}) {
  return std::jthread([&made, count, period, between] {
    std::this_thread::sleep_for(milliseconds(150));
    for (int i = 0; i < count; ++i) {
      made.push_back(pulse());
      std::this_thread::sleep_for(period / 2);
      if (between) between(i);
      std::this_thread::sleep_for(period / 2);
    }
  });
}

// Each edge's pulse is the last one before it. Gives how much later the edges are than what `since` gives of the pulse.
std::vector<nanoseconds> lateness(const std::vector<Pulse>& made, const std::vector<PpsEdge>& edges,
                                  HostTime Pulse::*since = &Pulse::after) {
  std::vector<nanoseconds> late;
  for (const auto& edge : edges) {
    const auto next = std::ranges::upper_bound(made, edge.edge - kEarliest, {}, &Pulse::before);
    late.push_back(next == made.begin() ? nanoseconds::max() : edge.edge - (*(next - 1)).*since);
  }
  std::ranges::sort(late);
  return late;
}

TEST_F(PpsDevice, EdgesComeWithTheirTimes) {
  PpsSource source({});
  const auto opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  PpsDecoder decoder({});
  std::vector<Pulse> made;
  Edges got;
  {
    const auto thread = pulses(made, 40, milliseconds(50));
    got = read(source, decoder);
  }
  ASSERT_EQ(got.edges.size(), 40U);
  EXPECT_THAT(got.faults, testing::IsEmpty());
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_GE(got.edges[i].edge - made[i].before, kEarliest);
    EXPECT_LE(got.edges[i].edge - made[i].after, kLatest);
    if (i) {
      EXPECT_EQ(got.edges[i].sequence, got.edges[i - 1].sequence + 1);
    }
  }
  const auto late = lateness(made, got.edges, &Pulse::before);
  EXPECT_LT(late[20], milliseconds(1));
  GTEST_LOG_(INFO) << "stamped after the write: median " << late[20].count() / 1000 << " us, 90 % "
                   << late[36].count() / 1000 << " us, largest " << late[39].count() / 1000 << " us";
}

TEST_F(PpsDevice, TheClearEdgeIsCapturedWhenAskedFor) {
  PpsSource source({.edge = PpsEdgeKind::Clear});
  const auto opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  PpsDecoder decoder({.edge = PpsEdgeKind::Clear});
  std::vector<Pulse> made;
  Edges got;
  {
    const auto thread = pulses(made, 5, milliseconds(40));
    got = read(source, decoder);
  }
  EXPECT_EQ(got.edges.size(), 5U);
  EXPECT_LE(lateness(made, got.edges).back(), kLatest);
}

TEST_F(PpsDevice, EdgesThatNobodyReadAreCounted) {
  PpsSource source({});
  ASSERT_TRUE(source.open().ok());
  PpsDecoder decoder({});
  pulse();
  EXPECT_EQ(read(source, decoder).edges.size(), 1U);
  Pulse last;
  for (int i = 0; i < 4; ++i) {
    last = pulse();
    std::this_thread::sleep_for(milliseconds(20));
  }
  const Edges got = read(source, decoder);
  ASSERT_EQ(got.edges.size(), 1U);
  EXPECT_LE(got.edges[0].edge - last.after, kLatest);
  EXPECT_GE(got.edges[0].edge - last.before, kEarliest);
  EXPECT_THAT(got.faults, testing::ElementsAre(testing::Pair(FaultKind::Lost, 3)));
}

TEST_F(PpsDevice, SilenceTimesOut) {
  PpsSource source({});
  ASSERT_TRUE(source.open().ok());
  for (int i = 0; i < 3; ++i) {
    const HostTime asked = host_now();
    const auto nothing = source.next({});
    ASSERT_FALSE(nothing.ok());
    EXPECT_EQ(nothing.error().code, ErrorCode::TimedOut);
    EXPECT_LT(host_now() - asked, milliseconds(500));
  }
}

TEST_F(PpsDevice, SettingTheDateMovesNoEdge) {
  PpsSource source({});
  ASSERT_TRUE(source.open().ok());
  PpsDecoder decoder({});
  std::vector<Pulse> made;
  Edges got;
  {
    const auto thread = pulses(made, 8, milliseconds(200), [](int i) {
      if (i == 2) {
        EXPECT_EQ(std::system("date -s '+1 hour' >/dev/null"), 0);
      }
      if (i == 5) {
        EXPECT_EQ(std::system("date -s '2001-02-03 04:05:06' >/dev/null"), 0);
      }
    });
    got = read(source, decoder, 20);  // starting `date` takes its time
  }
  ASSERT_EQ(got.edges.size(), 8U);
  EXPECT_LE(lateness(made, got.edges).back(), kLatest);
  EXPECT_THAT(got.faults, testing::ElementsAre(testing::Pair(FaultKind::ClockStep, 2)));
}

TEST_F(PpsDevice, NoStormOfStepsMovesAnEdge) {
  PpsSource source({});
  ASSERT_TRUE(source.open().ok());
  PpsDecoder decoder({});
  std::vector<Pulse> made;
  Edges got;
  std::atomic<bool> is_over = false;
  // Each step is larger than the lateness that is allowed, so that one that did move an edge is seen: 0.04 s to 12
  // days, either way, around the start, so that they do not walk out of the calendar. No two in one wait for an edge:
  // what the clock said between them nobody can know.
  std::jthread storm([&] {
    const auto real_ns = [] {
      std::timespec t{};
      ::clock_gettime(CLOCK_REALTIME, &t);
      return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
    };
    std::mt19937 random(7);
    const long long start = real_ns();
    while (!is_over) {
      const double size = std::pow(10.0, -1.4 + 7.4e-3 * static_cast<int>(random() % 1000));
      const long long now = real_ns(), to = now + (now < start ? 1 : -1) * std::llround(1e9 * size);
      const std::timespec t{to / 1'000'000'000, to % 1'000'000'000};
      EXPECT_EQ(::clock_settime(CLOCK_REALTIME, &t), 0);
      std::this_thread::sleep_for(milliseconds(110 + random() % 120));
    }
  });
  {
    const auto thread = pulses(made, 150, milliseconds(50), [&](int i) { is_over = i == 149; });
    got = read(source, decoder);
  }
  EXPECT_LE(lateness(made, got.edges).back(), kLatest);
  EXPECT_GE(got.edges.size(), 120U);
  // Each pulse came, or was refused and shows as lost. (The last ones would show at the next edge.)
  EXPECT_NEAR(static_cast<double>(got.edges.size() + got.faults[FaultKind::Lost]), 150, 3);
  EXPECT_GT(got.faults[FaultKind::ClockStep], 10U);
  GTEST_LOG_(INFO) << got.edges.size() << " of 150 edges placed, " << got.faults[FaultKind::ClockStep] << " steps told";
}

TEST_F(PpsDevice, AnUnpluggedDeviceIsDisconnectedAndOpensAgain) {
  PpsSource source({});
  ASSERT_TRUE(source.open().ok());
  // A module in use cannot be removed, but its device can be taken from under it, as a hot unplug does.
  const std::filesystem::path driver = "/sys/bus/pnp/drivers/parport_pc";
  std::string port;
  for (const auto& entry : std::filesystem::directory_iterator(driver))
    if (entry.is_symlink() && entry.path().filename() != "module") port = entry.path().filename();
  ASSERT_NE(port, "") << "no parallel port below " << driver;
  const int cycles = test::replugs(2);
  std::vector<double> took_s;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    std::ofstream(driver / "unbind") << port << std::flush;
    ASSERT_FALSE(std::filesystem::exists("/dev/pps0"));
    const HostTime unplugged = host_now();
    // Taking the port away may raise a last interrupt.
    auto last = source.next({});
    while ((last.ok() || last.error().code == ErrorCode::TimedOut) && host_now() - unplugged < seconds(5))
      last = source.next({});
    ASSERT_FALSE(last.ok());
    EXPECT_EQ(last.error().code, ErrorCode::Disconnected) << last.error().message;
    EXPECT_EQ(source.open().error().code, ErrorCode::Unavailable);
    std::ofstream(driver / "bind") << port << std::flush;
    const HostTime back = host_now();
    const auto reopened = source.open();
    ASSERT_TRUE(reopened.ok()) << reopened.error().message;
    PpsDecoder decoder({});
    const Pulse made = pulse();
    const Edges seen = read(source, decoder, 1);
    ASSERT_EQ(seen.edges.size(), 1U) << cycle;
    EXPECT_LT(seen.edges[0].edge - made.after, seconds(1));
    took_s.push_back(to_seconds(seen.edges[0].edge - back));
  }
  test::print_returns("PPS", took_s);
}

}  // namespace
}  // namespace hueline::drivers
