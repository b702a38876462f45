#include "apps/simulate/drive_trajectory.hpp"

#include <functional>

#include "apps/simulate/drive_source.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {

Result<std::unique_ptr<runtime::PostTrajectory>> open_trajectory(const TrajectoryOptions& options,
                                                                 const DriveOptions& drive, ProgressBar& bar,
                                                                 const std::string& method) {
  return options.open([&](const std::function<void(const InsSolution&)>& use) -> Status {
    auto source = DriveSource::open(drive, bar, method);
    if (!source.ok()) return source.error();
    if (source->recording) return runtime::for_each_solution(*source->recording, use);
    return runtime::for_each_solution(
        source->rig, [&](const auto& take) { return source->feed(bar, take); }, use);
  });
}

}  // namespace hueline::apps
