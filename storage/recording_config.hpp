#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "storage/segmented_journal.hpp"

namespace hueline::storage {

/// How the recording of a drive is split, what of it is kept, and where it goes on when its volume is full. Nothing
/// that is made from a recording depends on it.
struct RecordingConfig {
  double segment_mb = 0;       ///< most MB of a segment; 0: any
  double segment_min = 0;      ///< longest minutes of a segment; 0: any
  double ring_gb = 0;          ///< most GB of all segments; 0: everything is kept
  double ring_h = 0;           ///< hours that are kept; 0: everything is kept
  double power_cut_s = 2;      ///< most seconds that a power cut may lose
  double mark_before_min = 5;  ///< minutes before an operator's mark that a ring keeps
  double mark_after_min = 5;   ///< the same after it
  std::vector<std::string> volumes;
  bool pack_images = false;  ///< images are stored packed, without loss (storage/packed_rows.hpp)

  void visit(Keys& keys);
  KeyError validate() const;
  /// Returns the settings of the journal. `name` is SegmentedJournal::Config::recording.
  SegmentedJournal::Config journal(std::string name) const;
  bool operator==(const RecordingConfig&) const = default;
};

/// Returns why a volume cannot take over a recording in the folder `drive`, as the rest of a sentence about the volume:
/// it is no folder, nothing can be written there, or it lies on the same disk. Empty: it can.
std::string volume_trouble(const std::filesystem::path& volume, const std::filesystem::path& drive);

/// Returns a random word that names a recording among others.
std::string random_recording_name();

}  // namespace hueline::storage
