#include "fusion/turn_skin.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "tests/support/each_instruction_set.hpp"

namespace hueline::fusion {
namespace {

constexpr double kCell = 0.05;

/// A turn with points in cells that are chosen at random from the rows around `middle_row`, at two distances.
SeenPlaces random_turn(const DirectionGrid& grid, int middle_row, std::size_t points, std::uint32_t seed) {
  std::mt19937 random(seed);
  SeenPlaces seen;
  for (std::size_t i = 0; i < points; ++i) {
    const int row = std::clamp(middle_row - 8 + static_cast<int>(random() % 17), 0, grid.rows - 1);
    seen.cell.push_back(static_cast<std::uint32_t>(row * grid.columns) +
                        static_cast<std::uint32_t>(random() % static_cast<unsigned>(grid.columns)));
    const float distance = (random() % 3 == 0 ? 20.0f : 10.0f) + 0.001f * static_cast<float>(random() % 1000);
    seen.nearness.push_back(1 / distance);
  }
  return seen;
}

struct Skin {
  std::vector<std::uint32_t> stands_for;  ///< of each point of the turn
  std::vector<std::uint32_t> cell;        ///< of each point of the skin
  std::vector<float> nearness;
  IndexLists neighbours;
};

Skin skin_of(TurnSkin& turn, const SeenPlaces& seen) {
  turn.add(seen);
  Skin skin;
  for (std::size_t i = 0; i < seen.cell.size(); ++i) {
    const auto [index, is_on_skin] = turn.stand_in(seen.cell[i], seen.nearness[i]);
    EXPECT_LE(index, skin.cell.size());
    if (index == skin.cell.size()) {
      skin.cell.push_back(seen.cell[i]);
      skin.nearness.push_back(0);
    }
    if (is_on_skin) skin.nearness[index] = seen.nearness[i];
    skin.stands_for.push_back(index);
  }
  EXPECT_EQ(turn.size(), skin.cell.size());
  turn.neighbours(skin.neighbours);
  turn.clear();
  EXPECT_EQ(turn.size(), 0U);
  return skin;
}

/// The points of the skin within 5 rows and 2 columns whose nearness differs by 4 % at most.
std::vector<std::uint32_t> beside(const DirectionGrid& grid, const Skin& skin, std::uint32_t point) {
  const auto row = [&](std::uint32_t i) { return static_cast<int>(skin.cell[i]) / grid.columns; };
  const auto column = [&](std::uint32_t i) { return static_cast<int>(skin.cell[i]) % grid.columns; };
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < skin.cell.size(); ++i) {
    const int across = std::abs(column(i) - column(point));
    if (i != point && std::abs(row(i) - row(point)) <= 5 && std::min(across, grid.columns - across) <= 2 &&
        std::abs(skin.nearness[i] - skin.nearness[point]) <= 0.04f * skin.nearness[point])
      out.push_back(i);
  }
  return out;
}

TEST(TurnSkin, HasTheNearestAndTheFarthestPointOfEachCell) {
  const DirectionGrid grid(kCell);
  TurnSkin turn(grid);
  const SeenPlaces seen = random_turn(grid, grid.rows / 2, 5000, 1);
  const Skin skin = skin_of(turn, seen);
  std::vector<float> nearest(grid.size());
  for (std::size_t i = 0; i < seen.cell.size(); ++i)
    nearest[seen.cell[i]] = std::max(nearest[seen.cell[i]], seen.nearness[i]);
  std::size_t farthest = 0;
  for (std::size_t i = 0; i < seen.cell.size(); ++i) {
    const std::uint32_t by = skin.stands_for[i];
    EXPECT_EQ(skin.cell[by], seen.cell[i]);
    // The two distances are a factor of two apart, so each point is stood for by one of its own distance.
    EXPECT_NEAR(1 / skin.nearness[by], 1 / seen.nearness[i], 1.0f);
    const bool is_behind = seen.nearness[i] < 0.07f && nearest[seen.cell[i]] > 0.07f;
    if (is_behind) {
      EXPECT_LE(skin.nearness[by], seen.nearness[i]);
    } else {
      EXPECT_EQ(skin.nearness[by], nearest[seen.cell[i]]);
    }
    farthest += is_behind;
  }
  EXPECT_GT(farthest, 500U);
}

TEST(TurnSkin, ListsTheNeighboursOnTheSameSurface) {
  const DirectionGrid grid(kCell);
  TurnSkin turn(grid);
  test::with_each_instruction_set([&] {
    std::size_t whole = 0, thinned = 0;
    // In the middle, and where the window reaches beyond the lowest and the highest row; sparse and dense.
    for (const int middle_row : {0, grid.rows / 2, grid.rows - 1})
      for (const std::size_t points : {300U, 5000U}) {
        const Skin skin = skin_of(turn, random_turn(grid, middle_row, points, 2));
        ASSERT_EQ(skin.neighbours.first.size(), skin.cell.size() + 1);
        for (std::uint32_t i = 0; i < skin.cell.size(); ++i) {
          std::vector<std::uint32_t> found(skin.neighbours.indices.begin() + skin.neighbours.first[i],
                                           skin.neighbours.indices.begin() + skin.neighbours.first[i + 1]);
          std::sort(found.begin(), found.end());
          const std::vector<std::uint32_t> expected = beside(grid, skin, i);
          if (expected.size() <= TurnSkin::kMostNeighbours) {
            ASSERT_EQ(found, expected) << i;
            whole += !expected.empty();
            continue;
          }
          ASSERT_LE(found.size(), TurnSkin::kMostNeighbours + 1);
          ASSERT_GE(3 * found.size(), TurnSkin::kMostNeighbours);
          ASSERT_TRUE(std::includes(expected.begin(), expected.end(), found.begin(), found.end()));
          ++thinned;
        }
      }
    EXPECT_GT(whole, 100U);
    EXPECT_GT(thinned, 1000U);
  });
}

TEST(TurnSkin, ForgetsTheTurnBefore) {
  const DirectionGrid grid(kCell);
  TurnSkin used(grid), fresh(grid);
  skin_of(used, random_turn(grid, grid.rows / 3, 3000, 3));
  const SeenPlaces seen = random_turn(grid, grid.rows / 2, 3000, 4);
  const Skin after = skin_of(used, seen), first = skin_of(fresh, seen);
  EXPECT_EQ(after.stands_for, first.stands_for);
  EXPECT_EQ(after.nearness, first.nearness);
  EXPECT_EQ(after.neighbours.indices, first.neighbours.indices);
}

}  // namespace
}  // namespace hueline::fusion
