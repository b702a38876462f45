#pragma once

#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/scenario.hpp"

namespace hueline::sim {

/// Writes the true trajectory of the vehicle as an SBET, the file in which programs deliver a trajectory that they have
/// calculated after the drive: 200 records a second, from 30 s before the drive to 5 s after it, with velocities and
/// headings in a frame that is turned from north to west by a wander angle, as POSPac's are. Errors: Io.
Status write_true_trajectory(const Scenario& scenario, const Drive& drive, const std::string& path);

}  // namespace hueline::sim
