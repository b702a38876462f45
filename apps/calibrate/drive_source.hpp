#pragma once

#include <functional>
#include <optional>
#include <string>

#include "apps/progress_bar.hpp"
#include "config/rig.hpp"
#include "runtime/recording.hpp"
#include "sim/drive.hpp"
#include "sim/scenario.hpp"

namespace hueline::apps {

/// A drive that is read either from a recording or from a simulated scenario without sockets, with the rig for it.
struct DriveSource {
  config::Rig rig;
  std::optional<runtime::Recording> recording;
  std::optional<sim::Scenario> scenario;  ///< set if there is no recording
  std::optional<sim::Drive> drive;        ///< the simulated drive of `scenario`

  /// Opens a drive. One of `recording` and `scenario` names a file; the other is empty. If `rig_file` is empty, the rig
  /// is that of the recording, or a perfect calibration of the scenario's vehicle. `cache` is the folder of simulated
  /// drives; a drive that is not there is rendered, and `bar` shows the progress.
  /// Errors: those of Recording::open and sim::generate. Throws ConfigError for a wrong rig or scenario.
  static Result<DriveSource> open(const std::string& recording, const std::string& scenario, const std::string& cache,
                                  const std::string& rig_file, ProgressBar& bar);

  /// Calls `use` with every packet in order until it returns false. `bar` shows the minute of a recording or the share
  /// of a simulated drive.
  Status feed(ProgressBar& bar, const std::function<bool(const Packet&)>& use);
};

}  // namespace hueline::apps
