#pragma once

#include <vector>

#include "sim/vehicle.hpp"

namespace hueline::sim {

/// What the POS reports over begin .. end of the scenario, at whole multiples of its period: the true pose, seen in the
/// local level at the vehicle's own place (not at the scene's origin), plus slow first-order Gauss-Markov errors and
/// white noise; in outages the drift of ins_outage.hpp on top, told by status and sigma.
std::vector<InsSample> simulate_ins(const Scenario& scenario, const Motion& motion);

/// Place of the scene's origin.
GeodeticPlace scene_origin(const Scenario& scenario);

}  // namespace hueline::sim
