#pragma once

#include <string>

namespace hueline::apps {

/// `calibrate mount` without targets, of a drive: a recording, or a simulated scenario whose truth is then said beside
/// the result.
struct DriveFiles {
  std::string recording, scenario, cache, rig, out, date;
  double search_deg = 3, search_time_ms = 50;
  double off_deg = 0, off_ms = 0;  ///< scenario: how far the rig's head and the times of its images are put off
  int starts = 1;                  ///< scenario: in so many directions, one after the other
  int every = 4;
};
/// Exit status.
int calibrate_drive(const DriveFiles& files);

}  // namespace hueline::apps
