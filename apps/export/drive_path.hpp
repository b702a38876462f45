#pragma once

#include <functional>

#include "apps/capture/trajectory_options.hpp"
#include "core/measurements.hpp"
#include "core/result.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {

/// Calls `use` for every solution along the path of a drive, in order: those of its POS, or of the trajectory that
/// `options` name from the drive's begin to its end, which is then compared with the POS first. Returns how the reading
/// ended: ok, or what is damaged. Errors: those of TrajectoryOptions::open(). The recording must not have been read
/// yet.
Result<Status> for_each_of_path(const TrajectoryOptions& options, runtime::Recording& recording,
                                const std::function<void(const InsSolution&)>& use);

}  // namespace hueline::apps
