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

/// A drive to be read: a recording, or a simulated one without sockets; and the rig that it is read with.
struct DriveSource {
  config::Rig rig;
  std::optional<runtime::Recording> recording;
  std::optional<sim::Scenario> scenario;  ///< one of both
  std::optional<sim::Drive> drive;        ///< of the scenario

  /// `recording` or `scenario` names a file, the other is empty. `rig_file` empty: the recording's own, or a perfect
  /// calibration of the scenario's vehicle. `cache`: folder of simulated drives, which is rendered if it is not there:
  /// `bar` shows how far. Errors: those of Recording::open and sim::generate; throws ConfigError.
  static Result<DriveSource> open(const std::string& recording, const std::string& scenario, const std::string& cache,
                                  const std::string& rig_file, ProgressBar& bar);

  /// Every packet in order, until `use` says false. `bar` shows the minute of a recording, the share of a simulated
  /// drive.
  Status feed(ProgressBar& bar, const std::function<bool(const Packet&)>& use);
};

}  // namespace hueline::apps
