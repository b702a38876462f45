#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "fusion/coded_nearness.hpp"
#include "fusion/direction_grid.hpp"

/// What was before the head at one exposure, as far as laser points say.
namespace hueline::fusion {

/// What the laser points say about the line of sight from the head to a place. A larger value is more certain.
enum class LineOfSight : std::uint8_t {
  Hidden,     ///< something nearer is in front of the place
  Covered,    ///< few points are in front of the place, but one of them in its own cell
  Behind,     ///< a surface that the points suggest is in front of the place, but none of the points
  Beside,     ///< something nearer ends less than one cell beside the line
  Unwatched,  ///< nothing nearer lies within the guard, but no beam watched the line at the moment
  Guarded,    ///< something nearer ends within the guard around the line
  Clear,      ///< nothing nearer lies within the guard
};

/// The distances at which laser points lie, as the lenses of a head see them, in the cells of a DirectionGrid. Each
/// cell keeps the nearest point. close() then closes the gaps between the points of a surface and marks the cells
/// beside the outline of something nearer.
///
/// Gaps are closed as mathematical morphology closes images: a window is as near as its nearest point, and a cell is as
/// far as the farthest window that contains it. So a gap that is narrower than a window is filled, a plane stays what
/// it is, and outlines do not grow. Within 15 degrees of straight up and straight down, gaps are closed less.
///
/// Each direction is seen from the lens whose axis is nearest (RelativeHead::eyes). Where the parts of two lenses meet,
/// what is nearer than a few metres lies beside its continuation by the parallax of the two.
///
/// Thread safety: one thread adds and closes; look() and meets() may then be called by many.
class DepthMap {
 public:
  struct Config {
    double cell = 0.0075;           ///< width of a cell, rad
    double gap = 0.02;              ///< a window reaches this far to each side, rad
    double guard = 0.02;            ///< how far from an outline a line of sight is within the guard, rad
    double tolerance_m = 0.15;      ///< a place is behind a point if it is farther by this
    double tolerance_share = 0.02;  ///< and by this share of its distance
    /// Nearer points are left out, m. They are the own vehicle's, which masks describe, and the lenses see them
    /// elsewhere.
    double nearest_m = 1.5;
    bool operator==(const Config&) const = default;
  };

  /// The memory of maps that are gone, for the next ones: of it they clear what held something, which takes a fraction
  /// of the time of memory that the system hands out anew. It has room for as many maps as there ever were at a time.
  /// Thread safety: maps that share it may be made and destroyed by many threads.
  class Memory;
  static std::shared_ptr<Memory> make_memory();

