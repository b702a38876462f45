#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibration/mount/calibration_watch.hpp"
#include "core/fault.hpp"
#include "core/stamped.hpp"
#include "fusion/rig_geometry.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::runtime {

/// What a DriveWatch did and found, for the summary.
struct WatchReport {
  std::uint64_t images = 0;    ///< lens images that were compared with the laser points around them
  std::uint64_t patches = 0;   ///< in these images where grey levels and intensities are related
  std::uint64_t standing = 0;  ///< lens images that were left out because the vehicle stood or had no pose
  std::uint64_t dropped = 0;   ///< lens images that were left out because too much waited
  std::uint64_t windows = 0;   ///< how often there was a full window to judge
  std::uint64_t drifts = 0;    ///< how often a drift was reported
  std::optional<calibration::CalibrationDrift> last;  ///< the last window
};

/// Watches while driving whether images and laser points still fit together as the rig says, and tells a fault
/// Implausible of the camera when they do not (calibration/mount/calibration_watch.hpp). It takes lens images at a
/// fixed rate of stream time, the lenses of the head in turn, and the returns around each of them. Rows of a rolling
/// shutter are compared with where the returns were while they were exposed.
///
/// Its work is bounded: so many images a second, each shrunk to at most 650 columns and compared with at most 100 000
/// returns. So is its memory: the last four million returns (80 MB) and 64 lens images. Everything depends on the
/// order of the calls alone. Thread safety: none.
class DriveWatch {
 public:
  /// `config.validate()` and `rig.validate()` must be empty.
  DriveWatch(const fusion::RigGeometry& rig, const calibration::CalibrationWatchConfig& config);

  void add(const Exposure& exposure);
  void add(const StampedLaserBatch& batch);
  /// Compares the images that have all their returns. No exposure and no batch before `watermark` comes any more;
  /// `is_settled` says whether no later solution changes the pose of a time.
  void advance(GpsTime watermark, const fusion::Trajectory& trajectory, const std::function<bool(GpsTime)>& is_settled);
  /// Returns the drifts that were found since the last call. Their `time` is not set.
  std::vector<Fault> take_faults();
  const WatchReport& report() const { return report_; }

 private:
  struct Return {
    Eigen::Vector3f p_scanner;
    std::int32_t time_offset_ns;
    std::uint8_t reflectivity;
  };
  struct Batch {
    GpsTime time{};         // of its middle, which the offsets of the returns count from
    std::size_t laser = 0;  // index into rig_.lasers
    std::vector<Return> returns;
    bool is_settled = false;
    std::optional<fusion::Pose> pose;  // at the middle of the batch, once it is settled
  };
  /// How the vehicle moves at an exposure.
  struct Motion {
    Transform<Body, Enu> T_body_enu;
    Eigen::Vector3d velocity_body, turn_rate_body;
  };
  struct Waiting {
    GpsTime mid{};
    std::size_t lens = 0;
    int axis = 0;  // the parameter to which the answer is measured
    calibration::GreyImage image;
    bool is_settled = false;
    std::optional<Motion> motion;  // once it is settled
  };
  void settle(const fusion::Trajectory& trajectory, const std::function<bool(GpsTime)>& is_settled);
  void forget();
  std::vector<calibration::LaserSample> samples_around(GpsTime mid, const Transform<Body, Enu>& T_body_enu) const;
  void look(Waiting&& waiting);
  void tell();

  const fusion::RigGeometry rig_;
  const calibration::CalibrationWatchConfig config_;
  calibration::CalibrationWatch watch_;
  std::deque<Batch> batches_;     // in the order of time
  std::size_t held_returns_ = 0;  // in batches_
  std::size_t settled_ = 0;       // so many of batches_, from the front, are settled
  std::deque<Waiting> waiting_;
  GpsTime watermark_{};
  // The choice of images: what the passed time allows, and the lens in turn.
  std::optional<GpsTime> last_exposure_;
  double allowed_ = 0;
  std::size_t turn_ = 0;
  bool was_turned_ = false, was_late_ = false;
  std::vector<Fault> faults_;
  WatchReport report_;
};

}  // namespace hueline::runtime
