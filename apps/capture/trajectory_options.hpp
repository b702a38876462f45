#pragma once

#include <memory>
#include <string>

#include "apps/command_line.hpp"
#include "runtime/post_trajectory.hpp"

namespace hueline::apps {

/// The options by which a user names a trajectory that was calculated after the drive.
struct TrajectoryOptions {
  std::string sbet, smrmsg, time = "gps", point;

  /// Declares the options of `command`. Their help begins with `prefix`. This object must live until the command has
  /// run.
  void declare(Command& command, const std::string& prefix = {});
  /// Returns why one of the files cannot be opened; ok if the user names none.
  Status check_files() const;
  /// Opens the trajectory and compares it with the POS's solutions of the drive. Returns null if the user names none.
  /// Errors: those of PostTrajectory::open(); Invalid for a point that is none.
  Result<std::unique_ptr<runtime::PostTrajectory>> open(const runtime::PostTrajectory::OwnSolutions& own) const;
  /// The same for a recording, read with the rig of a file or, if `rig` is empty, with its own. What is damaged in the
  /// recording is told.
  Result<std::unique_ptr<runtime::PostTrajectory>> open(const std::string& recording, const std::string& rig) const;
};

}  // namespace hueline::apps
