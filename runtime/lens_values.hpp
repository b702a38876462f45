#pragma once

#include "calibration/lens/lens_values.hpp"
#include "calibration/mount/alignment.hpp"
#include "fusion/rig_geometry.hpp"

namespace hueline::runtime {

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

/// Returns a lens of a rig's head as it is in an image whose pixels are the means of `cell` x `cell` pixels.
inline calibration::AlignmentLens alignment_lens(const fusion::LensMount& lens, int cell) {
  calibration::LensValues values = lens_values(lens.intrinsics);
  values.width /= static_cast<std::uint32_t>(cell);
  values.height /= static_cast<std::uint32_t>(cell);
  values.focal_px /= cell;
  values.principal_point_px = ((values.principal_point_px.array() + 0.5) / cell - 0.5).matrix();
  return {values, lens.T_head_lens, lens.intrinsics.max_angle};
}

}  // namespace hueline::runtime
