#include "survey/depth_edges.hpp"

#include <gtest/gtest.h>

#include "tests/survey/standing_vehicle.hpp"

namespace hueline::survey {
namespace {

using namespace hueline::test;

constexpr double kBoard_deg = 15;  // half the width of a board before a wall
constexpr int kRings = 4;

/// A revolution around t = 0.5 s: the board is at 6 m, the wall at 15 m.
StampedLaserBatch revolution(const StandingVehicle& vehicle) {
  StampedLaserBatch batch;
  batch.sensor = kLaser;
  batch.time = at(0.45);
  for (int step = 0; step < 720; ++step)
    for (int ring = 0; ring < kRings; ++ring) {
      const double azimuth = -180 + 0.5 * step;
      const bool is_board = std::abs(azimuth) < kBoard_deg;
      batch.returns.push_back(vehicle.seen_at(azimuth, -6 + 4 * ring, is_board ? 6 : 15, ring, step * 138'000));
    }
  return batch;
}

DepthEdges::Counts counts_with(double image_turned_deg, const std::function<void(StampedLaserBatch&)>& alter = {}) {
  const StandingVehicle vehicle;
  StampedLaserBatch batch = revolution(vehicle);
  if (alter) alter(batch);
  const Image image = vehicle.image([&](double azimuth, double elevation, int) {
    return std::abs(azimuth - image_turned_deg) < kBoard_deg && std::abs(elevation) < 25 ? 200.0 : 60.0;
  });
  DepthEdges edges(vehicle.rig, {.every = 1});
  vehicle.feed(edges, {batch}, {make_exposure(0, 0.5, image)}, 1.0);
  return edges.finish();
}

TEST(DepthEdges, LieOnImageEdgesIfTheImageIsWhereItIsSaidToBe) {
  const DepthEdges::Counts counts = counts_with(0);
  EXPECT_EQ(counts.exposures, 1u);
  EXPECT_EQ(counts.edges, 2u * kRings) << "the two sides of the board in each ring";
  EXPECT_EQ(counts.missed, 0u);
  EXPECT_EQ(counts.places, 4 * counts.edges);
  EXPECT_EQ(counts.missed_there, counts.places / 2) << "beside the edge there is none; above and below there is";
}

TEST(DepthEdges, AreMissedIfTheImageIsTurned) {
  const DepthEdges::Counts turned = counts_with(10);
  EXPECT_EQ(turned.edges, 2u * kRings);
  EXPECT_EQ(turned.missed, turned.edges);
  EXPECT_EQ(counts_with(1).missed, 0u) << "two pixels are within three";
}

TEST(DepthEdges, AreOnlyWhereNeighbouringRangesDiffer) {
  EXPECT_EQ(counts_with(0,
                        [](StampedLaserBatch& batch) {
                          for (LaserReturn& r : batch.returns)
                            if (r.range_m < 10) r = StandingVehicle().seen_at(0, 0, 15, r.channel, r.time_offset_ns);
                        })
                .edges,
            0u)
      << "a plain wall";
  EXPECT_EQ(counts_with(0,
                        [](StampedLaserBatch& batch) {
                          std::erase_if(batch.returns, [](const LaserReturn& r) { return r.range_m > 10; });
                        })
                .edges,
            0u)
      << "a board before the sky has no second range";
  EXPECT_EQ(counts_with(0,
                        [](StampedLaserBatch& batch) {
                          for (std::size_t i = 0; i < batch.returns.size(); ++i)
                            if (LaserReturn& r = batch.returns[i]; r.range_m < 10)
                              for (float* x : {&r.x, &r.y, &r.z, &r.range_m}) *x *= i / kRings % 4 < 2 ? 1.0f : 1.1f;
                        })
                .edges,
            0u)
      << "leaves in place of the board";
  EXPECT_EQ(counts_with(0, [](StampedLaserBatch& batch) { batch.time += std::chrono::milliseconds(200); }).edges, 0u)
      << "too long after the exposure";
}

TEST(DepthEdges, NeedAnImageThatIsWholeAndTimed) {
  const StandingVehicle vehicle;
  for (const bool is_complete : {true, false}) {
    Exposure exposure = make_exposure(0, 0.5, vehicle.image([](double, double, int) { return 90.0; }));
    exposure.image.is_complete = is_complete;
    DepthEdges edges(vehicle.rig, {.every = 1});
    vehicle.feed(edges, {revolution(vehicle)}, {exposure}, 1.0);
    const DepthEdges::Counts counts = edges.finish();
    EXPECT_EQ(counts.exposures, is_complete ? 1u : 0u);
    EXPECT_EQ(counts.missed, counts.edges) << "a picture without any edge";
    EXPECT_EQ(counts.edges > 0, is_complete);
  }
}

}  // namespace
}  // namespace hueline::survey
