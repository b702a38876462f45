#pragma once

#include <vector>

#include "sim/scenario.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// What the brakes' control unit makes of its wheel sensors, `wheel.rate_hz` times a second from the drive's beginning
/// to its end: each wheel's mean speed over the cycle that ends then, and the pulses of the rear ones so far. The rear
/// axle lies below the body's origin. Empty if the vehicle has none.
std::vector<WheelSample> simulate_wheel(const Scenario& scenario, const Motion& motion);

}  // namespace hueline::sim
