#pragma once

#include <string>

#include "apps/simulate/drive_options.hpp"

namespace hueline::apps {

/// Options of `calibrate mount` without targets for a drive. The drive is a recording or a simulated scenario; with a
/// scenario the difference from the truth is printed with the result.
struct DriveFiles {
  DriveOptions drive;
  std::string out, date;
  double search_deg = 3, search_time_ms = 50;
  double off_deg = 0, off_ms = 0;  ///< scenario: errors that are added to the rig's head and to the times of its images
  int starts = 1;                  ///< scenario: number of directions of the error, one calibration each
  /// Only every n-th exposure is used.
  int every = 4;
};
/// Calibrates the mounting of the head and prints the result. Returns the exit status.
int calibrate_drive(const DriveFiles& files);

}  // namespace hueline::apps
