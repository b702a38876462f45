#pragma once

#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "config/rig.hpp"
#include "runtime/products.hpp"

namespace hueline::survey {

/// Gathers what the alignment of images and laser points needs of a drive: some exposures, the laser points around each
/// of them, and the motion of the vehicle at the exposure. Give it to a runtime::Pipeline as sink, process the drive,
/// then call shots(). Its memory does not grow with the drive. Thread safety: none; the thread of the pipeline calls
/// it.
class DriveShots : public runtime::ProductSink {
 public:
  struct Config {
    int every = 4;  ///< one of so many exposures of a camera is used
    /// Laser returns are used so long before and after an exposure. The default is five and a half revolutions at 10
    /// Hz.
    nanoseconds reach{550'000'000};
    /// Largest number of exposures. When there are more, every other one is dropped and `every` is doubled, so that
    /// they stay spread over the drive.
    std::size_t most_exposures = 80;
    std::size_t most_samples = 160'000;  ///< of an exposure; samples on outlines are dropped last
    std::uint32_t most_width = 1300;     ///< px; wider images are shrunk by a whole factor
    double least_speed = 0.0;            ///< m/s; exposures at a lower speed are left out: they show the same again
  };
  /// `rig` must outlive the object.
  DriveShots(const config::Rig& rig, const Config& config);

  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return true; }
  void on_exposure(const Exposure& exposure) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// Returns the shots in order of time. Call it once, after the flush of the pipeline.
  std::vector<calibration::AlignmentShot> shots();
  /// Returns the number of exposures that the shots come from. Call it after shots().
  std::size_t exposures() const { return kept_count_; }
  /// Returns the lenses of the head, scaled to the images of the shots.
  std::vector<calibration::AlignmentLens> lenses() const;

 private:
  struct Waiting {
    std::uint32_t exposure = 0;
    GpsTime mid{};
    std::vector<std::pair<std::size_t, calibration::GreyImage>> images;  // lens and its image
    bool is_settled = false;
    std::optional<fusion::Pose> here, before, after;  // at `mid`, and a little off
  };
  struct Placed {
    StampedLaserBatch batch;
    fusion::Pose pose;  // at its time
  };
  int cell_of(const fusion::LensMount& lens) const;
  std::vector<calibration::LaserSample> samples_around(GpsTime mid, const Transform<Body, Enu>& T_body_enu) const;
  void decide(const Waiting& exposure);
  void thin();

  const config::Rig& rig_;
  Config config_;
  int every_;
  std::deque<Placed> batches_;
  std::deque<Waiting> waiting_;
  std::map<SensorId, std::size_t> seen_;                       // exposures of each camera
  std::vector<std::vector<calibration::AlignmentShot>> kept_;  // of each exposure
  std::size_t kept_count_ = 0;
};

}  // namespace hueline::survey
