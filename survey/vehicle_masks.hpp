#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/mask/vehicle_mask.hpp"
#include "fusion/colouring.hpp"
#include "fusion/rig_geometry.hpp"
#include "runtime/products.hpp"
#include "survey/held_out_views.hpp"

namespace hueline::survey {

/// One of the passes over a drive that learn the masks: which lenses give colours, and which are compared with them.
struct MaskPass {
  std::vector<bool> gives_colour, is_judged;  ///< of each lens of the rig
};

/// Returns the passes. In the first one no mask is known, and all lenses give colours: where they show the vehicle,
/// they predict it for the world. In the others, with the masks found so far, the lenses that look ahead give colours
/// for those that look back, and these for those: the road behind a boom in the middle, say, is behind it in all views
/// of the same lens, and would be predicted to look like the boom. A head whose lenses all look to one side has two
/// passes with all lenses.
std::vector<MaskPass> mask_passes(const fusion::RigGeometry& rig);

/// Returns the rig whose lenses give the colours of a pass: with what was found so far as masks, without the hole, and
/// with a mask over the whole image of each lens that gives none.
fusion::RigGeometry rig_of_pass(fusion::RigGeometry rig, const MaskPass& pass,
                                const std::vector<calibration::VehicleMask::Found>& found);

/// Learns from a drive which part of each lens image is the own vehicle (calibration::VehicleMask). Half of the images
/// are left out of a colouring of their own, and compared with what the cloud predicts for them, for every lens that
/// could show it. Give it to a runtime::Pipeline as sink, process the drive, then call finish(). Its memory does not
/// grow with the drive. Thread safety: none; the thread of the pipeline calls it.
class VehicleMasks : public runtime::ProductSink {
 public:
  /// `colouring.validate()` and `rig.validate()` must be empty. `threads`: of the colouring, the caller's included.
  VehicleMasks(const fusion::Colouring::Config& colouring, const fusion::RigGeometry& rig, int threads);

  void on_solution(const InsSolution& solution) override { views_.on_solution(solution); }
  void on_exposure(const Exposure& exposure) override { views_.on_exposure(exposure); }
  void on_laser(const StampedLaserBatch& batch) override { views_.on_laser(batch); }
  void on_watermark(GpsTime watermark) override { views_.on_watermark(watermark); }
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override {
    views_.on_settled_exposure(exposure, trajectory);
  }

  /// Returns what was found of each lens, in the order of the rig. Call it once, after the flush of the pipeline.
  std::vector<calibration::VehicleMask::Found> finish();

 private:
  void take(const PredictedView& view);

  std::vector<calibration::VehicleMask> masks_;           // of each lens
  std::vector<std::optional<Eigen::Vector3d>> taken_at_;  // the head's place at the newest view of each lens
  HeldOutViews views_;                                    // gives its views to take()
};

}  // namespace hueline::survey
