#pragma once

#include <string>

#include "calibration/lens/lens_calibration.hpp"

namespace hueline::calibration {

/// What cv::calibrateCamera, or cv::fisheye::calibrate, makes of the same corners; `failure` if it makes nothing.
struct OpencvLens {
  LensValues lens;
  double rms_px = 0;
  std::string failure;
};
/// The model is the one of `calibration`, the corners those that it used.
OpencvLens calibrate_with_opencv(const LensCalibration& calibration, bool one_focal);

}  // namespace hueline::calibration
