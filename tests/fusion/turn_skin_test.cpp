#include "fusion/turn_skin.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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
  std::vector<TurnSkin::Neighbours> neighbours;
};

/// Points whose cells are numbered as the skin numbers them.
SeenPlaces in_order(const TurnSkin& turn, SeenPlaces seen) {
  const CellOrder order = turn.order();
  for (std::uint32_t& cell : seen.cell) {
    const int row = static_cast<int>(cell) / turn.grid().columns, column = static_cast<int>(cell) % turn.grid().columns;
    cell = static_cast<std::uint32_t>(column * order.per_column + row * order.per_row + order.first);
  }
  return seen;
}

Skin skin_of(TurnSkin& turn, const SeenPlaces& seen) {
  const SeenPlaces ordered = in_order(turn, seen);
  turn.add(ordered);
  Skin skin;
  for (std::size_t i = 0; i < seen.cell.size(); ++i) {
    const auto [index, is_on_skin] = turn.stand_in(ordered.cell[i], seen.nearness[i]);
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

/// The neighbours of each point of the skin: those that add something to the sums if each in turn is counted alone.
std::vector<std::vector<std::uint32_t>> listed(const TurnSkin& turn, const Skin& skin) {
  const std::size_t size = skin.cell.size();
  std::vector<std::vector<std::uint32_t>> out(size);
  std::vector<PresenceCount> counts(size), sums(size);
  // Four at a time, in counts that tell them apart: 1 and 30 of each kind.
  for (std::uint32_t first = 0; first < size; first += 4) {
    constexpr std::array<std::uint32_t, 4> kUnits{1, 30, 1U << 16, 30U << 16};
    for (std::uint32_t k = 0; k < 4 && first + k < size; ++k) counts[first + k].bits = kUnits[k];
    turn.sum_around(skin.neighbours, counts.data(), sums.data());
    for (std::uint32_t i = 0; i < size; ++i)
      for (std::uint32_t k = 0; k < 4; ++k) {
        const std::uint32_t of_kind = k < 2 ? sums[i].free() : sums[i].occupied();
        const bool is_added = (k % 2 == 0 ? of_kind % 30 : of_kind / 30) != 0;
        if (is_added && first + k != i) out[i].push_back(first + k);
      }
    for (std::uint32_t k = 0; k < 4 && first + k < size; ++k) counts[first + k].bits = 0;
  }
  return out;
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
        ASSERT_EQ(skin.neighbours.size(), skin.cell.size());
        const std::vector<std::vector<std::uint32_t>> lists = listed(turn, skin);
        for (std::uint32_t i = 0; i < skin.cell.size(); ++i) {
          const std::vector<std::uint32_t>& found = lists[i];
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

TEST(TurnSkin, SumsWhatWasCountedForAPointAndItsNeighbours) {
  const DirectionGrid grid(kCell);
  TurnSkin turn(grid);
  const Skin skin = skin_of(turn, random_turn(grid, grid.rows / 2, 700, 5));
  std::mt19937 random(6);
  std::vector<PresenceCount> counts(skin.cell.size()), sums(skin.cell.size()), expected;
  for (PresenceCount& count : counts) count.bits = static_cast<std::uint32_t>(random() % 1001 << 16 | random() % 1001);
  const std::vector<std::vector<std::uint32_t>> lists = listed(turn, skin);
  std::size_t neighbours = 0;
  for (std::uint32_t i = 0; i < counts.size(); ++i) {
    expected.push_back(counts[i]);
    for (const std::uint32_t k : lists[i]) expected.back() += counts[k];
    neighbours += lists[i].size();
  }
  EXPECT_GT(neighbours, counts.size());
  // What the skin holds of a later turn changes nothing.
  turn.add(in_order(turn, random_turn(grid, grid.rows / 2, 700, 7)));
  test::with_each_instruction_set([&] {
    turn.sum_around(skin.neighbours, counts.data(), sums.data());
    for (std::size_t i = 0; i < sums.size(); ++i) ASSERT_EQ(sums[i].bits, expected[i].bits) << i;
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
  EXPECT_EQ(listed(used, after), listed(fresh, first));
}

}  // namespace
}  // namespace hueline::fusion
