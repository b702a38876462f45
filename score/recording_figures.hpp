#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "score/figures.hpp"

namespace hueline::score {

/// What became of a recording on a computer whose disk or program failed.
struct RecordingFacts {
  std::uint64_t came = 0;       ///< packets while the program ran, its own included
  std::uint64_t refused = 0;    ///< of these, the recorder's queue was full
  std::uint64_t recovered = 0;  ///< read back from what the disk held afterwards: the same, in their order
  std::uint64_t promised = 0;   ///< that the recording promises to hold
  std::uint64_t promised_missing = 0;
  std::uint64_t changed = 0;  ///< read back, but never written so, or at another place
  std::uint64_t told = 0;     ///< lost packets that faults inside the recording tell of
  std::uint64_t untold =
      0;  ///< lost packets that nothing tells of: no fault, no end that is told cut; or told and not lost
  std::uint64_t untold_bytes = 0;
  double end_lost_s = 0;       ///< from the last packet read back until the program ended
  bool is_same_cloud = false;  ///< the replay's, and that of the same packets before they were written
  std::string end;             ///< how recording and reading ended, in words
};

/// The five figures of a recording and a note; bytes lost untold are unexplained ones too: after add_byte_figures.
/// Without facts nothing was recorded.
void add_recording_figures(const std::optional<RecordingFacts>& facts, ScenarioScore& score);

}  // namespace hueline::score
