#pragma once

#include <map>

#include "calibration/boresight/return_store.hpp"
#include "config/rig.hpp"
#include "runtime/products.hpp"

namespace hueline::apps {

/// Gathers what a boresight is found from: the laser's returns with the POS's poses at their firing. Feed a Pipeline
/// with it as sink, then take the drive. What it holds does not grow with the drive beyond its store's limit.
/// Thread-bound (the pipeline's).
class DriveReturns : public runtime::ProductSink {
 public:
  struct Counts {
    std::uint64_t placed = 0, no_pose = 0, badly_timed = 0;  ///< returns
    std::uint64_t solutions = 0;
  };
  /// `rig` must outlive it; its scanners' mountings are where the search begins.
  DriveReturns(const config::Rig& rig, const calibration::ReturnStore::Config& config);

  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return true; }
  void on_solution(const InsSolution&) override { ++counts_.solutions; }

  /// The end of the drive.
  calibration::BoresightDrive take() { return store_.take(); }
  const Counts& counts() const { return counts_; }

 private:
  std::map<SensorId, std::size_t> scanners_;  // into the store's
  calibration::ReturnStore store_;
  Counts counts_;
};

}  // namespace hueline::apps
