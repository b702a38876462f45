#include "tests/fusion/test_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <span>
#include <utility>

namespace hueline::test {
using namespace fusion;

Image ramp_image(double blue) {
  return make_image(306, 6 * 256, PixelFormat::Rgb8, [blue](std::uint32_t x, std::uint32_t y, int c) {
    return c == 0 ? 0.8 * x : c == 1 ? 0.9 * (y % 256) : blue;
  });
}

Image flat_image(double red, double green, double blue) {
  return make_image(306, 6 * 256, PixelFormat::BayerRG8, [=](std::uint32_t, std::uint32_t, int c) {
    return c == 0 ? red : c == 1 ? green : blue;
  });
}

double exposure_time(int index) { return kFirstExposure + kInterval * index; }

Outcome run(const TestDrive& test) {
  Outcome outcome;
  double now = 0;
  const auto wait = [&now](const CloudBlock& block, double& longest) {
    for (const ColouredPoint& p : block.points)
      if (p.exposure != kNoExposure) longest = std::max(longest, now - to_seconds(p.time - at(0)));
  };
  Colouring colouring(test.config, test.rig, [&](const CloudBlock& block) {
    outcome.origin = block.origin;
    wait(block, outcome.longest_wait_s);
    outcome.points.insert(outcome.points.end(), block.points.begin(), block.points.end());
  });
  colouring.set_sight_sink([&](const CloudBlock&, std::span<const JudgedSight> sights) {
    for (const JudgedSight& sight : sights) outcome.judged.insert(outcome.points.size() + sight.point);
  });
  if (test.is_provisional)
    colouring.set_provisional_sink([&](const CloudBlock& block) {
      wait(block, outcome.longest_provisional_wait_s);
      outcome.provisional.insert(outcome.provisional.end(), block.points.begin(), block.points.end());
    });
  std::vector<StampedLaserBatch> batches;
  std::map<std::pair<SensorId, std::uint64_t>, std::vector<Vector3>> truth;
  for (const LaserMount& laser : test.rig.lasers) {
    std::vector<Vector3> hits;
    for (StampedLaserBatch& batch : scan(test.drive, laser, 0.2, test.until, test.packet_rate, test.per_batch, &hits)) {
      const auto first = hits.begin() + static_cast<std::ptrdiff_t>(batch.packet_sequence) * test.per_batch;
      truth[{batch.sensor, batch.packet_sequence}].assign(first, first + test.per_batch);
      batches.push_back(std::move(batch));
    }
  }
  std::stable_sort(batches.begin(), batches.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  for (const StampedLaserBatch& batch : batches) {
    const auto& hits = truth.at({batch.sensor, batch.packet_sequence});
    outcome.truth_base.insert(outcome.truth_base.end(), hits.begin(), hits.end());
  }
  std::size_t next_batch = 0;
  int next_exposure = 0;
  const int ticks = static_cast<int>((test.until + 0.3) * 200);
  for (int i = 0; i <= ticks; ++i) {
    const double t = i / 200.0;
    now = t;
    if (test.has_solution(t)) colouring.add(test.drive.solution(t));
    while (next_batch < batches.size() && batches[next_batch].time < at(t)) colouring.add(batches[next_batch++]);
    const double mid = exposure_time(next_exposure);
    if (mid + 0.08 < t) {
      if (std::find(test.lost.begin(), test.lost.end(), next_exposure) == test.lost.end()) {
        Exposure exposure = make_exposure(static_cast<std::uint32_t>(next_exposure), mid, test.image(next_exposure));
        test.alter(exposure);
        colouring.add(exposure);
      }
      ++next_exposure;
    }
    colouring.advance(at(std::min(t, exposure_time(next_exposure))));  // no exposure comes from before
  }
  colouring.flush();
  outcome.counts = colouring.counts();
  outcome.faults = colouring.take_faults();
  return outcome;
}

Vector3 in_head_at(const TestDrive& test, const Vector3& p_base, double t) {
  const Vector3 p_body = test.drive.motion().R_base_body(t).transpose() * (p_base - test.drive.motion().position(t));
  const auto& mount = test.rig.head.T_body_head;
  return mount.rotation.toRotationMatrix().transpose() * (p_body - mount.translation);
}

bool true_pixel(const TestDrive& test, const Vector3& p_base, int exposure, int lens, Eigen::Vector2d& pixel,
                double onto_sphere) {
  Vector3 p_head = in_head_at(test, p_base, exposure_time(exposure));
  if (onto_sphere > 0) p_head *= onto_sphere / p_head.norm();
  return project_truth(test.rig.head.lenses[static_cast<std::size_t>(lens)], p_head, pixel);
}

std::uint64_t count_state(const Outcome& out, ColourState state) {
  return out.counts.by_state[static_cast<std::size_t>(state)];
}

void expect_every_return_accounted_for(const Outcome& out) {
  const fusion::ColouringCounts& c = out.counts;
  const std::uint64_t no_pose = std::accumulate(c.no_pose.begin(), c.no_pose.end(), std::uint64_t{0});
  EXPECT_EQ(c.returns,
            c.points + no_pose + c.late_returns + c.empty_returns + c.unknown_laser_returns + c.pending_returns);
  EXPECT_EQ(c.points, out.points.size());
  EXPECT_EQ(c.points, std::accumulate(c.by_state.begin(), c.by_state.end(), std::uint64_t{0}));
  EXPECT_EQ(c.pending_returns, 0u);
  EXPECT_EQ(c.exposures, c.exposures_used + c.exposures_unmatched + c.exposures_incomplete + c.exposures_wrong_size +
                             c.exposures_late + c.exposures_unknown_camera);
}

}  // namespace hueline::test
