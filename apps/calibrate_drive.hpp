#pragma once

#include <string>

namespace hueline::apps {

/// `calibrate mount` without targets, of a drive: a recording, or a simulated scenario whose truth is then said beside the result.
struct DriveFiles {
  std::string recording, scenario, cache, rig, out, date;
  double search_deg = 3, search_time_ms = 50, off_deg = 0;
  int every = 4;
};
/// Exit status.
int calibrate_drive(const DriveFiles& files);

}  // namespace hueline::apps
