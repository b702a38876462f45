#pragma once

#include <map>

#include "calibration/boresight/return_store.hpp"
#include "config/rig.hpp"
#include "runtime/products.hpp"

namespace hueline::survey {

/// Gathers what the boresight calibration needs of a drive: the returns of the scanners, each with the pose of the
/// vehicle at its firing. Give it to a runtime::Pipeline as sink, process the drive, then call take(). Its memory does
/// not grow with the drive beyond the limit of calibration::ReturnStore. Thread safety: none; the thread of the
/// pipeline calls it.
class DriveReturns : public runtime::ProductSink {
 public:
  struct Counts {
    std::uint64_t placed = 0;       ///< returns that were kept with their pose
    std::uint64_t no_pose = 0;      ///< returns for whose time the trajectory has no pose
    std::uint64_t badly_timed = 0;  ///< returns whose time has a sigma above 0.5 ms
    std::uint64_t solutions = 0;    ///< navigation solutions of the POS
  };
  /// The calibration begins with the mountings that `rig` has.
  DriveReturns(const config::Rig& rig, const calibration::ReturnStore::Config& config);

  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return true; }
  void on_solution(const InsSolution&) override { ++counts_.solutions; }

  /// Returns what was gathered. Call it once, after the flush of the pipeline.
  calibration::BoresightDrive take() { return store_.take(); }
  const Counts& counts() const { return counts_; }

 private:
  std::map<SensorId, std::size_t> scanners_;  // number of each in the store
  calibration::ReturnStore store_;
  Counts counts_;
};

}  // namespace hueline::survey
