#pragma once

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "sync/exposure_matcher.hpp"
#include "tests/sync/simulated_rig.hpp"

namespace hueline::test {

using sync::ExposureMatcher;

inline ExposureMatcher::Config matcher_config() {
  ExposureMatcher::Config c;
  c.camera = kCamera;
  c.strobe_delay = us(20);
  return c;
}

/// A camera with a perfect host clock, to test the matching alone.
struct CameraCourse {
  std::vector<Exposure> out;
  std::vector<Fault> faults;
  ExposureMatcher matcher;
  const SimulatedCamera& camera;

  CameraCourse(Drive& drive, SimulatedCamera& simulated, ExposureMatcher::Config config = matcher_config())
      : matcher(config), camera(simulated) {
    EXPECT_EQ(config.validate(), "");
    simulated.run(drive);
    // Inverts the host clock by bisection, so the result is truth and not an estimate.
    const auto gps = [&](HostTime h) {
      GpsTime low = drive.begin - seconds(10), high = drive.begin + seconds(3600);
      while (high - low > nanoseconds(1)) {
        const GpsTime middle = low + (high - low) / 2;
        (drive.clock.host(middle) < h ? low : high) = middle;
      }
      return high;
    };
    GpsTime last{};
    for (auto& [received, m] : drive.stream.sorted()) {
      const GpsTime now = gps(received);
      if (auto* image = std::get_if<Image>(&m)) matcher.add(*image, sync::GpsStamp{now, us(2), SyncState::Locked}, out);
      if (auto* mark = std::get_if<EventMark>(&m)) matcher.add(*mark, out);
      matcher.advance(now, received, out);
      matcher.drain(faults);
      last = now;
    }
    matcher.flush(out);
    matcher.drain(faults);
    check();
  }
  void check() const {
    std::set<std::uint64_t> images;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const Exposure& e = out[i];
      EXPECT_TRUE(images.insert(e.image.packet_sequence).second) << "an image came out twice";
      if (i > 0) {
        EXPECT_GE(e.exposure_mid, out[i - 1].exposure_mid);
      }
      const double error =
          std::abs(static_cast<double>((e.exposure_mid - camera.truth.at(e.image.packet_sequence)).count()));
      // A wrong mark would give an error of one interval with a sigma of a microsecond. This must never happen.
      EXPECT_LE(error, 5 * static_cast<double>(e.sigma.count())) << "exposure " << i << " " << name(e.timing);
      if (e.timing == ExposureTiming::EventMark) {
        EXPECT_EQ(error, 0) << "exposure " << i;
      }
    }
    const auto& c = matcher.counts();
    EXPECT_EQ(c.images, out.size() + c.repeated_images + c.late_images) << "an image was lost silently";
    EXPECT_EQ(c.by_mark + c.by_camera_clock + c.unmatched, out.size());
  }
  std::uint64_t count(FaultKind kind) const {
    std::uint64_t n = 0;
    for (const Fault& f : faults)
      if (f.kind == kind) n += f.count;
    return n;
  }
  const ExposureMatcher::Counts& counts() const { return matcher.counts(); }
};

}  // namespace hueline::test
