#pragma once

#include <string>

#include "calibration/lens/lens_calibration.hpp"

namespace hueline::calibration {

/// The result of cv::calibrateCamera or cv::fisheye::calibrate. `failure` says why OpenCV gave none; it is empty
/// otherwise.
struct OpencvLens {
  LensValues lens;
  double rms_px = 0;
  std::string failure;
};
/// Calibrates the lens with OpenCV, with the model of `calibration` and the corners that it used.
OpencvLens calibrate_with_opencv(const LensCalibration& calibration, bool one_focal);

}  // namespace hueline::calibration
