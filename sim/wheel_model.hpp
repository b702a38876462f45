#pragma once

#include <vector>

#include "sim/scenario.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// Returns what the control unit of the brakes reports, `wheel.rate_hz` times a second from the drive's beginning to
/// its end. A sample holds the mean speed of each wheel over the cycle that ends at its time, and the pulses of the
/// rear wheels so far. The rear axle lies below the body's origin. Empty if the vehicle has no encoder.
std::vector<WheelSample> simulate_wheel(const Scenario& scenario, const Motion& motion);

}  // namespace hueline::sim
