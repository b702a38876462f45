#pragma once

#include <string>

namespace hueline::apps {

/// Options of `calibrate mount` without targets for one image and one cloud of the same moment.
struct ShotFiles {
  std::string image, cloud, lens, start, out, date;
  std::string image_size = "refuse", image_turn = "auto";  ///< words of apps/colour/shot_calibration.hpp
  double search_deg = 3;
  double off_deg = 0;  ///< above 0: the start is rotated by this, and nothing is written
  int starts = 1;      ///< number of directions of off_deg, one alignment each
};
/// Calibrates the pose of the lens and prints the result. Returns the exit status.
int calibrate_shot(const ShotFiles& files);

}  // namespace hueline::apps
