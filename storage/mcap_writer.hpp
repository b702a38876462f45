#pragma once

#include <optional>

#include "core/time.hpp"
#include "storage/compression.hpp"
#include "storage/file_writer.hpp"
#include "storage/mcap_chunk.hpp"

namespace hueline::storage {

/// Writes an MCAP file: chunks with CRC and message indexes, and at the end a summary with statistics and indexes.
/// Payloads given as Buffer go from where they lie to the kernel without a copy. Thread-bound. Reads no clock: the same
/// calls give the same bytes.
///
/// The first failed write is remembered and returned by every later call. The file is then cut back to its last whole
/// record, and close() still writes the summary if there is room, so that what was recorded reads as a complete file.
class McapWriter {
 public:
  struct Config {
    std::string profile;              ///< MCAP header: what conventions the file follows
    std::string library = "hueline";  ///< MCAP header: what wrote it
    Compression compression = Compression::None;
    std::uint64_t chunk_bytes =
        4u << 20;  ///< a chunk is written when it holds this much; a larger message has one of its own
    nanoseconds chunk_time = std::chrono::seconds(1);  ///< ... or when its messages span this much log time
    IfExists if_exists = IfExists::Refuse;
    /// Empty when fine, else a sentence.
    std::string validate() const;
  };

  /// `disk` must outlive the writer.
  static Result<McapWriter> create(const std::filesystem::path& path, const Config& config,
                                   Disk& disk = Disk::kernel());
  McapWriter(McapWriter&&) noexcept = default;
  McapWriter& operator=(McapWriter&&) = delete;
  /// Closes if close() was not called; then nobody hears of an error.
  ~McapWriter();

  /// Gives the schema its id (returned, from 1).
  Result<std::uint16_t> add_schema(McapSchema schema);
  /// `channel.id` and `schema_id` are the caller's; an id can be used once.
  Status add_channel(const McapChannel& channel);
  Status add_metadata(const McapMetadata& metadata);
  Status add_attachment(const McapAttachment& attachment);

  /// One message whose data is `head` followed by `payload`. The bytes reach the file with their chunk.
  Status write(const McapChunk::Message& message, ByteView head, const Buffer& payload = {});
  /// Hands the waiting chunk to the kernel.
  Status flush();
  /// flush() and to the medium.
  Status sync();
  /// As FileWriter::check_place(). A file that was cut ends here: nothing of it is certain any more.
  Status check_place();
  /// Writes what waits, the summary and the footer; syncs. Later calls return Invalid.
  Status close();

  const McapStatistics& statistics() const { return statistics_; }  ///< of what is in the file
  std::uint64_t bytes_written() const { return file_.size(); }
  std::uint64_t bytes_waiting() const { return chunk_.size(); }
  /// Messages accepted by write() that did not reach the file because its chunk could not be written.
  std::uint64_t lost_messages() const { return lost_messages_; }
  /// Messages that are on the medium: in the file at its last sync, unless a sync failed before.
  std::uint64_t messages_on_medium() const { return on_medium_; }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  struct ChunkIndex {
    std::uint64_t start_time, end_time, offset, length, index_length, compressed_size, uncompressed_size;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };
  McapWriter(FileWriter file, const Config& config) : config_(config), file_(std::move(file)) {}
  Status put_record(ByteView record);
  Status write_chunk();
  Status synced(Status result);
  Error lose_chunk(const Error& why);
  Status write_end();
  Status usable() const;

  Config config_;
  FileWriter file_;
  McapChunk chunk_;
  McapStatistics statistics_;
  std::uint32_t data_crc_ = 0;
  std::vector<McapSchema> schemas_;
  std::vector<McapChannel> channels_;
  std::vector<ChunkIndex> chunk_indexes_;
  Bytes attachment_indexes_, metadata_indexes_;  // encoded
  std::uint64_t lost_messages_ = 0, on_medium_ = 0;
  bool sync_failed_ = false;  // a later sync may succeed and mean nothing
  std::optional<Error> error_;
};

}  // namespace hueline::storage
