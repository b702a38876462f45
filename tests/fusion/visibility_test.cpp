#include "fusion/visibility.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {
using Eigen::Vector3d;

constexpr double kSpeed = 8, kBoxSpeed = 14, kWall_m = 12;
constexpr SensorId kScanner = 3;
GpsTime seen_at(double t) { return GpsTime(from_seconds(1000 + t)); }

/// A scanner with 32 rings that turns ten times a second on a vehicle that drives along a wall in the north. Between
/// them a box drives ahead of the vehicle, faster.
class AlongAWall : public testing::Test {
 protected:
  static bool is_box(const Vector3d& p) { return p.y() < kWall_m - 1; }

  void drive(double seconds) {
    for (; time < seconds; time += 0.01) {
      PlacedBatch batch;
      batch.batch.sensor = kScanner;
      batch.batch.time = batch.last = seen_at(time);
      batch.number = number++;
      const Vector3d from(kSpeed * time, 0, 2);
      batch.placed.scanner_enu = from;
      for (int step = 0; step < 60; ++step) {
        const double azimuth = 2 * std::numbers::pi * (10 * time + step / 600.0);
        for (int ring = 0; ring < 32; ++ring) {
          const double elevation = 0.012 * (ring - 20);
          const Vector3d ray(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                             std::sin(elevation));
          if (ray.y() < 0.3) continue;
          Vector3d hit = from + kWall_m / ray.y() * ray;
          const Vector3d on_box = from + 6 / ray.y() * ray;
          const double box = 2 + kBoxSpeed * time;
          if (on_box.x() > box && on_box.x() < box + 4 && on_box.z() > 0 && on_box.z() < 1.5) hit = on_box;
          batch.placed.east.push_back(hit.x());
          batch.placed.north.push_back(hit.y());
          batch.placed.up.push_back(hit.z());
          batch.placed.places.x.push_back(static_cast<float>(hit.x() - from.x()));
          batch.placed.places.y.push_back(static_cast<float>(hit.y() - from.y()));
          batch.placed.places.z.push_back(static_cast<float>(hit.z() - from.z()));
          batch.placed.source.push_back(0);
        }
      }
      placed.push_back(std::move(batch));
    }
  }
  static Vector3d place(const PlacedBatch& batch, std::size_t i) {
    return {batch.placed.east[i], batch.placed.north[i], batch.placed.up[i]};
  }

  Visibility::Config config;
  WorkerPool pool{2};
  std::deque<PlacedBatch> placed;
  double time = 0;
  std::uint64_t number = 0;
};

TEST(Sightings, TheConfidenceSaysWhetherAPointMovesAndGrowsWithTheBeamsThatGoPast) {
  for (std::uint16_t occupied = 0; occupied < 60; ++occupied) {
    int before = 0;
    for (std::uint16_t free = 0; free < 60; ++free) {
      const Sightings sightings{free, occupied};
      const int confidence = sightings.confidence_of_moving();
      ASSERT_EQ(confidence >= 128, sightings.is_moving()) << free << " of " << free + occupied;
      ASSERT_GE(confidence, before);
      ASSERT_LE(confidence, 255);
      before = confidence;
    }
  }
  EXPECT_TRUE((Sightings{5, 5}).is_moving());
  EXPECT_FALSE((Sightings{4, 5}).is_moving());
  EXPECT_FALSE((Sightings{1, 0}).is_moving()) << "one beam may err";
  constexpr std::uint16_t kMost = 25'000;  // of a point and its neighbours
  EXPECT_EQ((Sightings{kMost, 0}).confidence_of_moving(), 254);
  EXPECT_LT((Sightings{0, kMost}).confidence_of_moving(), 128);
}

TEST_F(AlongAWall, WhatDrivesIsToldFromWhatStands) {
  Visibility visibility(config);
  drive(3);
  visibility.add(placed, true, pool);
  std::size_t box = 0, box_moves = 0, wall = 0, wall_moves = 0;
  for (const PlacedBatch& batch : placed) {
    const auto sighted = visibility.sightings(batch);
    for (std::size_t i = 0; i < batch.placed.size(); ++i) {
      const bool moves = sighted[i].is_moving();
      EXPECT_EQ(moves, sighted[i].confidence_of_moving() >= 128);
      (is_box(place(batch, i)) ? box : wall) += 1;
      (is_box(place(batch, i)) ? box_moves : wall_moves) += moves;
    }
  }
  ASSERT_GT(box, 2000u);
  EXPECT_GT(box_moves, box * 95 / 100);
  EXPECT_LT(wall_moves, wall / 200);
}

