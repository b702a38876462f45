#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "apps/command_line.hpp"

namespace hueline::apps {

/// The options by which a user names the drive that a command reads, and the rig that it is read with.
struct DriveOptions {
  std::string recording;  ///< drive.mcap; empty: the simulated drive of `scenario` is read
  std::string scenario;
  std::string cache;  ///< `--sim`, the folder of simulated drives
  std::string rig;    ///< empty: the recording's own, or a perfect calibration of the scenario's vehicle
  std::optional<std::stop_token>
      follows;  ///< a recording that a capture is writing is followed until this is requested

  /// What differs between commands.
  struct Words {
    const char* recording;  ///< "RECORDING" or "--recording"
    const char* recording_help;
    const char* rig_help;
    bool needs_scenario = false;  ///< the command needs the scenario of a recording too, for its truth
  };
  /// Declares the options of `command`. This object must live until the command has run.
  void declare(Command& command, const Words& words);
  /// Throws ConfigError unless the options name a recording, or else a scenario, and `--sim` where there is a scenario.
  /// For commands without `needs_scenario`; the others have all they need.
  void check() const;
};

}  // namespace hueline::apps
