#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/coloured_point.hpp"
#include "core/keys.hpp"
#include "core/stamped.hpp"
#include "fusion/exposure_timeline.hpp"
#include "fusion/georeference.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/radiometry.hpp"
#include "fusion/sight_judge.hpp"
#include "fusion/trajectory.hpp"
#include "fusion/visibility.hpp"

namespace hueline::fusion {

class WorkerPool;

/// Which exposure gives a point its colour.
enum class ExposureChoice : std::uint8_t {
  /// The exposure that sees the point most nearly as the scanner did and from which, as the laser points say, nothing
  /// hides it.
  Visible,
  /// The exposure nearest in time, which owns the point (docs/methods, equation 7). Its neighbours fill only the hole
  /// and the masks. Nothing is known about what hides a point.
  Nearest,
};

/// Counts of what happened to all input. Each return is counted in exactly one of: points, no_pose, late_returns,
/// empty_returns, unknown_laser_returns, pending_returns.
struct ColouringCounts {
  std::uint64_t returns = 0;                            ///< returns received
  std::uint64_t points = 0;                             ///< points given to the sink, with or without a colour
  std::array<std::uint64_t, kColourStates> by_state{};  ///< the points by ColourState
  std::array<std::uint64_t, kNoPoseReasons> no_pose{};  ///< returns that could not be placed, by NoPose
  std::uint64_t late_batches = 0, late_returns = 0;     ///< arrived after their time in the stream had passed
  std::uint64_t empty_returns = 0;                      ///< without a range
  std::uint64_t unknown_laser_returns = 0;              ///< from a sensor that the rig does not have
  std::uint64_t pending_returns = 0;                    ///< waiting for poses or exposures
  std::uint64_t forced_batches = 0;                     ///< coloured early, because max_pending_returns was reached
  std::uint64_t exposures = 0;                          ///< exposures received
  std::uint64_t exposures_used = 0;                     ///< exposures that entered the timeline
  std::uint64_t exposures_unmatched = 0, exposures_incomplete = 0, exposures_wrong_size = 0, exposures_late = 0;
  std::uint64_t exposures_unknown_camera = 0;
  /// Lenses of used exposures whose part of the image could not be decoded. They give no colour.
  std::uint64_t lenses_lost = 0;
  /// Exposures with the same picture as before, although the head has moved. They give no colour.
  std::uint64_t exposures_frozen = 0;
  std::uint64_t moments_without_pose = 0;  ///< exposures without a pose; they give no colour
  std::uint64_t moments_crowded_out = 0;   ///< dropped early, because max_held_moments was reached
  /// Pairs of lens images that showed enough common places to compare their light, and those that did not.
  std::uint64_t gain_pairs = 0, gain_pairs_unmeasured = 0;
};

/// Georeferences laser returns and gives them the colour of the exposures. This is the stage between sync and storage.
/// The output depends only on the calls, not on clocks and not on the number of threads. Thread safety: none; one
/// thread makes all calls.
class Colouring {
 public:
  struct Config {
    ColourMethod method = ColourMethod::Lens;
    ExposureChoice choice = ExposureChoice::Visible;
    Trajectory::Config trajectory;
    nanoseconds pose_step{500'000};  ///< largest distance between exact poses inside a batch
    /// The interval T between exposures in docs/methods, equation 7; 0: measured, as the median of the last intervals.
    nanoseconds exposure_interval{0};
    nanoseconds exposure_interval_at_start{1'000'000'000};  ///< T until it can be measured
    /// How much an exposure may deviate from its regular time without leaving points unowned.
    nanoseconds window_slack{1'000'000};
    /// Exposures of different cameras of a head are one moment if they are closer together than this.
    nanoseconds together{5'000'000};
    /// How many windows away a neighbour may be that colours the points of a lost image; 0: they stay without a colour.
    /// For ExposureChoice::Nearest.
    int lost_image_neighbours = 0;
    /// How many exposures on each side may give a point its colour besides its owner.
    int neighbours = 8;
    /// How long after its firing a point waits for exposures that may colour it. It always waits for its owner.
    nanoseconds max_wait{2'200'000'000};
    Radiometry::Config radiometry;
    /// How far behind the watermark a solution, or data that exceeded their latency, may arrive.
    nanoseconds max_lateness{1'000'000'000};
    /// How many returns may wait (80 bytes each). Beyond this, the oldest are coloured with what is there. As many
    /// coloured ones are kept for what they hide (16 bytes each).
    std::size_t max_pending_returns = 8'000'000;
    std::size_t max_held_moments = 32;  ///< how many moments with their images are held for neighbours
    Visibility::Config visibility;
    int threads = 1;  ///< number of threads, the caller's included
    void visit(Keys& keys);
    KeyError validate() const;
  };
  /// The block's memory is used again after the call.
  using Sink = std::function<void(const CloudBlock&)>;
  using SightSink = std::function<void(const CloudBlock&, std::span<const JudgedSight>)>;

  /// `config.validate()` and `rig.validate()` must be empty. advance() and flush() call `sink`, with the points in
  /// order.
  Colouring(const Config& config, const RigGeometry& rig, Sink sink);
  ~Colouring();

  /// Also gives points a colour as soon as they have their places, for a live view: from the exposures that are there,
  /// and whose poses are known. `sink` gets every placed point once, long before the other sink gets the same point
  /// with its final colour. Counts and the final colours do not depend on it. Call this before anything is added.
  void set_provisional_sink(Sink sink) { provisional_sink_ = std::move(sink); }
  /// Also gives the lines of sight that were judged for the points of a block, before `sink` gets the block: for
  /// whoever compares them with the truth. Nothing else depends on it. Call this before anything is added.
  void set_sight_sink(SightSink sink) { sight_sink_ = std::move(sink); }
  /// Adds a solution, in order of time.
  void add(const InsSolution& solution);
  void add(const InsUncertainty& uncertainty) { trajectory_.add(uncertainty); }
  void add(StampedLaserBatch batch);
  void add(const Exposure& exposure);
  /// Colours what is ready. `watermark` is a time before which no laser batch and no exposure will come any more, as
  /// sync promises. A batch is ready when no exposure that may colour it can come any more and their poses have
  /// arrived, or the watermark has passed them by max_lateness. An exposure that is due, but has not come, is waited
  /// for as long, because it may be late.
  /// The work is done in steps: when the watermark or the newest batch is 10 ms later than at the last step.
  void advance(GpsTime watermark);
  /// Ends the stream: colours everything that waits with what is there.
  void flush();

  const ColouringCounts& counts() const { return counts_; }
  const Trajectory& trajectory() const { return trajectory_; }
  /// Returns the faults since the last call, one for each sensor and kind, with counts. Their `time` is zero: the
  /// caller sets it to the time of its packet.
  std::vector<Fault> take_faults();

 private:
  struct Piece;
  struct Found;
  void place_ready(bool everything);
  PlacedBatch unplaced(StampedLaserBatch&& batch);
  void resolve_viewpoints(bool everything);
  void tell_lenses(const Exposure& exposure, Moment& moment) const;
  void drop_frozen(Moment& moment);
  void map_depths(GpsTime from, GpsTime to);
  bool is_ready(const PlacedBatch& batch) const;
  void colour_ready(bool everything);
  std::size_t fill_block(std::size_t first, std::size_t count, bool is_provisional, const HeadGains* usual_gains);
  void colour_batches(std::size_t count);
  void colour_provisionally(std::size_t first);
  void measure_light(GpsTime to);
  std::vector<Radiometry::Place> common_places(int newest) const;
  void colour_piece(const PlacedBatch& batch, Piece& piece, ColouredPoint* points) const;
  void find_candidates(const PlacedBatch& batch, Piece& piece) const;
  void find_known(const PlacedBatch& batch, Piece& piece) const;
  const HeadGains* gains_of(const Moment& moment, const Piece& piece) const;
  void choose_beside(const PlacedBatch& batch, const ColouredPoint* points, Piece& piece) const;
  void paint_chosen(const PlacedBatch& batch, ColouredPoint* points, Piece& piece) const;
  void choose_rest(const PlacedBatch& batch, ColouredPoint* points, Piece& piece) const;
  void paint_rest(ColouredPoint* points, Piece& piece) const;
  void paint_group(const Moment& moment, bool skips_lost_light, ColouredPoint* points, Piece& piece) const;
  void render(const HeadGains* gains, Piece& piece) const;
  Found find_visible(std::size_t index, bool moves, Piece& piece, const ColouredPoint& point) const;
  void judge_doubtful(const PlacedBatch& batch, ColouredPoint* points, Piece& piece) const;
  void keep_judged(std::uint32_t point, const Found& view, const SightEvidence& evidence, Piece& piece) const;
  Found find_nearest(int owner, bool is_lost, Piece& piece, const ColouredPoint& point) const;
  bool sees(const Moment& moment, const ColouredPoint& point, Sight& sight) const;
  void paint(const Moment& moment, const Found& found, const std::array<std::uint8_t, 3>& colour,
             ColouredPoint& point) const;
  void forget();
  void note(SensorId sensor, FaultKind kind, std::uint64_t count, std::string detail);
  GpsTime last_firing(const StampedLaserBatch& batch) const;
  nanoseconds neighbour_reach() const;
  nanoseconds reach_behind() const;
  nanoseconds reach_ahead() const;

  Config config_;
  RigGeometry rig_;
  Sink sink_, provisional_sink_;
  SightSink sight_sink_;
  Trajectory trajectory_;
  HeadProjector projector_;
  ExposureTimeline timeline_;
  Radiometry radiometry_;
  Visibility visibility_;
  std::map<SensorId, LaserMount> lasers_;
  std::deque<StampedLaserBatch> pending_;  // wait for their poses
  std::deque<PlacedBatch> placed_;  // first those that are coloured and kept for depth maps, then those that wait
  std::size_t coloured_ = 0;        // number of the former
  std::size_t kept_returns_ = 0;    // returns in them
  std::uint64_t next_number_ = 0;
  // Their memory serves the next batches: what coloured batches no longer need, and the places of those that are gone.
  // They are at most about as many as the batches that wait, and those that are there.
  std::vector<GeoreferencedBatch> coloured_spare_;
  std::vector<PlacedBatch> gone_spare_;
  std::vector<Piece> pieces_;
  CloudBlock block_;
  std::vector<JudgedSight> judged_;  // of block_, if there is a sight_sink_
  std::unique_ptr<WorkerPool> pool_;
  std::optional<GpsTime> watermark_;
  GpsTime worked_until_{}, worked_newest_{};  // watermark and newest batch when advance() did its work last
  struct Fresh {
    std::uint64_t content = 0;
    Moment::Viewpoint viewpoint;
  };
  // For each camera the last picture that differed from the one before, and where it was taken.
  std::vector<std::optional<Fresh>> fresh_;
  ColouringCounts counts_;
  std::map<std::pair<SensorId, FaultKind>, Fault> faults_;
};

}  // namespace hueline::fusion
