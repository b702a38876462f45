#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "storage/file_writer.hpp"

namespace hueline::apps {

/// Writes packets of a Ladybug as its stream files (drivers/ladybug/pgr_source.hpp), which drivers::PgrSource reads. A
/// head that was recorded from such a file is written with its configuration as it was, and begins a new file; images
/// that came over USB get a head that has what is publicly known, and no configuration: the camera keeps that, and the
/// maker's programs need it. A file that would pass 2 GB is ended, and the next number begins.
/// Thread safety: none; one thread calls all functions.
class PgrFile {
 public:
  /// `first` ends in a number of six digits, such as drive-000000.pgr. An existing file is replaced when the new one is
  /// whole. Errors: Invalid, it has no number.
  static Result<PgrFile> create(const std::filesystem::path& first);

  /// Takes the bytes of one packet: a head, an image or a GPS summary. Errors: Io.
  Status write(std::span<const std::byte> packet);
  /// Ends the last file. Errors: Io.
  Status close();
  /// How many files are whole.
  std::size_t files() const { return files_; }
  /// The first file that this run has not written.
  const std::filesystem::path& next() const { return next_; }
  /// Returns whether an earlier and longer run has left a file of the next number. A reader goes on with it.
  bool has_following() const;
  /// Removes those files; next() is behind them afterwards. For the end, when all packets are written. Errors: Io.
  Status remove_following();

 private:
  explicit PgrFile(std::filesystem::path next) : next_(std::move(next)) {}
  Status begin(std::span<const std::byte> first_image);

  std::filesystem::path next_;
  std::vector<std::byte> head_;  // with the configuration; empty: none was recorded
  std::optional<storage::FileWriter> file_;
  std::vector<std::uint64_t> index_;  // places of every 50th image
  std::uint64_t images_ = 0, first_image_ = 0;
  std::vector<std::byte> summary_;
  std::size_t files_ = 0;
};

}  // namespace hueline::apps
