#pragma once

#include <vector>

#include "sim/vehicle.hpp"

namespace hueline::sim {

/// Returns what the POS reports from begin to end of the scenario, at whole multiples of its period. A solution is the
/// true pose, expressed in the local level at the vehicle's own place (not at the scene's origin), plus slow
/// first-order Gauss-Markov errors and white noise. During outages the drift of ins_outage.hpp is added, and status and
/// sigmas report it.
std::vector<InsSample> simulate_ins(const Scenario& scenario, const Motion& motion);

/// Returns the place of the scene's origin.
GeodeticPlace scene_origin(const Scenario& scenario);

}  // namespace hueline::sim
