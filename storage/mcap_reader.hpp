#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/input_file.hpp"
#include "storage/mcap_format.hpp"

namespace hueline::storage {

/// A message as it lies in the file.
struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;  ///< ns
  Buffer data;                                   ///< a part of the memory of its chunk, not a copy
};

/// Reads an MCAP file from front to back, whether it is finished or not. The summary is not needed, it is only checked.
/// Chunks may be uncompressed, lz4 or zstd. A chunk may have at most 512 MiB uncompressed, and all compressed chunks
/// together at most 8 GiB or 64 times the size of the file, whichever is more. Move-only.
///
/// The CRC of each chunk is checked before any part of it is returned. At the end the CRC of the data section, the CRC
/// of the summary and the number of messages are checked as well.
/// Thread safety: none; one thread calls all functions.
class McapReader {
 public:
  /// Opens the file and reads up to the first message, so that the records before it are known.
  static Result<McapReader> open(const std::filesystem::path& path);

  /// Returns the next message in the order of the file. Errors:
  /// - EndOfData: everything is read and whole.
  /// - Truncated: the file was cut. All whole messages were returned before. Later calls repeat it.
  /// - Malformed: a chunk or record is damaged and was skipped. Call again to continue. At the end of the file it is
  ///   followed by EndOfData.
  /// - Io, Unsupported.
  Result<McapMessage> next();

  /// For a file that another program is writing: looks how far it is now. If it has grown since next() returned
  /// Truncated, next() goes on with what has come, and this returns true.
  bool look_again();
  /// Returns whether next() has returned EndOfData.
  bool is_whole() const { return end_ && end_->code == ErrorCode::EndOfData; }

  /// Passes over chunks that hold only messages with an earlier `log_time`, ns, without reading them; the CRC and the
  /// counts of the whole file are then not checked. Chunks that hold others are read whole. 0: reads all again. Which
  /// these are is taken from the index in the summary; of a file without one the head of each chunk is read.
  void skip_chunks_before(std::uint64_t log_time) { skip_before_ = log_time; }
  /// Passes over chunks that hold no message of these channels, without reading them, likewise; of a file without an
  /// index nothing is passed over. Empty: reads all again.
  void skip_chunks_without(std::vector<std::uint16_t> channels) { only_ = std::move(channels); }
  std::uint64_t chunks_skipped() const { return chunks_skipped_; }
  /// Returns whether the file has an index of its chunks. The first call reads it.
  bool has_index() { return !index().empty(); }

  // What was read so far. At the end of a finished file also the channels without a message, and their schemas.
  const std::map<std::uint16_t, McapSchema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, McapChannel>& channels() const { return channels_; }
  const std::vector<McapMetadata>& metadata() const { return metadata_; }
  const std::vector<McapAttachment>& attachments() const { return attachments_; }
  /// From the summary; available only after the end of a finished file.
  const std::optional<McapStatistics>& statistics() const { return statistics_; }
  const std::string& profile() const { return profile_; }
  const std::string& library() const { return library_; }

  /// Byte offset of the next record of the data section.
  std::uint64_t position() const { return at_; }
  std::uint64_t file_size() const { return file_.size(); }
  std::uint64_t messages_read() const { return messages_read_; }

 private:
  explicit McapReader(InputFile file);
  Result<Buffer> read(std::uint64_t offset, std::uint64_t size);
  std::optional<Error> read_record();
  std::optional<Error> load_chunk(const Buffer& record, std::uint64_t record_at, std::uint32_t& data_crc);
  std::optional<Error> take_description(McapOpcode opcode, ByteView content, std::uint64_t record_at);
  std::optional<Error> take_from_chunk(std::optional<McapMessage>& message);
  Error check_end(std::uint32_t stated_data_crc);
  struct IndexedChunk {
    std::uint64_t begin = 0, end = 0;     // in the file; the messages' indexes, which follow a chunk, included
    std::uint64_t newest = 0;             // log time, ns
    std::vector<std::uint16_t> channels;  // of its messages; empty: not known
  };
  bool is_passed_over(const IndexedChunk& chunk) const;
  const std::vector<IndexedChunk>& index();
  bool pass_over_by_index();
  Error truncated(std::uint64_t at, const std::string& inside) const;
  Error damaged(std::uint64_t at, const std::string& what) const;

  InputFile file_;
  BufferPool pool_;
  std::uint64_t at_ = 0;
  Buffer chunk_;  // messages of the current chunk, uncompressed
  std::size_t chunk_at_ = 0;
  std::uint64_t chunk_file_at_ = 0;
  std::uint32_t data_crc_ = 0;
  std::uint64_t unpacked_ = 0;  // bytes of all compressed chunks so far
  std::uint64_t skip_before_ = 0, chunks_skipped_ = 0;
  std::vector<std::uint16_t> only_;                 // channels; empty: all
  std::optional<std::vector<IndexedChunk>> index_;  // in the order of the file; empty: not read yet
  bool damage_reported_ = false;
  std::optional<Error> end_, pending_;  // pending_: an error met while opening, returned by the first next()
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::vector<McapMetadata> metadata_;
  std::vector<McapAttachment> attachments_;
  std::optional<McapStatistics> statistics_;
  std::string profile_, library_;
  std::uint64_t messages_read_ = 0;
};

/// Returns the newest `log_time` of an MCAP file, ns: by its summary, and of a file without one by the heads of its
/// chunks. Empty if it has no message, or cannot be read.
std::optional<std::uint64_t> newest_log_time(const std::filesystem::path& path);

}  // namespace hueline::storage
