#include "config/health_limits.hpp"

#include <fmt/format.h>

namespace hueline::config {

void HealthLimits::visit(Keys& keys) {
  keys.duration(
      {"start_s", "s", "A sensor that has sent nothing this long after the first sensor is missing: an alarm."}, start,
      {1, 3600});
  keys.duration({"gone_s", "s", "A sensor whose connection is lost for longer is gone: an alarm."}, gone, {0, 60});
  keys.duration({"no_data_s", "s",
                 "A sensor that sends packets, but for this long none with returns, images or solutions: an alarm."},
                no_data, {0.5, 600});
  keys.duration({"lock_s", "s", "The clock is not locked this long after the first pulse: an alarm."}, lock, {5, 600});
  keys.duration({"holdover_s", "s", "The clock runs without pulses for longer: a warning."}, holdover, {0, 3600});
  keys.duration({"no_pose_s", "s",
                 "The POS gives no good solution for this long: an alarm, or a warning before the first good one."},
                no_pose, {0.1, 600});
  keys.duration({"no_points_s", "s", "Returns come, but no point gets its place for this long: an alarm."}, no_points,
                {5, 600});
  keys.duration({"time_sigma_us", "us", "Returns or exposures have a larger sigma of their time for 2 s: a warning."},
                time_sigma, {1, 100'000});
  keys.number({"pose_sigma_m", "m", "Solutions have a larger horizontal sigma for 2 s: a warning."}, pose_sigma_m,
              {0.001, 1000});
  keys.number({"pose_sigma_alarm_m", "m", "The same as an alarm."}, pose_sigma_alarm_m, {0.001, 10'000});
  keys.choice({"gnss_fix", "", "The least kind of GNSS position that is no warning."}, fix,
              {{"none", FixType::None},
               {"single", FixType::Single},
               {"dgnss", FixType::Dgnss},
               {"rtk_float", FixType::RtkFloat},
               {"rtk_fixed", FixType::RtkFixed}});
  keys.duration({"gnss_fix_s", "s", "GNSS is weaker than `gnss_fix` for longer: a warning."}, fix_after, {0, 3600});
  keys.number(
      {"lost_share", "", "A larger share of a sensor's packets, images or messages is lost within 10 s: a warning."},
      lost_share, {0, 1});
  keys.number({"coloured_share", "", "Less of the points of 10 s is coloured: a warning; of the drive: a remark."},
              coloured_share, {0, 1});
  keys.number(
      {"coloured_share_alarm", "", "Less of the points of 10 s is coloured: an alarm; of the drive: drive again."},
      coloured_share_alarm, {0, 1});
  keys.number({"disk_left_min", "min", "The disk is full sooner at the present rate: a warning."}, disk_left_min,
              {0, 10'000});
  keys.number({"disk_left_alarm_min", "min", "The same as an alarm."}, disk_left_alarm_min, {0, 10'000});
  keys.duration(
      {"end_s", "s",
       "What fails within this time of the end of the drive and stays away has ended with it, and is no fault "
       "of the drive. It has more time if the vehicle stands."},
      end, {0, 600});
  keys.number({"placed_share", "", "Less of the drive's returns became points: a remark; less than half: drive again."},
              placed_share, {0, 1});
  keys.number({"again_share", "", "Alarms hold for more than this share of the driven path: drive again."}, again_share,
              {0, 1});
}

KeyError HealthLimits::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (pose_sigma_alarm_m < pose_sigma_m)
    return not_allowed("pose_sigma_alarm_m", number_text(pose_sigma_alarm_m), "at least pose_sigma_m");
  if (coloured_share_alarm > coloured_share)
    return not_allowed("coloured_share_alarm", number_text(coloured_share_alarm), "at most coloured_share");
  if (disk_left_alarm_min > disk_left_min)
    return not_allowed("disk_left_alarm_min", number_text(disk_left_alarm_min), "at most disk_left_min");
  return {};
}

}  // namespace hueline::config
