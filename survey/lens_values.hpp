#pragma once

#include "calibration/lens/lens_values.hpp"
#include "fusion/camera_model.hpp"

namespace hueline::survey {

/// Returns a lens of a rig in the form that the adjustments of calibration/ take. The two folders have no lens type in
/// common because their formulas are held against each other in tests.
inline calibration::LensValues lens_values(const fusion::CameraIntrinsics& lens) {
  using calibration::LensModel;
  calibration::LensValues out;
  out.model = lens.model == fusion::LensModel::Brown ? LensModel::Brown : LensModel::KannalaBrandt;
  out.width = lens.width;
  out.height = lens.height;
  out.focal_px = lens.focal_px;
  out.principal_point_px = lens.principal_point_px;
  out.distortion = lens.distortion;
  return out;
}

}  // namespace hueline::survey
