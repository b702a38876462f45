#pragma once

#include <vector>

#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// One exposure as the program stamped and posed it, compared with the truth.
struct ExposureError {
  double drive_s = 0;   ///< true middle, s after the beginning of the drive: the abscissa of the charts
  double error_us = 0;  ///< stamp minus true middle
  double sigma_us = 0;  ///< sigma that the program states
  bool has_pose = false;
  sim::Vec3 position_error_m;  ///< stated minus true place of the head
  double attitude_error_deg = 0;
};

/// Adds the figures exposure_time_*, exposures_stamped_share and pose_* and their charts. `exposures_made` is the
/// number of the camera's exposures, stamped or not.
void add_time_figures(const std::vector<ExposureError>& errors, std::size_t exposures_made, ScenarioScore& score);

}  // namespace hueline::score
