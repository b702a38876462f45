#include "storage/point_octree.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::TemporaryFolder;
using Steps = std::array<std::int32_t, 3>;

/// A record with its number behind the coordinates.
struct NumberedPoint {
  Steps place;
  std::uint32_t number;
};
static_assert(sizeof(NumberedPoint) == 16);

ByteView as_record(const NumberedPoint& point) { return std::as_bytes(std::span(&point, 1)); }

/// A street: a ground, two walls and a pole, `laps` times, with a noise of some millimetres.
std::vector<Steps> street(int laps, int length_m, int points_a_m) {
  std::mt19937 random(5);
  const auto noise = [&] { return static_cast<std::int32_t>(random() % 21) - 10; };
  const auto of = [&](std::int32_t most) { return static_cast<std::int32_t>(random() % static_cast<unsigned>(most)); };
  std::vector<Steps> out;
  for (int lap = 0; lap < laps; ++lap)
    for (int m = 0; m < length_m; ++m)
      for (int i = 0; i < points_a_m; ++i) {
        const std::int32_t x = m * 1000 + of(1000);
        switch (i % 4) {
          case 0:
          case 1:
            out.push_back({x, of(12'000) - 6000, noise()});
            break;
          case 2:
            out.push_back({x, (i & 4 ? 6000 : -6000) + noise(), of(8000)});
            break;
          default:
            out.push_back({m / 20 * 20'000 + noise(), 4000 + noise(), of(5000)});
        }
      }
  return out;
}

/// What came out of an octree.
struct Grown {
  std::vector<std::vector<NumberedPoint>> given;
  std::vector<PointOctree::Node> nodes;
  PointOctree::Cube cube;
  std::uint64_t most_held = 0;
};

Grown grow(const std::vector<Steps>& points, PointOctree::Config config, const TemporaryFolder& folder) {
  config.record_size = sizeof(NumberedPoint);
  config.scratch = folder.path();
  PointOctree tree(config);
  Grown out;
  const auto take = [&] {
    for (const Bytes& records : tree.take()) {
      auto& node = out.given.emplace_back(records.size() / sizeof(NumberedPoint));
      std::memcpy(node.data(), records.data(), records.size());
    }
  };
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const NumberedPoint point{points[i], i};
    EXPECT_TRUE(tree.add(as_record(point)));
    out.most_held = std::max(out.most_held, tree.held_bytes());
    take();
  }
  for (bool has_more = true; has_more;) {
    const Result<bool> finished = tree.finish_some();
    EXPECT_TRUE(finished);
    has_more = finished && *finished;
    take();
  }
  EXPECT_EQ(tree.held_bytes(), 0u);
  out.nodes = tree.nodes();
  out.cube = tree.cube();
  return out;
}

/// Checks that each point is in one node that contains it, `beside` steps more or less, and that all nodes hang
/// together.
void expect_whole(const Grown& grown, const std::vector<Steps>& points, std::int64_t beside = 0) {
  std::vector<bool> seen(points.size());
  std::set<OctreeKey> keys;
  std::set<std::size_t> given;
  ASSERT_FALSE(grown.nodes.empty());
  for (const auto& [key, number] : grown.nodes) {
    EXPECT_TRUE(keys.insert(key).second);
    if (key.level == 0)
      EXPECT_EQ(key, OctreeKey{});
    else
      EXPECT_TRUE(keys.contains({key.level - 1, key.x / 2, key.y / 2, key.z / 2})) << "a node without one above it";
    if (!number) continue;
    ASSERT_TRUE(given.insert(*number).second && *number < grown.given.size());
    const std::int64_t edge = grown.cube.edge >> key.level;
    const std::array<std::int64_t, 3> low{grown.cube.low[0] + key.x * edge, grown.cube.low[1] + key.y * edge,
                                          grown.cube.low[2] + key.z * edge};
    for (const NumberedPoint& point : grown.given[*number]) {
      ASSERT_FALSE(seen.at(point.number)) << "point " << point.number << " is in two nodes";
      seen[point.number] = true;
      EXPECT_EQ(point.place, points[point.number]);
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_GE(point.place[k], low[k] - beside);
        ASSERT_LT(point.place[k], low[k] + edge + beside);
      }
    }
  }
  EXPECT_EQ(given.size(), grown.given.size());
  EXPECT_EQ(std::count(seen.begin(), seen.end(), false), 0);
}

TEST(PointOctree, HasEachPointOnceInANodeThatContainsItWhateverTheMemory) {
  const TemporaryFolder folder;
  const auto points = street(1, 300, 400);
  for (const std::uint64_t memory : {64u << 20, 4u << 20, 1u << 20}) {
    PointOctree::Config config;
    config.node_points = 2000;
    config.held_bytes = memory;
    const Grown grown = grow(points, config, folder);
    expect_whole(grown, points);
    EXPECT_LE(grown.most_held, memory);
    EXPECT_LE(grown.cube.edge, 4 * 300'000) << "the root is not much larger than the street";
    for (const auto& node : grown.given) EXPECT_LE(node.size(), 2 * config.node_points);
  }
}

TEST(PointOctree, TheRootIsAnEvenSampleOfTheWholeCloud) {
  const TemporaryFolder folder;
  const auto points = street(1, 300, 400);
  PointOctree::Config config;
  config.node_points = 2000;
  const Grown grown = grow(points, config, folder);
  const auto cells = [&](const auto& places) {
    std::map<std::array<std::int64_t, 3>, int> out;
    for (const Steps& place : places) {
      std::array<std::int64_t, 3> cell;
      for (std::size_t k = 0; k < 3; ++k) cell[k] = (place[k] - grown.cube.low[k]) * 128 / grown.cube.edge;
      ++out[cell];
    }
    return out;
  };
  ASSERT_TRUE(!grown.nodes.empty() && grown.nodes.front().given);
  std::vector<Steps> sample;
  for (const NumberedPoint& point : grown.given[*grown.nodes.front().given]) sample.push_back(point.place);
  EXPECT_LT(sample.size(), points.size() / 50);
  const auto of_all = cells(points), of_root = cells(sample);
  EXPECT_EQ(of_root.size(), of_all.size()) << "each cell of the grid has a point";
  for (const auto& [cell, count] : of_root) EXPECT_LE(count, 8) << "one of its own, and a few of the cubes above it";
}

TEST(PointOctree, AStreetThatIsDrivenOftenKeepsItsNodesLarge) {
  const TemporaryFolder folder;
  constexpr int kLaps = 40;
  const auto points = street(kLaps, 60, 400);  // 24 000 points a lap
  PointOctree::Config config;
  config.node_points = 2000;
  config.held_bytes = 2u << 20;
  const Grown grown = grow(points, config, folder);
  expect_whole(grown, points);
  EXPECT_LE(grown.most_held, config.held_bytes);
  EXPECT_LT(grown.given.size(), points.size() / 100) << "100 points a node in the mean, where 2000 would be full";
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "nothing stays of the scratch file";
}

TEST(PointOctree, TakesPointsThatAllHaveOnePlace) {
  const TemporaryFolder folder;
  PointOctree::Config config;
  config.node_points = 10;
  const std::vector<Steps> points(5000, Steps{-7, 1'000'000, 3});
  expect_whole(grow(points, config, folder), points, 4 * 32);
}

TEST(PointOctree, TakesTheWholeRangeOfCoordinates) {
  const TemporaryFolder folder;
  constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min(), kMost = -(kLeast + 1);
  std::vector<Steps> points;
  for (int i = 0; i < 200; ++i)
    for (const std::int32_t x : {kLeast, 0, kMost})
      for (const std::int32_t z : {kLeast + i, kMost - i}) points.push_back({x, i, z});
  PointOctree::Config config;
  config.node_points = 20;
  expect_whole(grow(points, config, folder), points);
  for (const Steps& only : {Steps{kLeast, kMost, 0}, Steps{0, 0, 0}})
    expect_whole(grow({only}, config, folder), {only});
}

TEST(PointOctree, AnOctreeOfOnePlaceIsSmall) {
  const TemporaryFolder folder;
  const Grown grown = grow({{1000, 1000, 1000}, {1009, 1000, 1000}}, {}, folder);
  ASSERT_EQ(grown.nodes.size(), 1u);
  EXPECT_LE(grown.cube.edge, 64);
}

TEST(PointOctree, ACubeIsACubeThoughTheScalesDiffer) {
  const TemporaryFolder folder;
  PointOctree::Config config;
  config.record_size = sizeof(NumberedPoint);
  config.node_points = 50;
  config.scale = {0.01, 0.01, 0.001};
  config.scratch = folder.path();
  PointOctree tree(config);
  std::mt19937 random(1);
  std::vector<Steps> points;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    points.push_back({static_cast<std::int32_t>(random() % 20'000), static_cast<std::int32_t>(random() % 20'000),
                      static_cast<std::int32_t>(random() % 30'000)});
    const NumberedPoint point{points.back(), i};
    ASSERT_TRUE(tree.add(as_record(point)));
  }
  while (*tree.finish_some()) {
  }
  const auto given = tree.take();
  const PointOctree::Cube cube = tree.cube();
  EXPECT_EQ(cube.step, 0.01);
  for (const auto& [key, number] : tree.nodes()) {
    if (!number) continue;
    const double edge = static_cast<double>(cube.edge >> key.level) * cube.step;
    const std::array<std::uint32_t, 3> cell{key.x, key.y, key.z};
    for (std::size_t at = 0; at < given[*number].size(); at += sizeof(NumberedPoint)) {
      NumberedPoint point;
      std::memcpy(&point, given[*number].data() + at, sizeof point);
      for (std::size_t k = 0; k < 3; ++k) {
        const double low = static_cast<double>(cube.low[k]) * cube.step + cell[k] * edge;
        ASSERT_GE(point.place[k] * config.scale[k], low - 1e-6);
        ASSERT_LT(point.place[k] * config.scale[k], low + edge + 1e-6);
      }
    }
  }
}

TEST(PointOctree, SaysThatItsScratchFileCannotBeWritten) {
  PointOctree::Config config;
  config.record_size = sizeof(NumberedPoint);
  config.node_points = 2000;
  config.held_bytes = 1u << 20;
  config.scratch = "/nonexistent";
  PointOctree tree(config);
  Status status;
  std::uint32_t number = 0;
  for (const Steps& place : street(20, 60, 400)) {
    const NumberedPoint point{place, number++};
    if (!(status = tree.add(as_record(point)))) break;
    tree.take();
  }
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_NE(status.error().message.find("scratch file in /nonexistent"), std::string::npos);
  EXPECT_FALSE(tree.finish_some()) << "the error is remembered";
}

}  // namespace
}  // namespace hueline::storage
