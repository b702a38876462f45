#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/fault.hpp"
#include "core/time.hpp"
#include "fusion/beam_map.hpp"
#include "fusion/depth_map.hpp"
#include "fusion/exposure_timeline.hpp"
#include "fusion/placed_batch.hpp"
#include "fusion/turn_skin.hpp"

/// What the laser points of a drive say about lines of sight, and about what moves (docs/methods/visibility.md).
namespace hueline::fusion {

class WorkerPool;

/// How many turns of a scanner found the place of a point free, and how many found something there; summed over the
/// points beside it on the same surface.
struct Sightings {
  /// A beam that goes past proves more than one that ends nearby: that may have met something else.
  static constexpr int kFreeWeight = 5, kOccupiedWeight = 4;
  std::uint16_t free = 0, occupied = 0;
  /// Whether the point belongs to something that moves.
  bool is_moving() const { return free >= 2 && kFreeWeight * free > kOccupiedWeight * occupied; }
  /// ColouredPoint::moving of the point: 128 or more if is_moving().
  int confidence_of_moving() const;
};

/// Collects laser points as turns of their scanners, and makes the depth maps of moments from them.
///
/// A turn is what a scanner sends within a short time. Its skin is the nearest and the farthest point in each cell of a
/// DirectionGrid at the scanner: the points that stand for all others of the turn. The skins of the turns around a
/// moment are its depth map of what stands still. The beams of each turn are kept to ask whether the places of other
/// turns' points were free then.
///
/// The result depends only on the calls. Thread safety: one thread makes the calls that change it; const functions may
/// then be called by many threads.
class Visibility {
 public:
  struct Config {
    DepthMap::Config depth;
    /// Points of what stands still hide what is behind them in exposures up to this much earlier or later.
    nanoseconds depth_reach{6'000'000'000};
    /// All points hide what is behind them in exposures up to this much earlier or later.
    nanoseconds glance{60'000'000};
    /// Points of what moves do so for this long: from where beams met a thing before the exposure to where they met it
    /// after.
    nanoseconds moving_glance{110'000'000};
    nanoseconds turn{100'000'000};  ///< duration of a turn
    /// A map that is there already is completed when turns of this duration have come since.
    nanoseconds renewal{400'000'000};
    /// Width of the cells of beams, rad. A beam speaks for its own cell and the neighbours of that.
    double beam_cell = 0.01;
    /// Beams up to `turn_reach` earlier or later say whether the place of a point was free then, so whether the point
    /// moves.
    nanoseconds turn_reach{2'500'000'000};
  };

  explicit Visibility(const Config& config) : config_(config), grid_(config.depth.cell), beam_grid_(config.beam_cell) {}

  const DirectionGrid& grid() const { return grid_; }
  /// Adds the batches of `placed` that were not added yet, and completes the turns that end before the newest of them;
  /// all turns if `everything`. The batches are those of the earlier calls with some more at the end and some fewer at
  /// the begin.
  void add(std::deque<PlacedBatch>& placed, bool everything, WorkerPool& pool);
  /// Makes the maps of `moments`, which have viewpoints, from all that was added, or completes them if enough was added
  /// since. `placed` is that of add().
  void map(const std::vector<Moment*>& moments, const std::deque<PlacedBatch>& placed, WorkerPool& pool) const;
  /// Makes Moment::early of moments that have viewpoints, from the turns that are complete.
  void map_early(const std::vector<Moment*>& moments, WorkerPool& pool) const;
  /// Returns what is known about the line of sight from a moment's viewpoint to a place that locate() found there.
  static LineOfSight look(const Moment& moment, std::uint32_t cell, float nearness) {
    if (moment.glance && moment.glance->look(cell, nearness) == LineOfSight::Hidden) return LineOfSight::Hidden;
    return moment.standing ? moment.standing->look_among_points(cell, nearness) : LineOfSight::Clear;
  }
  /// Asks for the memory that look() will read for a place in a cell.
  static void prefetch(const Moment& moment, std::uint32_t cell) {
    if (moment.glance) moment.glance->prefetch(cell);
    if (moment.standing) moment.standing->prefetch(cell);
  }
  /// The sightings of a batch's points.
  class OfBatch {
   public:
    Sightings operator[](std::size_t index) const {
      return sightings_ == nullptr ? Sightings{} : sightings_[on_skin_[index]];
    }

   private:
    friend class Visibility;
    const Sightings* sightings_ = nullptr;  // null if the batch's turn is not complete, or forgotten
    const std::uint32_t* on_skin_ = nullptr;
  };
  OfBatch sightings(const PlacedBatch& batch) const;
  /// Forgets the turns that no moment from `time` on needs.
  void forget_before(GpsTime time);

 private:
  struct Turn;
  void add_turns(const Moment& moment, std::uint64_t first, DepthMap& map) const;
  struct Turn {
    explicit Turn(const DirectionGrid& grid) : beams(grid) {}
    GpsTime time{};  ///< its middle
    Eigen::Vector3d centre_enu = Eigen::Vector3d::Zero();
    RelativePlaces skin;               ///< from the centre
    std::vector<PresenceCount> own;    ///< of each point of the skin alone
    std::vector<Sightings> sightings;  ///< the sum over the point and its neighbours
    /// The neighbours of each point on the same surface. They and `own` are there as long as other turns may come that
    /// are asked about this one.
    std::vector<TurnSkin::Neighbours> neighbours;
    BeamMap beams;
  };
  /// A turn that has not ended.
  struct OpenTurn {
    GpsTime begin{};
    std::vector<PlacedBatch*> batches;
  };
  void complete(OpenTurn& open);
  void sum_sightings(Turn& turn) const;
  void ask_around(WorkerPool& pool, std::uint64_t first, bool everything);
  void ask(Turn& turn, const Turn& beams, std::size_t begin, std::size_t end) const;

  Config config_;
  DirectionGrid grid_, beam_grid_;
  std::shared_ptr<DepthMap::Memory> memory_ = DepthMap::make_memory();
  std::map<SensorId, OpenTurn> open_;
  std::optional<TurnSkin> skin_;  // of the turn that is being completed; made with the first
  std::vector<std::vector<TurnSkin::Neighbours>> spare_neighbours_;  // memory for the next turns
  std::uint64_t next_batch_ = 0;                                     // number of the first batch that was not added yet
  std::deque<Turn> turns_;
  std::uint64_t first_turn_ = 1;  // number of the first of turns_; 0 is none
  GpsTime newest_{};              // middle of the newest turn
};

}  // namespace hueline::fusion
