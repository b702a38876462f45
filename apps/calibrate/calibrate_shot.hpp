#pragma once

#include <string>

#include "calibration/lens/lens_values.hpp"
#include "fusion/camera_model.hpp"

namespace hueline::apps {

/// Options of `calibrate mount` without targets for one image and one cloud of the same moment.
struct ShotFiles {
  std::string image, cloud, lens, start, out, date;
  std::string image_size = "refuse";  ///< a word of apps/colour/shot_calibration.hpp
  double search_deg = 3;
};
/// Calibrates the pose of the lens and prints the result. Returns the exit status.
int calibrate_shot(const ShotFiles& files);

/// Converts a rig's lens to the form that the calibration uses.
calibration::LensValues lens_values(const fusion::CameraIntrinsics& lens);

}  // namespace hueline::apps
