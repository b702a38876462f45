#pragma once

#include <string>

#include "apps/progress_bar.hpp"
#include "apps/simulate/drive_source.hpp"
#include "score/figures.hpp"

namespace hueline::apps {

/// The figures of a recording that need no truth.
struct ScoredDrive {
  score::ScenarioScore score;
  Status read;  ///< whether the recording could be read to its end; the figures are those of the part before
};

/// Runs a recording through the pipeline and computes the figures that need no truth. Every other metric has a reason
/// instead of a value. `threads` does not change the figures. Throws ConfigError if the rig has no camera head or no
/// scanner.
ScoredDrive score_drive(DriveSource& source, const std::string& name, int threads, ProgressBar& bar);

}  // namespace hueline::apps
