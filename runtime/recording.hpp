#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "config/rig.hpp"
#include "core/measurements.hpp"
#include "core/result.hpp"
#include "storage/journal_reader.hpp"

namespace hueline::runtime {

/// Returns what a recording with that rig says about itself before its first packet.
storage::JournalHeader journal_header(const config::Rig& rig);

/// Returns the file that a user means who names a drive: if `path` is a folder that has a file `name`, that file,
/// otherwise `path` itself.
std::string drive_file(const std::string& path, const char* name = "drive.mcap");

/// Returns the same for the cloud of a drive, whatever its format is.
std::string drive_cloud(const std::string& path);

/// Opens the recording that a user names by its file or by its drive's folder. Errors: those of JournalReader::open();
/// Io with what a folder lacks that has no recording.
Result<std::unique_ptr<storage::JournalReader>> open_journal(const std::string& named);

/// Returns the file of the cloud that a user names by itself or by its drive's folder. Error: Io with what a folder
/// lacks that has no cloud. Whether a file is there is not looked at.
Result<std::string> find_cloud(const std::string& named);

/// A recording, and the rig that it is read with.
struct Recording {
  config::Rig rig;
  std::unique_ptr<storage::JournalReader> journal;
  /// If set, for_each() follows a recording that a capture is writing.
  std::optional<std::stop_token> follows{};

  /// Opens a recording or a drive's folder. If `rig_file` is empty, the rig inside the recording is used; another rig
  /// must name the same sensors in the same order. Errors: Invalid if the sensors differ; Unsupported if the rig inside
  /// the recording is not one of this version; those of JournalReader::open(). Throws ConfigError for a rig file that
  /// is wrong.
  static Result<Recording> open(const std::string& path, const std::string& rig_file = {});

  /// Calls `use` for every packet in order until it returns false. Damaged chunks are skipped and reported at the end.
  /// Returns ok at a whole end. With `follows` it waits at the present end of the recording for more, until the capture
  /// has closed the recording or is gone; Stopped if a stop is requested.
  Status for_each(const std::function<bool(const Packet&)>& use);

 private:
  bool is_more_coming();
};

/// Waits until a recording that a capture is beginning to write can be opened, or nobody writes it, or `stop`.
void wait_for_recording(const std::string& named, const std::stop_token& stop);

/// Calls `use` for every solution of the rig's POS among the packets that `feed` gives, in order, with the sigma that
/// the POS gave last. Returns the status of `feed`.
Status for_each_solution(const config::Rig& rig,
                         const std::function<Status(const std::function<bool(const Packet&)>& take)>& feed,
                         const std::function<void(const InsSolution&)>& use);
/// The same of a recording. Chunks without a packet of the POS are not read, if the recording has an index: large
/// images have chunks of their own.
Status for_each_solution(Recording& recording, const std::function<void(const InsSolution&)>& use);

}  // namespace hueline::runtime
