#pragma once

#include <filesystem>

#include "apps/score/cloud_print.hpp"
#include "apps/simulate/simulated_capture.hpp"
#include "score/recording_figures.hpp"

namespace hueline::apps {

/// What was read back of a simulated capture's file, held against what went into it.
struct RecoveredRecording {
  score::RecordingFacts facts;  ///< but for is_same_cloud, which needs the replay
  CloudPrint cloud;             ///< of the packets that were read back, as they were before they were written
};

/// `threads`: of the colouring; the cloud does not depend on it. Errors: those of for_each_simulated_packet; Io,
/// Malformed, Truncated: the file cannot be opened as a recording.
Result<RecoveredRecording> judge_recording(const SimulatedCapture& capture, const std::filesystem::path& file,
                                           const sim::Drive& drive, const sim::Timeline& timeline,
                                           const config::Rig& rig, int threads);

}  // namespace hueline::apps
