#include "drivers/trajectory/sbet_record.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/calendar.hpp"

namespace hueline::drivers {
namespace {
constexpr double kWeek_s = static_cast<double>(kSecondsPerWeek);
}

SbetRecord sbet_record(std::span<const double> v) {
  SbetRecord record;
  record.second = v[0];
  record.position = {v[1], v[2], v[3]};
  record.roll = v[7];
  record.pitch = v[8];
  record.platform_heading = v[9];
  record.wander = v[10];
  return record;
}

std::string impossible_sbet(std::span<const double> v) {
  const auto wrong = [](const char* what, double value, const char* unit) {
    return fmt::format("{} of {:.6g} {}", what, value, unit);
  };
  // A week's seconds may go on beyond its end.
  if (!(v[0] >= 0 && v[0] < 3 * kWeek_s)) return wrong("a time", v[0], "s of the week");
  if (!(std::abs(v[1]) <= std::numbers::pi / 2)) return wrong("a latitude", v[1], "rad");
  if (!(std::abs(v[2]) <= 2 * std::numbers::pi)) return wrong("a longitude", v[2], "rad");
  if (!(std::abs(v[3]) < 1e5)) return wrong("a height", v[3], "m");
  for (std::size_t i = 4; i < 7; ++i)
    if (!(std::abs(v[i]) < 1e4)) return wrong("a velocity", v[i], "m/s");
  for (std::size_t i = 7; i < 11; ++i)
    if (!(std::abs(v[i]) <= 4 * std::numbers::pi)) return wrong("an angle", v[i], "rad");
  return {};
}

double continued_second(double second, const std::optional<double>& last) {
  while (last && second < *last - kWeek_s / 2) second += kWeek_s;
  return second;
}

}  // namespace hueline::drivers
