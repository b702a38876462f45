#pragma once

#include <map>
#include <optional>
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
  Buffer data;                                   ///< a part of its chunk's memory: no copy
};

/// Reads an MCAP file from front to back, finished or not: the summary is not needed, only checked. Chunks none, lz4,
/// zstd; uncompressed at most 512 MiB each, and in all 8 GiB or 64 times the file's size, whichever is more.
/// Thread-bound. Move-only.
///
/// Each chunk's CRC is checked before any of it is handed on. At the end the CRC of the data section, the summary's CRC
/// and the number of messages are checked as well.
class McapReader {
 public:
  /// Reads up to the first message, so that what stands before it is known.
  static Result<McapReader> open(const std::filesystem::path& path);

  /// The next message in file order. Errors:
  /// EndOfData: all is read and whole. Truncated: the file was cut; everything whole was given; repeated by later
  /// calls. Malformed: a chunk or record is damaged; it was skipped, call again to go on (at the end of the file:
  /// repeated). Io, Unsupported: as they say.
  Result<McapMessage> next();

  // What was seen so far.
  const std::map<std::uint16_t, McapSchema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, McapChannel>& channels() const { return channels_; }
  const std::vector<McapMetadata>& metadata() const { return metadata_; }
  const std::vector<McapAttachment>& attachments() const { return attachments_; }
  /// From the summary; only after the end of a finished file.
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
  bool damage_reported_ = false;
  std::optional<Error> end_, pending_;  // pending_: met while opening, told by the first next()
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::vector<McapMetadata> metadata_;
  std::vector<McapAttachment> attachments_;
  std::optional<McapStatistics> statistics_;
  std::string profile_, library_;
  std::uint64_t messages_read_ = 0;
};

}  // namespace hueline::storage
