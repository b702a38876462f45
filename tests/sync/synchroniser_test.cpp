#include "sync/synchroniser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/simulated_rig.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;

Synchroniser::Config config() {
  Synchroniser::Config c;
  c.clock.pps = kPps;
  c.clock.label.trusted = kPos;
  c.pos = kPos;
  c.lasers.resize(1);
  c.lasers[0].sensor = kLaser;
  c.cameras.resize(1);
  c.cameras[0].camera = kCamera;
  c.cameras[0].strobe_delay = us(20);
  c.hold_images = 400;  // a test's images have no pixels
  c.cameras[0].pending_limit = 400;
  return c;
}

struct Outcome {
  SyncOutput all;
  Synchroniser sync;
  Outcome(Drive& drive, const Synchroniser::Config& c) : sync(c) {
    EXPECT_EQ(c.validate(), "");
    std::optional<GpsTime> watermark;
    for (auto& [received, m] : drive.stream.sorted()) {
      const std::size_t lasers = all.laser.size(), exposures = all.exposures.size();
      sync.process(m, all);
      // The promise that fusion builds on.
      if (watermark) {
        for (std::size_t i = lasers; i < all.laser.size(); ++i) { EXPECT_GE(all.laser[i].time, *watermark); }
        for (std::size_t i = exposures; i < all.exposures.size(); ++i) { EXPECT_GE(all.exposures[i].exposure_mid, *watermark); }
      }
      if (watermark) { EXPECT_GE(*sync.watermark(), *watermark); }
      watermark = sync.watermark();
    }
    sync.flush(all);
    for (std::size_t i = 0; i < all.exposures.size(); ++i) {
      EXPECT_EQ(all.exposures[i].index, i);
      if (i > 0) { EXPECT_LE(all.exposures[i - 1].exposure_mid, all.exposures[i].exposure_mid); }
    }
  }
  std::uint64_t count(FaultKind kind) const {
    std::uint64_t n = 0;
    for (const Fault& f : all.faults)
      if (f.kind == kind) n += f.count;
    return n;
  }
};

TEST(Synchroniser, GivenAWholeRigWhenItDrivesThenEverythingIsStampedToMicroseconds) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20));
  drive.ins(50, late(4, 2));
  SimulatedLaser laser;
  laser.run(drive);
  SimulatedCamera camera;
  camera.run(drive);
  Outcome outcome(drive, config());

  ASSERT_EQ(outcome.all.laser.size(), laser.truth.size());
  for (const StampedLaserBatch& b : outcome.all.laser) {
    EXPECT_LE(std::abs((b.time - laser.truth.at(b.packet_sequence)).count()), 1000);  // its own microseconds, cut off
    EXPECT_EQ(b.state, SyncState::Locked);
  }
  ASSERT_EQ(outcome.all.exposures.size(), camera.truth.size());
  for (const Exposure& e : outcome.all.exposures) {
    EXPECT_EQ(e.timing, ExposureTiming::EventMark) << e.index;
    EXPECT_EQ(e.exposure_mid, camera.truth.at(e.image.packet_sequence));
  }
  EXPECT_EQ(outcome.all.ins.size(), 2963u);  // 59.25 s at 50 Hz
  ASSERT_GE(outcome.all.state_changes.size(), 1u);
  EXPECT_EQ(outcome.all.state_changes.back().to, SyncState::Locked);
  for (const Fault& f : outcome.all.faults) ADD_FAILURE() << name(f.kind) << " " << f.detail;
}

}  // namespace
}  // namespace hueline::sync
