#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/beam_map.hpp"
#include "fusion/direction_grid.hpp"

/// Finds the skin of a scanner's turn (docs/methods/visibility.md).
namespace hueline::fusion {

/// The nearest and, where it lies farther by more than a tenth, the farthest point of a turn in each cell of a grid.
/// They stand for all other points of the turn. For each turn, first all points are added, then each of them asks who
/// stands for it, then neighbours() and clear() are called. The object is used for many turns, because it is larger
/// than what one turn changes in it. Thread safety: none but for sum_around().
class TurnSkin {
 public:
  explicit TurnSkin(const DirectionGrid& grid);
  const DirectionGrid& grid() const { return grid_; }
  /// How the skin numbers the cells of its grid: column by column, with room between.
  CellOrder order() const {
    const auto height = static_cast<std::int32_t>(height_);
    return {2 * height, 1, static_cast<std::int32_t>(kAround) + kBesideColumns * 2 * height};
  }
  /// Adds points that locate_cells() found in order() from where the scanner was in the middle of the turn.
  void add(const SeenPlaces& seen);
  struct Standing {
    std::uint32_t index;  ///< of the skin's point that stands for this one; new indices come in sequence
    bool is_on_skin;      ///< whether this is the skin's point itself
  };
  /// Returns who stands for a point. It was added before.
  Standing stand_in(std::uint32_t cell, float nearness) {
    const float near = nearness_[cell], far = nearness_[cell + height_];
    const bool is_far = far < kSameLayer * near && nearness * nearness < near * far;
    std::uint32_t& index = index_[is_far ? cell + height_ : cell];
    if (index == kNoPoint) {
      index = static_cast<std::uint32_t>(cells_.size());
      cells_.push_back(cell);
    }
    return {index, nearness == (is_far ? far : near)};
  }
  /// Returns the number of the skin's points.
  std::size_t size() const { return cells_.size(); }

  static constexpr std::size_t kMostNeighbours = 24;
  /// Points of a skin are of one surface if their cells are this near, and their nearness differs by a twenty-fifth at
  /// most.
  static constexpr int kBesideRows = 5, kBesideColumns = 2;
  /// The nearest and the farthest points of the columns around a point.
  static constexpr std::size_t kStrips = 2 * (2 * kBesideColumns + 1);
  /// The points around one of the skin that are of the same surface.
  struct Neighbours {
    std::uint32_t own;    ///< the place of the point itself
    std::uint32_t first;  ///< the lowest place of the first strip; that of the next strip is a column's height later
    /// For each strip a bit for each of its 2 kBesideRows + 1 places from below upwards: whether a neighbour is there.
    std::array<std::uint16_t, kStrips> strips;
  };
  /// Finds for each point of the skin those in the cells around it that are as far away: those of the same surface. Of
  /// more than kMostNeighbours, every second or third. Uses the widest vector instructions that the processor has; all
  /// find the same.
  void neighbours(std::vector<Neighbours>& out);
  /// Sums for each point of a skin what was counted for it and for its neighbours. `around` is what neighbours() found
  /// in this turn or in an earlier one. `counts` and `sums` have an element for each of the skin's points. May be
  /// called by many threads.
  void sum_around(std::span<const Neighbours> around, const PresenceCount* counts, PresenceCount* sums) const;
  /// Ends the turn.
  void clear();

 private:
  static constexpr std::size_t kAround = 8;  ///< empty cells below and above each column, so that windows may reach out
  static constexpr std::size_t kWidest = 16;  ///< lanes of a vector
  static constexpr float kSameLayer = 0.9f;   ///< of the nearness: points of a cell within this are of one surface
  static constexpr std::uint32_t kNoPoint = 0xFFFFFFFFU;

  std::size_t places() const { return nearness_.size(); }
  /// Repeats the columns at one end beside those at the other, for windows that go around.
  template <class T>
  void go_around(T* of_places) const;

  DirectionGrid grid_;
  std::size_t height_;
  /// For each column its nearest points from below upwards, then its farthest. A window around a point lies in few
  /// columns, so in few pages of memory. Beside the first and the last column lie kBesideColumns of the other end.
  std::vector<float> nearness_;       // 0: no point
  std::vector<std::uint32_t> index_;  // of the skin's point
  std::vector<std::uint32_t> cells_;  // of each point of the skin: the place of the nearest point in its cell
};

}  // namespace hueline::fusion
