#pragma once

#include <deque>
#include <filesystem>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "storage/copc_format.hpp"
#include "storage/file_writer.hpp"
#include "storage/las_reader.hpp"
#include "storage/laz_format.hpp"

namespace hueline::products {

/// A LAZ file that is made of whole chunks of records. The chunks are compressed on threads and stand in the file in
/// the order in which they were added, so the number of threads does not change the bytes. At most `threads` chunks are
/// held in memory. Thread safety: none; one thread makes all calls.
class LazFile {
 public:
  /// Creates the file. `header` describes the records (point_format without the flag of LAZ) and gets its sizes and
  /// offsets here; its counts and its bounds are those of the points that are counted with count(), whatever it says.
  /// `records` are the variable length records, to which that of LASzip is added at the end.
  /// `chunk_points` is kLazVariableChunks if the chunks differ. Errors: Invalid (another point format); Io.
  static Result<LazFile> create(const std::filesystem::path& path, const storage::LasHeader& header,
                                const std::vector<storage::LasVlr>& records, std::uint32_t chunk_points, int threads);

  /// Counts a point in the header, and widens the header's bounds to it.
  void count(const storage::LasPoint& point);
  /// Adds a chunk of whole records, at least one. Error: Io.
  Status add(storage::Bytes records);
  /// Writes what is still being compressed, and the table. No chunk may be added after it.
  Status end_chunks();
  /// Appends bytes behind the table.
  Status append(storage::ByteView bytes) { return file_.write(bytes); }
  /// Replaces bytes that are in the file.
  Status overwrite(std::uint64_t offset, storage::ByteView bytes) { return file_.overwrite(offset, bytes); }
  /// Writes the header with its final counts and bounds, and closes the file.
  Status close();

  /// The chunks in the file; complete after end_chunks().
  const std::vector<storage::LazPlace>& places() const { return places_; }
  std::uint64_t size() const { return file_.size(); }
  storage::LasHeader& header() { return header_; }
  std::uint64_t points() const { return header_.point_count; }

 private:
  explicit LazFile(storage::FileWriter file) : file_(std::move(file)) {}
  Status write_oldest();

  struct Waiting {
    std::future<storage::Bytes> bytes;
    std::uint32_t points = 0;
  };
  storage::FileWriter file_;
  storage::LasHeader header_;
  storage::LazRecord kind_;
  bool has_points_ = false;
  std::size_t threads_ = 1;
  std::deque<Waiting> waiting_;
  std::vector<storage::LazPlace> places_;
};

/// Returns the records of a cloud that also describe a copy of it: not those of its own compression.
std::vector<storage::LasVlr> lasting_records(const std::vector<storage::LasVlr>& records);

}  // namespace hueline::products
