#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "score/figures.hpp"

namespace hueline::score {

/// What became of a recording on a computer whose disk or program failed.
struct RecordingFacts {
  std::uint64_t came = 0;     ///< packets while the program ran, including its own
  std::uint64_t refused = 0;  ///< packets of `came` for which the recorder's queue was full
  /// Packets of `came` that were read back, unchanged and in order, from what the disk held afterwards.
  std::uint64_t recovered = 0;
  std::uint64_t promised = 0;  ///< packets that the recording promises to hold
  std::uint64_t promised_missing = 0;
  std::uint64_t changed = 0;  ///< packets read back that were never written like this, or at another place
  std::uint64_t told = 0;     ///< lost packets that faults inside the recording report
  /// Lost packets that nothing reports (no fault, no end that is reported as cut), and packets that are reported lost
  /// but are not.
  std::uint64_t untold = 0;
  std::uint64_t untold_bytes = 0;
  double end_lost_s = 0;  ///< time from the last packet that was read back until the program ended
  /// Whether the cloud of the replay equals that of the same packets before they were written.
  bool is_same_cloud = false;
  std::string end;  ///< how recording and reading ended, in words
};

/// Adds the five figures of a recording and a note. Call it after `add_byte_figures()`, because bytes that were lost
/// without a report are added to the unexplained bytes. Without facts nothing was recorded.
void add_recording_figures(const std::optional<RecordingFacts>& facts, ScenarioScore& score);

}  // namespace hueline::score
