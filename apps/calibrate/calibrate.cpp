#include "apps/calibrate/calibrate.hpp"

#include <chrono>

#include <fmt/format.h>

#include "apps/commands.hpp"

namespace hueline::apps {

std::string today() {
  const std::chrono::year_month_day date{std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now())};
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                     static_cast<unsigned>(date.day()));
}

void add_calibrate(Command& all) {
  Command calibrate = all.command(kCalibrate.word, kCalibrate.help);
  calibrate.needs_command();
  add_calibrate_lens(calibrate);
  add_calibrate_mount(calibrate);
  add_calibrate_boresight(calibrate);
  add_calibrate_targets(calibrate);
  add_calibrate_example(calibrate);
}

}  // namespace hueline::apps
