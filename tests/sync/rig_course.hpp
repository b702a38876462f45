#pragma once

#include <gtest/gtest.h>

#include "sync/synchroniser.hpp"
#include "tests/sync/simulated_rig.hpp"

namespace hueline::test {

using sync::Synchroniser;
using sync::SyncOutput;

inline Synchroniser::Config rig_config() {
  Synchroniser::Config c;
  c.clock.pps = kPps;
  c.clock.label.trusted = kPos;
  c.pos = kPos;
  c.lasers.resize(1);
  c.lasers[0].sensor = kLaser;
  c.cameras.resize(1);
  c.cameras[0].camera = kCamera;
  c.cameras[0].strobe_delay = us(20);
  c.hold_images = 400;  // images in tests have no pixels
  c.cameras[0].pending_limit = 400;
  return c;
}

struct Outcome {
  SyncOutput all;
  Synchroniser sync;
  /// `punctual`: images keep latency_max, so that the promise of the watermark holds.
  Outcome(Drive& drive, const Synchroniser::Config& c, bool punctual = true) : sync(c) {
    EXPECT_EQ(c.validate(), "");
    std::optional<GpsTime> watermark;
    for (auto& [received, m] : drive.stream.sorted()) {
      const std::size_t lasers = all.laser.size(), exposures = all.exposures.size();
      sync.process(m, all);
      // The promise on which fusion relies.
      if (watermark) {
        for (std::size_t i = lasers; i < all.laser.size(); ++i) {
          EXPECT_GE(all.laser[i].time, *watermark);
        }
        for (std::size_t i = exposures; punctual && i < all.exposures.size(); ++i) {
          EXPECT_GE(all.exposures[i].exposure_mid, *watermark);
        }
      }
      if (watermark) {
        EXPECT_GE(*sync.watermark(), *watermark);
      }
      watermark = sync.watermark();
    }
    sync.flush(all);
    for (std::size_t i = 0; i < all.exposures.size(); ++i) {
      EXPECT_EQ(all.exposures[i].index, i);
      if (i > 0) {
        EXPECT_LE(all.exposures[i - 1].exposure_mid, all.exposures[i].exposure_mid);
      }
    }
  }
  std::uint64_t count(FaultKind kind) const {
    std::uint64_t n = 0;
    for (const Fault& f : all.faults)
      if (f.kind == kind) n += f.count;
    return n;
  }
};

}  // namespace hueline::test
