#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/buffer.hpp"
#include "core/calendar.hpp"
#include "drivers/pps/ptp_packet.hpp"
#include "sync/host_clock_model.hpp"

// A rig whose time comes from a PTP clock alone: from its keys to a locked clock of the computer.
namespace hueline::config {
namespace {

using std::chrono::seconds;

constexpr const char* kRig = R"(rig: a computer on PTP
sensors:
  - {name: pps, driver: pps, ptp: {device: /dev/ptp0, scale: SCALE}}
  - name: scanner
    driver: velodyne
    model: VLP-16
    udp: {ports: [2368]}
    T_body_scanner: {position_m: [0, 0, 1.9], rotation_deg: [0, 0, 0]}
colouring: {method: lens}
)";

/// The computer's clock runs 20 ppm fast of the PTP clock, which shows `scale_s` more than GPS time.
struct Truth {
  GpsTime begin = *from_utc({2026, 3, 1, 12, 0, 0, 0});
  HostTime host(GpsTime t) const {
    return HostTime(seconds(5000) + nanoseconds(std::llround(static_cast<double>((t - begin).count()) * (1 + 20e-6))));
  }
};

void expect_locked(const std::string& scale, nanoseconds ahead_of_gps) {
  std::string text = kRig;
  text.replace(text.find("SCALE"), 5, scale);
  const Rig rig = parse_rig(text, "rig.yaml", drivers::device_types());
  const auto decoder = rig.sensors[0].device->make_decoder();
  sync::HostClockModel clock(rig.sync.clock);
  const Truth truth;
  std::mt19937 random(1);
  std::vector<Measurement> out;
  for (int i = 0; i < 30; ++i) {
    const GpsTime second = truth.begin + seconds(i);
    const nanoseconds after(200'000 + random() % 2'000'000), half_window(100 + random() % 400);
    const nanoseconds error(static_cast<std::int64_t>(random() % 200) - 100);
    const drivers::PtpPacket reading{half_window, static_cast<std::uint64_t>(i + 1),
                                     second.time_since_epoch() + ahead_of_gps + after,
                                     truth.host(second + after) + error};
    out.clear();
    decoder->decode(
        {.sensor = rig.sensors[0].id, .received = reading.host, .bytes = Buffer::copy_of(drivers::encode_ptp(reading))},
        out);
    ASSERT_EQ(out.size(), 2u);
    clock.add(std::get<PpsEdge>(out[0]));
    clock.add(std::get<TimeLabel>(out[1]));
    clock.advance(reading.host);
  }
  EXPECT_EQ(clock.state(), SyncState::Locked) << clock.why_not();
  const GpsTime now = truth.begin + std::chrono::milliseconds(29'700);
  const auto stamp = clock.stamp(truth.host(now));
  ASSERT_TRUE(stamp.has_value());
  EXPECT_LT(std::abs((stamp->time - now).count()), 500) << "ns";
}

TEST(PtpRig, LocksByAClockOfTai) { expect_locked("tai", seconds(315'964'819)); }
TEST(PtpRig, LocksByAClockOfUtc) { expect_locked("utc", seconds(315'964'800 - 18)); }

TEST(PtpRig, ItsLabelsAreHeardBesideThoseOfThePos) {
  std::string text = kRig;
  text.replace(text.find("SCALE"), 5, "tai");
  const Rig alone = parse_rig(text, "rig.yaml", drivers::device_types());
  EXPECT_THAT(alone.sync.label_sources, testing::ElementsAre(1));
  text.insert(text.find("colouring"), "  - {name: pos, driver: novatel, tcp: {host: 192.168.1.10, port: 3001}}\n");
  const Rig with_pos = parse_rig(text, "rig.yaml", drivers::device_types());
  EXPECT_THAT(with_pos.sync.label_sources, testing::UnorderedElementsAre(1, 3));
  EXPECT_EQ(with_pos.sync.clock.label.trusted, 3);
}

}  // namespace
}  // namespace hueline::config