  /// A map of nothing. Without `memory` it has its own.
  explicit DepthMap(const Config& config, std::shared_ptr<Memory> memory = {});
  const DirectionGrid& grid() const { return grid_; }
  /// Adds a point that locate() found.
  void add(std::uint32_t cell, float nearness) {
    const CodedNearness code = coded(nearness);
    if (code <= nearest_[cell] || nearness > most_) return;
    nearest_[cell] = code;
    strips_[cell / kStrip] = kChanged;
    is_closed_ = false;
  }
  /// Adds those of many points that locate_cells() found for which `is_wanted(index)` is true. It is asked only about
  /// points that are nearer than all that were added to their cells before.
  template <class IsWanted>
  void add(const SeenPlaces& seen, const IsWanted& is_wanted) {
    for (const std::uint32_t i : nearer(seen))
      if (is_wanted(i)) add(seen.cell[i], seen.nearness[i]);
  }
  /// Closes the gaps and finds the outlines of what was added until now, in the parts of the map where something was
  /// added since the last call. look() and meets() do not know of later points.
  void close();
  /// Asks for the memory that look() and meets() will read for a place in a cell. Maps are larger than caches.
  void prefetch(std::uint32_t cell) const { __builtin_prefetch(&bounds_[cell]); }
  /// The same for what look_around() will read.
  void prefetch_around(std::uint32_t cell) const {
    const auto columns = static_cast<std::uint32_t>(grid_.columns), last = static_cast<std::uint32_t>(grid_.size()) - 1;
    __builtin_prefetch(&nearest_[cell - std::min(cell, columns)]);
    __builtin_prefetch(&nearest_[cell]);
    __builtin_prefetch(&nearest_[std::min(cell + columns, last)]);
  }
  /// Returns what is known about the line of sight to a place that locate() found. A place behind the surface of its
  /// own cell is Behind.
  LineOfSight look(std::uint32_t cell, float nearness) const {
    const Bounds& bounds = bounds_[cell];
    const float here = nearness * share_, slack = 1.0f - tolerance_ * nearness;
    const auto is_before = [&](CodedNearness bound) { return decoded(bound) * slack > here; };
    if (!is_before(bounds.guarded) && !is_before(bounds.own)) return LineOfSight::Clear;
    if (is_before(bounds.whole)) return LineOfSight::Hidden;
    if (is_before(bounds.own)) return LineOfSight::Behind;
    return is_before(bounds.beside) ? LineOfSight::Beside : LineOfSight::Guarded;
  }
  /// The same for a map that many turns have filled: there, what the points themselves say of a place behind a closed
  /// surface. Gaps that were closed may be gaps, as between leaves, and in them a place is seen.
  LineOfSight look_among_points(std::uint32_t cell, float nearness) const {
    const LineOfSight closed = look(cell, nearness);
    return closed <= LineOfSight::Behind ? judge_points(cell, nearness, closed) : closed;
  }
  /// Returns the nearness of the closed surface in a cell, 1/m.
  float surface(std::uint32_t cell) const { return decoded(bounds_[cell].own); }
  /// Returns the nearness of the nearest point in a cell, 1/m, of those that were added.
  float nearest_point(std::uint32_t cell) const { return decoded(nearest_[cell]); }
  /// What the points in a place's own cell and the eight around it say of the place.
  struct Around {
    float nearest = 0;       ///< the nearness of the nearest of them, 1/m; 0: there is none
    bool is_before = false;  ///< whether the nearest point of the own cell is before the place, as look() means it
    int before = 0;          ///< cells whose nearest point is, the own one among them
    int there = 0;           ///< cells whose nearest point is neither before the place nor far behind it
  };
  /// The same as above for the points that were added, of a place that locate() found.
  Around look_around(std::uint32_t cell, float nearness) const;
  /// Whether no point lies in the direction of a cell, nor so near to it that the gap would be closed.
  bool is_blank(std::uint32_t cell) const { return bounds_[cell].own == 0; }
  /// Whether the nearest points in the direction of a place that locate() found are as far as the place itself.
  bool meets(std::uint32_t cell, float nearness) const {
    const float there = decoded(bounds_[cell].own), own = there * (1.0f - tolerance_ * nearness);
    return own > 0.0f && own <= nearness * share_ && nearness * (1.0f - tolerance_ * nearness) <= there * share_;
  }

 private:
  static constexpr std::uint32_t kStrip = 64;  // cells in sequence for which one flag tells whether they have changed
  /// The nearness of what lies in and around a cell. close() writes the four in sequence.
  struct Bounds {
    CodedNearness whole;    ///< the farthest of the closed map in the cell and its neighbours
    CodedNearness own;      ///< the closed map in the cell, less its own slope
    CodedNearness beside;   ///< what ends at the cell or at a neighbour
    CodedNearness guarded;  ///< what ends within the guard
  };

  static constexpr std::uint8_t kChanged = 1;  // a strip has points since the last close()
  static constexpr std::uint8_t kSettled = 2;  // a strip has points, all of them older
  struct FreeMemory {
    void operator()(void* memory) const { std::free(memory); }
  };
  struct Planes {
    explicit Planes(const DirectionGrid& grid);
    void clear(const DirectionGrid& grid);
    std::vector<CodedNearness> nearest;  // of each cell, and one more, because vectors read two at a time
    /// Of each cell. The system hands out this memory, which is all zeros, when it is written, and no points lie in
    /// much of a map.
    std::unique_ptr<Bounds[], FreeMemory> bounds;
    std::vector<std::uint8_t> strips;      // 0: without points
    std::vector<std::uint8_t> is_written;  // of each block of close(): whether its bounds may be other than 0
  };
  /// Gives planes back to the memory that they are from.
  struct Return {
    std::shared_ptr<Memory> memory;
    void operator()(Planes* planes) const;
  };

  /// Returns the indices of the points that are nearer than the nearest in their cells; it is valid until the thread's
  /// next call.
  std::span<const std::uint32_t> nearer(const SeenPlaces& seen) const;
  LineOfSight judge_points(std::uint32_t cell, float nearness, LineOfSight closed) const;

  Config config_;
  DirectionGrid grid_;
  float tolerance_, share_, most_;
  std::unique_ptr<Planes, Return> planes_;
  CodedNearness* nearest_;  // of planes_, as the others
  Bounds* bounds_;
  std::uint8_t* strips_;
  bool is_closed_ = true;  // whether nothing was added since close()
};

}  // namespace hueline::fusion
