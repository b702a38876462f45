#pragma once

#include "core/keys.hpp"
#include "core/measurements.hpp"

namespace hueline::config {

/// What a rig accepts before hueline warns: the thresholds of the health of a drive, and of its verdict. The defaults
/// fit a vehicle with a PPS, a strobe and a good POS.
struct HealthLimits {
  // while driving
  nanoseconds start{std::chrono::seconds(30)};  ///< a sensor that is not there by then is missing
  nanoseconds gone{from_seconds(2.5)};          ///< a lost connection that is back sooner is an event
  nanoseconds no_data{std::chrono::seconds(3)};
  nanoseconds lock{std::chrono::seconds(20)};
  nanoseconds holdover{std::chrono::seconds(1)};
  nanoseconds no_pose{std::chrono::seconds(2)};
  nanoseconds no_points{std::chrono::seconds(20)};
  nanoseconds time_sigma{std::chrono::microseconds(500)};
  double pose_sigma_m = 0.15;
  double pose_sigma_alarm_m = 1.0;
  FixType fix = FixType::Single;
  nanoseconds fix_after{std::chrono::seconds(5)};
  double lost_share = 0.005;
  double coloured_share = 0.8;
  double coloured_share_alarm = 0.5;
  double disk_left_min = 15;
  double disk_left_alarm_min = 5;
  // at the end
  nanoseconds end{std::chrono::seconds(10)};  ///< what ends within this time of the end of the drive ends with it
  double placed_share = 0.98;
  double again_share = 0.1;  ///< of the driven path

  void visit(Keys& keys);
  KeyError validate() const;
};

}  // namespace hueline::config
