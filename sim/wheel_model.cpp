#include "sim/wheel_model.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace hueline::sim {
namespace {

constexpr double kWheelbase_m = 2.7;

}  // namespace

std::vector<WheelSample> simulate_wheel(const Scenario& c, const Motion& motion) {
  std::vector<WheelSample> out;
  if (c.wheel.rate_hz <= 0) return out;
  const double cycle_s = 1 / c.wheel.rate_hz;
  const auto count = static_cast<std::uint64_t>(
      std::floor(static_cast<double>(c.end_gps_ns() - c.begin_gps_ns()) * 1e-9 * c.wheel.rate_hz));
  for (std::uint64_t i = 0; i <= count; ++i) {
    WheelSample sample;
    sample.gps_ns = c.begin_gps_ns() + std::llround(static_cast<double>(i) * cycle_s * 1e9);
    const GpsNs before = sample.gps_ns - std::llround(cycle_s * 1e9);
    const double turned = motion.turned_heading(sample.gps_ns) - motion.turned_heading(before);
    for (std::size_t wheel = 0; wheel < 4; ++wheel) {
      const double lateral = (wheel % 2 == 0 ? -0.5 : 0.5) * c.wheel.track_m;
      double metres = motion.way(sample.gps_ns, lateral) - motion.way(before, lateral);
      if (wheel < 2) metres = std::hypot(metres, turned * kWheelbase_m);  // the front wheels follow a wider bend
      double speed = c.wheel.scale * metres / cycle_s;
      // The sensor gives no pulses while the wheel stands, so its speed has no noise then.
      if (c.noise && speed > 0.05) speed += c.wheel.speed_sigma * gaussian(c.seed, kStreamWheel, 4 * i + wheel);
      sample.speed[wheel] = std::max(0.0, speed);
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const double turns = c.wheel.scale * motion.way(sample.gps_ns, (side == 0 ? -0.5 : 0.5) * c.wheel.track_m) /
                           c.wheel.circumference_m;
      sample.pulses[side] =
          static_cast<std::uint32_t>(std::max(0.0, std::floor(turns * c.wheel.pulses_per_turn + 0.37)));
    }
    out.push_back(sample);
  }
  return out;
}

}  // namespace hueline::sim
