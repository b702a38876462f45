#pragma once

#include <functional>
#include <memory>
#include <string>

#include "config/rig.hpp"
#include "core/result.hpp"
#include "storage/journal_reader.hpp"

namespace hueline::runtime {

/// What a recording with that rig says about itself before its first packet.
storage::JournalHeader journal_header(const config::Rig& rig);

/// What a user means who names a drive: its folder stands for `name` inside it, if that is there. Anything else stands
/// for itself.
std::string drive_file(const std::string& path, const char* name = "drive.mcap");

/// A recording with the rig that it is to be read with.
struct Recording {
  config::Rig rig;
  std::unique_ptr<storage::JournalReader> journal;

  /// `path`: a recording, or a drive's folder. `rig_file` empty: the rig inside the recording. Another rig must name
  /// the same sensors in the same order (Invalid); ConfigError for one that is wrong. Unsupported: the rig inside is
  /// not one of this version.
  static Result<Recording> open(const std::string& path, const std::string& rig_file = {});

  /// Every packet in order, until `use` says false. Damaged chunks are passed over and told at the end. Ok at a whole
  /// end.
  Status for_each(const std::function<bool(const Packet&)>& use);
};

}  // namespace hueline::runtime
