#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "storage/journal_header.hpp"

/// The names of the files of one recording, and what each says about the others. A recording that is split is
/// `drive.mcap`, `drive.000002.mcap`, `drive.000003.mcap` and so on. Each is a whole recording by itself.
namespace hueline::storage {

/// Notes of a segment in JournalHeader::about. A recording that is never split has none of them.
constexpr const char* kSegmentRecording = "recording";  ///< the same random word in all segments of a recording
constexpr const char* kSegmentNumber = "segment";       ///< counted from 1
constexpr const char* kSegmentFollows = "follows";      ///< sequence of the last packet before; absent in the first
constexpr const char* kSegmentRemoved = "removed";      ///< numbers that the ring has removed: "2-4,7"
constexpr const char *kSegmentRemovedPackets = "removed_packets", *kSegmentRemovedBytes = "removed_bytes";  ///< in them
constexpr std::uint32_t kMostSegments = 999'999;

/// What a ring has removed of a recording.
struct RemovedSegments {
  std::uint64_t segments = 0, packets = 0, bytes = 0;
};

/// A segment in a folder.
struct Segment {
  std::uint32_t number = 1;
  std::filesystem::path path;
};

/// Returns the file of a segment: `first` itself for number 1.
std::filesystem::path segment_path(const std::filesystem::path& first, std::uint32_t number);
/// Returns what segment_path() would make this file of: the file of number 1, and the number.
Segment first_of(const std::filesystem::path& segment);

/// Returns the segments of a recording in their order, from the named one on, by their names alone. The list is never
/// empty: if the named one is not there, it holds that name. Errors: those of list_folder().
Result<std::vector<Segment>> find_segments(const std::filesystem::path& named);

/// What a segment says about its place in the recording. Empty texts: it is not one of several.
struct SegmentPlace {
  std::string recording;
  std::uint32_t number = 1;
  std::optional<std::uint64_t> follows;
  std::vector<bool> removed;  ///< by number; may be shorter
  std::uint64_t removed_packets = 0, removed_bytes = 0;

  /// Reads it from the notes of a header. Notes that are no numbers count as absent.
  static SegmentPlace of(const JournalHeader& header);
  /// Writes it into the notes.
  void put_into(JournalHeader& header) const;
  RemovedSegments removed_so_far() const;
  bool is_removed(std::uint32_t segment) const { return segment < removed.size() && removed[segment]; }
};

}  // namespace hueline::storage
