#pragma once

#include <vector>

#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// One exposure as the program stamped and posed it, beside the truth.
struct ExposureError {
  double drive_s = 0;   ///< true middle after the drive's begin, s: the charts' abscissa
  double error_us = 0;  ///< stamped minus true middle
  double sigma_us = 0;  ///< what the program says of itself
  bool has_pose = false;
  sim::Vec3 position_error_m;  ///< stated minus true place of the head
  double attitude_error_deg = 0;
};

/// exposure_time_*, exposures_stamped_share, pose_*, and their charts. `exposures_made`: by the camera, stamped or not.
void add_time_figures(const std::vector<ExposureError>& errors, std::size_t exposures_made, ScenarioScore& score);

}  // namespace hueline::score
