#pragma once

#include <string>

#include "calibration/lens/lens_values.hpp"
#include "fusion/camera_model.hpp"

namespace hueline::apps {

/// `calibrate mount` without targets, of one image and one cloud of the same moment.
struct ShotFiles {
  std::string image, cloud, lens, start, out, date;
  std::string image_size = "refuse";  ///< apps/colour/shot_calibration.hpp
  double search_deg = 3;
};
/// Exit status.
int calibrate_shot(const ShotFiles& files);

/// A rig's lens as the calibration takes it.
calibration::LensValues lens_values(const fusion::CameraIntrinsics& lens);

}  // namespace hueline::apps
