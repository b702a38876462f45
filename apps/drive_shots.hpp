#pragma once

#include <vector>

#include "apps/products.hpp"
#include "calibration/mount/alignment.hpp"
#include "config/rig.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::apps {

/// Gathers what aligning image and laser needs from a drive: some exposures, the laser around each, and the way of the vehicle between.
/// Feed a Pipeline with it as sink, then take the shots.
class DriveShots : public NullSink {
 public:
  struct Config {
    int every = 4;                     ///< every so many exposures
    nanoseconds reach{110'000'000};    ///< laser returns this far from an exposure; a revolution or two
    std::size_t most_exposures = 60;
    double least_speed = 0.0;          ///< m/s; slower exposures are left out (they see the same again)
  };
  DriveShots(const config::Rig& rig, const Config& config);

  void on_laser(const StampedLaserBatch& batch) override;
  void on_exposure(const Exposure& exposure) override;
  void on_solution(const InsSolution& solution) override { trajectory_.add(solution); }

  /// After the pipeline's flush.
  std::vector<calibration::AlignmentShot> shots() const;
  std::size_t exposures() const { return exposures_.size(); }

 private:
  calibration::GreyImage lens_image(const Exposure& exposure, const fusion::LensMount& lens) const;

  const config::Rig& rig_;
  Config config_;
  fusion::Trajectory trajectory_;
  std::vector<Exposure> exposures_;
  std::vector<StampedLaserBatch> batches_;
  std::size_t seen_ = 0;
};

}  // namespace hueline::apps
