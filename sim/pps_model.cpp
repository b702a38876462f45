#include "sim/pps_model.hpp"

#include <cmath>

#include "sim/noise.hpp"

namespace hueline::sim {

std::vector<std::int64_t> simulate_pps(const Scenario& c) {
  std::vector<std::int64_t> errors;
  std::uint64_t index = 0;
  for (GpsNs t = c.begin_gps_ns(); t <= c.end_gps_ns(); t += 1'000'000'000, ++index) {
    double error_us = 0;
    if (c.noise) {
      error_us = c.pps.jitter_us * gaussian(c.seed, kStreamPps, index);
      const double draw = uniform(c.seed, kStreamPpsSpike, index);
      if (draw < c.pps.spike_probability) error_us += c.pps.spike_us * draw / c.pps.spike_probability;
    }
    errors.push_back(std::llround(error_us * 1000));
  }
  return errors;
}

}  // namespace hueline::sim
