#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/coloured_point.hpp"
#include "core/keys.hpp"
#include "core/stamped.hpp"
#include "fusion/exposure_timeline.hpp"
#include "fusion/georeference.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::fusion {

class WorkerPool;

/// What became of everything that came in. Every return is in exactly one of: points, no_pose, late_returns,
/// empty_returns, unknown_laser_returns, pending_returns.
struct ColouringCounts {
  std::uint64_t returns = 0;                            ///< came in
  std::uint64_t points = 0;                             ///< went out, coloured or not
  std::array<std::uint64_t, kColourStates> by_state{};  ///< of the points, by ColourState
  std::array<std::uint64_t, kNoPoseReasons> no_pose{};  ///< could not be placed, by NoPose
  std::uint64_t late_batches = 0, late_returns = 0;     ///< came after their place in the stream had passed
  std::uint64_t empty_returns = 0;                      ///< without a range
  std::uint64_t unknown_laser_returns = 0;              ///< of a sensor that the rig does not have
  std::uint64_t pending_returns = 0;                    ///< waiting for poses or exposures
  std::uint64_t forced_batches = 0;                     ///< coloured early, because max_pending_returns was reached
  std::uint64_t exposures = 0;                          ///< came in
  std::uint64_t exposures_used = 0;                     ///< entered the timeline
  std::uint64_t exposures_unmatched = 0, exposures_incomplete = 0, exposures_wrong_size = 0, exposures_late = 0;
  std::uint64_t exposures_unknown_camera = 0;
  std::uint64_t lenses_lost = 0;  ///< of used exposures: that lens's part could not be decoded; never a colour from it
  std::uint64_t exposures_frozen = 0;      ///< the same picture as before, though the head has moved; never a colour
  std::uint64_t moments_without_pose = 0;  ///< exposures whose instant has no pose; never a colour from them
  std::uint64_t moments_crowded_out = 0;   ///< dropped early, because max_held_moments was reached
  std::uint64_t gain_pairs = 0,
                gain_pairs_unmeasured = 0;  ///< brightness of neighbour against owner; too few common points: 1
};

/// Georeferences laser returns and gives them the colour of the exposures: the stage between sync and storage. Pure:
/// what comes out depends on the calls alone, not on clocks and not on the number of threads. Thread-bound: one caller.
class Colouring {
 public:
  struct Config {
    ColourMethod method = ColourMethod::Lens;
    Trajectory::Config trajectory;
    nanoseconds pose_step{500'000};    ///< exact poses at most so far apart inside a batch
    nanoseconds exposure_interval{0};  ///< T of the window rule; 0: measured (median of the last intervals)
    nanoseconds exposure_interval_at_start{1'000'000'000};  ///< T until it can be measured
    nanoseconds window_slack{1'000'000};  ///< an exposure may be so much off its beat without leaving points unowned
    nanoseconds together{5'000'000};      ///< exposures of a head's cameras closer than this are one moment
    int lost_image_neighbours = 0;   ///< windows that a lost image may be bridged from; 0: its points stay uncoloured
    int neighbours = 4;              ///< exposures on each side that may fill hole and masks
    bool balance_neighbours = true;  ///< bring filled points to the brightness of the exposure that owns them
    nanoseconds max_lateness{
        1'000'000'000};  ///< how far behind the watermark a solution may come, or what broke its latency
    std::size_t max_pending_returns =
        8'000'000;                      ///< waiting (32 bytes each); beyond, the oldest are coloured with what is there
    std::size_t max_held_moments = 32;  ///< images held for neighbours
    int threads = 1;                    ///< workers, the caller included
    void visit(Keys& keys);
    KeyError validate() const;
  };
  using Sink = std::function<void(CloudBlock&&)>;

  /// `config.validate()` and `rig.validate()` must be empty. `sink` is called from advance and flush, in order.
  Colouring(const Config& config, const RigGeometry& rig, Sink sink);
  ~Colouring();

  /// Solutions in order of time.
  void add(const InsSolution& solution);
  void add(const InsUncertainty& uncertainty) { trajectory_.add(uncertainty); }
  void add(StampedLaserBatch batch);
  void add(const Exposure& exposure);
  /// `watermark`: sync's promise that laser batches and exposures still to come are not earlier. Colours what is ready:
  /// its poses and neighbours have come, or the watermark has passed them by max_lateness.
  void advance(GpsTime watermark);
  /// The end of the stream: colours all that waits with what is there.
  void flush();

  const ColouringCounts& counts() const { return counts_; }
  const Trajectory& trajectory() const { return trajectory_; }
  /// Faults since the last call, one a sensor and kind, with counts. `time` is left zero: the caller stamps them with
  /// its packet's.
  std::vector<Fault> take_faults();

 private:
  struct Piece;
  bool is_ready(const StampedLaserBatch& batch) const;
  void colour_ready(bool everything);
  void colour_batches(std::vector<StampedLaserBatch>& batches);
  void resolve_viewpoints(bool everything);
  void drop_frozen(Moment& moment);
  void measure_gains(Moment& owner, int owner_index, const std::vector<StampedLaserBatch>& batches);
  void colour_piece(const StampedLaserBatch& batch, Piece& piece, ColouredPoint* points) const;
  void colour_point(int owner, Piece& piece, ColouredPoint& point) const;
  bool try_moment(const Moment& moment, const ColourGain* gain, ColouredPoint& point) const;
  void forget();
  void note(SensorId sensor, FaultKind kind, std::uint64_t count, std::string detail);
  GpsTime last_firing(const StampedLaserBatch& batch) const;
  nanoseconds neighbour_reach() const;

  Config config_;
  RigGeometry rig_;
  Sink sink_;
  Trajectory trajectory_;
  HeadProjector projector_;
  ExposureTimeline timeline_;
  std::map<SensorId, LaserMount> lasers_;
  std::deque<StampedLaserBatch> pending_;
  std::vector<Piece> pieces_;
  std::unique_ptr<WorkerPool> pool_;
  std::optional<GpsTime> watermark_;
  struct Fresh {
    std::uint64_t content = 0;
    Moment::Viewpoint viewpoint;
  };
  std::vector<std::optional<Fresh>> fresh_;  // of each camera: its last picture that was not the one before, and where
  ColouringCounts counts_;
  std::map<std::pair<SensorId, FaultKind>, Fault> faults_;
};

}  // namespace hueline::fusion
