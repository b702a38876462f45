#pragma once

#include <deque>
#include <map>
#include <optional>

#include "runtime/products.hpp"
#include "calibration/boresight/return_store.hpp"
#include "config/rig.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::apps {

/// Gathers what a boresight is found from: the laser's returns with the POS's poses at their firing. Feed a Pipeline with it as sink, then take
/// the drive. What it holds does not grow with the drive beyond its store's limit. Thread-bound (the pipeline's).
class DriveReturns : public runtime::NullSink {
 public:
  struct Counts {
    std::uint64_t placed = 0, no_pose = 0, badly_timed = 0;  ///< returns
    std::uint64_t solutions = 0;
  };
  /// `rig` must outlive it; its scanners' mountings are where the search begins.
  DriveReturns(const config::Rig& rig, const calibration::ReturnStore::Config& config);

  void on_laser(const StampedLaserBatch& batch) override;
  void on_solution(const InsSolution& solution) override;

  /// The end of the drive.
  calibration::BoresightDrive take();
  const Counts& counts() const { return counts_; }

 private:
  void place(const StampedLaserBatch& batch);

  fusion::Trajectory trajectory_;
  std::map<SensorId, std::size_t> scanners_;  // into the store's
  calibration::ReturnStore store_;
  std::deque<StampedLaserBatch> waiting_;     // for poses
  Counts counts_;
};

}  // namespace hueline::apps