TEST_F(AlongAWall, TurnsThatCameInPiecesSayTheSame) {
  Visibility at_once(config), in_pieces(config);
  drive(1.5);
  std::deque<PlacedBatch> given;
  for (const PlacedBatch& batch : placed) {
    given.push_back(batch);
    if (batch.number % 7 == 0) in_pieces.add(given, false, pool);
  }
  // The last turn is not complete yet, so nothing is known of its points.
  EXPECT_EQ(given.back().turn, 0u);
  EXPECT_EQ(in_pieces.sightings(given.back())[0].occupied, 0);
  in_pieces.add(given, true, pool);
  at_once.add(placed, true, pool);
  for (std::size_t b = 0; b < placed.size(); ++b) {
    const auto one = at_once.sightings(placed[b]), other = in_pieces.sightings(given[b]);
    for (std::size_t i = 0; i < placed[b].placed.size(); ++i) {
      ASSERT_EQ(one[i].free, other[i].free);
      ASSERT_EQ(one[i].occupied, other[i].occupied);
    }
  }
}

TEST_F(AlongAWall, TheBoxHidesTheWallOnlyAtItsOwnMoment) {
  Visibility visibility(config);
  drive(3);
  visibility.add(placed, true, pool);
  const auto moment_at = [](double t) {
    Moment moment;
    moment.time = seen_at(t);
    moment.viewpoint = Moment::Viewpoint{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {kSpeed * t, 0, 2.2}, {}, {}};
    return moment;
  };
  Moment with_box = moment_at(1.0), later = moment_at(1.6);
  visibility.map({&with_box, &later}, placed, pool);
  // Places on the wall that lie behind the box, as seen at the first moment.
  std::size_t hidden = 0, clear_later = 0, count = 0;
  for (double x = 2 + kBoxSpeed * 1.0 + 0.7; x < 6 + kBoxSpeed * 1.0 - 0.7; x += 0.1) {
    const Vector3d from = with_box.viewpoint->centre_enu, on_wall = from + 2 * (Vector3d(x, 6, 0.8) - from);
    const auto look = [&](const Moment& moment) {
      const Eigen::Vector3f p = (on_wall - moment.viewpoint->centre_enu).cast<float>();
      SeenPlaces seen;
      locate(visibility.grid(), {moment.viewpoint->R_head_enu, {0, 0, 0}}, {{p.x()}, {p.y()}, {p.z()}}, seen);
      return Visibility::look(moment, seen.cell[0], seen.nearness[0]);
    };
    ++count;
    hidden += look(with_box) == LineOfSight::Hidden;
    clear_later += look(later) == LineOfSight::Clear;
  }
  EXPECT_EQ(hidden, count);
  EXPECT_GT(clear_later, count * 9 / 10);
}

TEST_F(AlongAWall, TheBoxIsKnownToBeWhereItWasBeforeAndAfterAMoment) {
  Visibility visibility(config);
  drive(3);
  visibility.add(placed, true, pool);
  Moment moment;
  const double t = 1.03;
  moment.time = seen_at(t);
  moment.viewpoint = Moment::Viewpoint{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {kSpeed * t, 0, 2.2}, {}, {}};
  visibility.map({&moment}, placed, pool);
  const auto was_met = [&](double x, bool is_after) {
    const Eigen::Vector3f p = (Vector3d(x, 6, 1) - moment.viewpoint->centre_enu).cast<float>();
    SeenPlaces seen;
    locate_cells(visibility.grid(), {moment.viewpoint->R_head_enu, {0, 0, 0}}, {{p.x()}, {p.y()}, {p.z()}}, seen);
    return moment.met.was_met(visibility.grid(), is_after, seen.cell[0], seen.nearness[0], 0.15f, 0.02f);
  };
  // The box drives to the east. Each side lasts 0.11 s, in which the beams meet it once or twice.
  const double back = 2 + kBoxSpeed * t, front = back + 4;
  for (const bool is_after : {false, true}) {
    for (double x = back + 1.6; x < front - 1.6; x += 0.1) EXPECT_TRUE(was_met(x, is_after)) << x << is_after;
    EXPECT_FALSE(was_met(back - 2.5, is_after));
    EXPECT_FALSE(was_met(front + 2.5, is_after));
  }
  EXPECT_FALSE(was_met(back - 0.3, true));
  EXPECT_FALSE(was_met(front + 0.3, false));
}

TEST_F(AlongAWall, ForgetsTurns) {
  Visibility visibility(config);
  drive(2);
  visibility.add(placed, true, pool);
  EXPECT_GT(visibility.sightings(placed[100])[0].occupied, 0);
  visibility.forget_before(seen_at(60));
  EXPECT_EQ(visibility.sightings(placed[100])[0].occupied, 0);
}

}  // namespace
}  // namespace hueline::fusion
