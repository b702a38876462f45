#pragma once

#include <memory>
#include <string>

#include "apps/command_line.hpp"
#include "runtime/post_trajectory.hpp"

namespace hueline::apps {

/// The options by which a user names a trajectory that was calculated after the drive.
struct TrajectoryOptions {
  std::string sbet, smrmsg, time = "gps", point;

  /// Declares the options of `command`. This object must live until the command has run.
  void declare(Command& command);
  /// Opens the trajectory and compares it with the POS's solutions of the drive. Returns null if the user names none.
  /// Errors: those of PostTrajectory::open(); Invalid for a point that is none.
  Result<std::unique_ptr<runtime::PostTrajectory>> open(const runtime::PostTrajectory::OwnSolutions& own) const;
};

}  // namespace hueline::apps
