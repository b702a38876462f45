#include "apps/export/drive_path.hpp"

#include <algorithm>
#include <cstdio>

namespace hueline::apps {

Result<Status> for_each_of_path(const TrajectoryOptions& options, runtime::Recording& recording,
                                const std::function<void(const InsSolution&)>& use) {
  HostTime newest{}, at_solution{};
  const auto feed = [&](const std::function<bool(const Packet&)>& take) {
    return recording.for_each([&](const Packet& packet) {
      newest = std::max(newest, packet.received);
      return take(packet);
    });
  };
  Status read;
  const auto trajectory = options.open([&](const std::function<void(const InsSolution&)>& own) {
    read = runtime::for_each_solution(recording.rig, feed, [&](const InsSolution& solution) {
      at_solution = newest;
      own(solution);
    });
    return Status();  // what is damaged is told at the end
  });
  if (!trajectory.ok()) return trajectory.error();
  if (*trajectory == nullptr) return runtime::for_each_solution(recording, use);
  std::fputs((*trajectory)->comparison().text().c_str(), stdout);
  // The drive goes on where its POS was lost. Behind it the file may have other drives.
  (*trajectory)->take_until((*trajectory)->comparison().drive_end + (newest - at_solution), use);
  return read.ok() ? (*trajectory)->status() : read;
}

}  // namespace hueline::apps
