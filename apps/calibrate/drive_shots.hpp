#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "config/rig.hpp"
#include "runtime/products.hpp"

namespace hueline::apps {

/// Gathers what aligning image and laser needs from a drive: some exposures, the laser around each, and the way of the
/// vehicle between. Feed a Pipeline with it as sink, then take the shots. What it holds does not grow with the drive.
class DriveShots : public runtime::ProductSink {
 public:
  struct Config {
    int every = 4;                   ///< every so many exposures of a camera
    nanoseconds reach{550'000'000};  ///< laser returns this far from an exposure: five revolutions each side
    std::size_t most_exposures =
        80;  ///< beyond, every other one is given up and `every` doubled: they stay spread over the drive
    std::size_t most_samples = 160'000;  ///< of an exposure; beyond, they are thinned out, outlines last
    std::uint32_t most_width = 1300;     ///< px; wider images are shrunk by a whole factor
    double least_speed = 0.0;            ///< m/s; slower exposures are left out (they see the same again)
  };
  DriveShots(const config::Rig& rig, const Config& config);

  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return true; }
  void on_exposure(const Exposure& exposure) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// The end of the drive: what waits is decided. Then the shots, in order of time.
  std::vector<calibration::AlignmentShot> shots();
  /// After shots().
  std::size_t exposures() const { return kept_count_; }
  /// The head's lenses as the shots' images have them.
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
  std::uint32_t shrink(const fusion::LensMount& lens) const;
  calibration::GreyImage lens_image(const Exposure& exposure, const fusion::LensMount& lens) const;
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

}  // namespace hueline::apps
