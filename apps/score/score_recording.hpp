#pragma once

#include <filesystem>

#include "apps/score/cloud_print.hpp"
#include "apps/simulate/simulated_capture.hpp"
#include "score/recording_figures.hpp"

namespace hueline::apps {

/// The comparison of a simulated capture's file with what the capture recorded.
struct RecoveredRecording {
  score::RecordingFacts facts;  ///< all facts except is_same_cloud, which needs the replay
  /// Cloud of the packets that were read back, computed from them as they were before they were written.
  CloudPrint cloud;
};

/// Reads `file` back and compares it with `capture`. `threads` is the number of colouring threads; the cloud does not
/// depend on it.
/// Errors: those of for_each_simulated_packet; Io, Malformed or Truncated if the file cannot be opened as a recording.
Result<RecoveredRecording> judge_recording(const SimulatedCapture& capture, const std::filesystem::path& file,
                                           const sim::Drive& drive, const sim::Timeline& timeline,
                                           const config::Rig& rig, int threads);

}  // namespace hueline::apps
