#include "apps/calibrate/calibrate.hpp"

#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "apps/commands.hpp"
#include "core/angle.hpp"

namespace hueline::apps {

std::string today() {
  const std::chrono::year_month_day date{std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now())};
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                     static_cast<unsigned>(date.day()));
}

Eigen::Quaterniond off_start(double off_deg, int number, int count) {
  Eigen::Vector3d axis(1, -2, 1.5);
  if (count > 1) {
    const double z = 1 - (2 * number + 1.0) / count, around = number * 2.399963229728653;
    axis = {std::sqrt(1 - z * z) * std::cos(around), std::sqrt(1 - z * z) * std::sin(around), z};
  }
  return Eigen::Quaterniond(Eigen::AngleAxisd(off_deg * kRadPerDeg, axis.normalized()));
}

void add_calibrate(Command& all) {
  Command calibrate = all.command(kCalibrate.word, kCalibrate.help);
  calibrate.needs_command();
  add_calibrate_lens(calibrate);
  add_calibrate_mount(calibrate);
  add_calibrate_mask(calibrate);
  add_calibrate_boresight(calibrate);
  add_calibrate_targets(calibrate);
  add_calibrate_example(calibrate);
}

}  // namespace hueline::apps
