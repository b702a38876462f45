#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fusion/direction_grid.hpp"

/// Finds the skin of a scanner's turn (docs/methods/visibility.md).
namespace hueline::fusion {

/// A list of indices for each of many points: those of point i from first[i] to the next.
struct IndexLists {
  std::vector<std::uint32_t> first, indices;
};

/// The nearest and, where it lies farther by more than a tenth, the farthest point of a turn in each cell of a grid.
/// They stand for all other points of the turn. For each turn, first all points are added, then each of them asks who
/// stands for it, then neighbours() and clear() are called. The object is used for many turns, because it is larger
/// than what one turn changes in it. Thread safety: none.
class TurnSkin {
 public:
  explicit TurnSkin(const DirectionGrid& grid);
  const DirectionGrid& grid() const { return grid_; }
  /// Adds points that locate() found from where the scanner was in the middle of the turn.
  void add(const SeenPlaces& seen);
  struct Standing {
    std::uint32_t index;  ///< of the skin's point that stands for this one; new indices come in sequence
    bool is_on_skin;      ///< whether this is the skin's point itself
  };
  /// Returns who stands for a point. It was added before.
  Standing stand_in(std::uint32_t cell, float nearness);
  /// Returns the number of the skin's points.
  std::size_t size() const { return cells_.size(); }
  static constexpr std::size_t kMostNeighbours = 24;
  /// Lists for each point of the skin those in the cells around it that are as far away: those of the same surface. Of
  /// more than kMostNeighbours, every second or third. Uses the widest vector instructions that the processor has; all
  /// list the same.
  void neighbours(IndexLists& out) const;
  /// Ends the turn.
  void clear();

 private:
  /// Returns the place of a cell's nearest point in nearness_ and index_. That of its farthest is height_ later.
  std::size_t place_of(std::uint32_t cell) const {
    const std::uint32_t row = cell / columns_, column = cell % columns_;
    return 2 * column * height_ + row + kAround;
  }
  static constexpr std::size_t kAround = 8;  ///< empty cells below and above each column, so that windows may reach out

  DirectionGrid grid_;
  std::uint32_t columns_;
  std::size_t height_;
  /// For each column its nearest points from below upwards, then its farthest. A window around a point lies in few
  /// columns, so in few pages of memory.
  std::vector<float> nearness_;       // 0: no point
  std::vector<std::uint32_t> index_;  // of the skin's point
  std::vector<std::uint32_t> cells_;  // of each point of the skin
};

}  // namespace hueline::fusion
