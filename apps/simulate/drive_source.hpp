#pragma once

#include <functional>
#include <optional>
#include <string>

#include "apps/progress_bar.hpp"
#include "apps/simulate/drive_options.hpp"
#include "config/rig.hpp"
#include "runtime/post_trajectory.hpp"
#include "runtime/products.hpp"
#include "runtime/recording.hpp"
#include "sim/drive.hpp"
#include "sim/scenario.hpp"

namespace hueline::apps {

/// A drive that a command reads, and the rig that it is read with. The drive is a recording, or a simulated drive whose
/// packets need no sockets.
struct DriveSource {
  config::Rig rig;
  std::optional<runtime::Recording> recording;  ///< empty: the packets are those of `drive`
  std::optional<sim::Scenario> scenario;        ///< empty: the options name none
  std::optional<sim::Drive> drive;              ///< of the scenario

  /// Opens what `options` name. A simulated drive that is not in the folder of simulated drives is rendered; `bar`
  /// shows how far that is. `method`, lens or panorama, is that of the scenario's own rig. Errors: those of
  /// Recording::open and sim::generate. Throws ConfigError.
  static Result<DriveSource> open(const DriveOptions& options, ProgressBar& bar, const std::string& method = "lens");

  /// Calls `use` with every packet in order, until it returns false. `bar` shows the minute of a recording, or the
  /// share of a simulated drive.
  Status feed(ProgressBar& bar, const std::function<bool(const Packet&)>& use);

  /// Gives `sink` what the pipeline of a rig makes of the packets, to their end or until `wants_more` returns false,
  /// but for coloured points: for sinks that need times, poses, images and returns alone, or colour by themselves. The
  /// poses are those of `trajectory`, if it is given.
  Status feed_without_colours(
      ProgressBar& bar, config::Rig sensors, runtime::ProductSink& sink, runtime::PostTrajectory* trajectory = nullptr,
      const std::function<bool()>& wants_more = [] { return true; });
};

}  // namespace hueline::apps
