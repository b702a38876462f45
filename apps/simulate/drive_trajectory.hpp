#pragma once

#include <memory>
#include <string>

#include "apps/capture/trajectory_options.hpp"
#include "apps/progress_bar.hpp"
#include "apps/simulate/drive_options.hpp"
#include "core/result.hpp"
#include "runtime/post_trajectory.hpp"

namespace hueline::apps {

/// Opens the trajectory that `options` name, and compares it with the POS's solutions of the drive. Returns null if
/// they name none. `bar` and `method` are as for DriveSource::open. Errors: those of DriveSource::open and
/// TrajectoryOptions::open. Throws ConfigError.
Result<std::unique_ptr<runtime::PostTrajectory>> open_trajectory(const TrajectoryOptions& options,
                                                                 const DriveOptions& drive, ProgressBar& bar,
                                                                 const std::string& method = "lens");

}  // namespace hueline::apps
