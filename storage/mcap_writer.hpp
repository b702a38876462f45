#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/time.hpp"
#include "storage/compression.hpp"
#include "storage/file_writer.hpp"
#include "storage/mcap_chunk.hpp"

namespace hueline::storage {

/// Writes an MCAP file: chunks with CRC and message indexes, and at the end a summary with statistics and indexes.
/// Payloads given as Buffer go to the kernel without a copy. Reads no clock: the same calls give the same bytes.
///
/// The first failed write is remembered and returned by every later call. The file is then cut back to its last whole
/// record, and close() still writes the summary if there is room, so that the recorded part reads as a complete file,
/// unless the file is to replace an older one when it is whole.
/// Thread safety: none; one thread calls all functions.
class McapWriter {
 public:
  struct Config {
    std::string profile;              ///< profile in the MCAP header: the conventions that the file follows
    std::string library = "hueline";  ///< library in the MCAP header: the program that wrote the file
    Compression compression = Compression::None;
    std::uint64_t chunk_bytes = 4u << 20;  ///< size at which a chunk is written; a larger message has its own chunk
    /// Span of the log times of its messages at which a chunk is written.
    nanoseconds chunk_time = std::chrono::seconds(1);
    IfExists if_exists = IfExists::Refuse;
    /// Whether the file gets its name, and takes the place of an older one, only when close() has succeeded, whatever
    /// `if_exists` says (FileWriter::replace()). After a failed write, and without close(), the older one stays.
    bool replaces_when_whole = false;
    /// Returns an empty text if the settings are valid, else a sentence.
    std::string validate() const;
  };

  /// Creates the file. `disk` must outlive the writer.
  static Result<McapWriter> create(const std::filesystem::path& path, const Config& config,
                                   Disk& disk = Disk::kernel());
  McapWriter(McapWriter&&) noexcept = default;
  McapWriter& operator=(McapWriter&&) = delete;
  /// Closes the file if close() was not called; with `replaces_when_whole` it leaves the older one. Errors are then not
  /// reported.
  ~McapWriter();

  /// Adds a schema and returns the id that it was given, counted from 1.
  Result<std::uint16_t> add_schema(McapSchema schema);
  /// Adds a channel. The caller chooses `channel.id` and `channel.schema_id`; a channel id can be used once.
  Status add_channel(const McapChannel& channel);
  /// Adds a metadata record.
  Status add_metadata(const McapMetadata& metadata);
  /// Adds an attachment with its CRC.
  Status add_attachment(const McapAttachment& attachment);

  /// Adds one message whose data is `head` followed by `payload`. The bytes reach the file together with their chunk.
  Status write(const McapChunk::Message& message, ByteView head, const Buffer& payload = {});
  /// Ends the waiting chunk and begins to write it. settle() tells whether the file got it.
  Status end_chunk();
  /// Waits until the chunks so far are in the file.
  Status settle();
  /// Hands the waiting chunk to the kernel.
  Status flush();
  /// Does what flush() does and writes everything so far to the medium.
  Status sync();
  /// See FileWriter::check_place(). If another program has cut the file, the writing ends here, because no part of the
  /// file is certain any more.
  Status check_place();
  /// Writes what waits, the summary and the footer, and syncs. Later calls return Invalid.
  Status close();

  const McapStatistics& statistics() const { return statistics_; }  ///< of what is in the file, after settle()
  std::uint64_t bytes_written() const { return file_.size(); }
  /// Bytes in the chunk that is not written yet.
  std::uint64_t bytes_waiting() const { return chunk_.size(); }
  /// Messages that write() accepted and that did not reach the file because their chunk could not be written.
  std::uint64_t lost_messages() const { return lost_messages_; }
  /// Messages that are on the medium: those in the file at its last sync, provided that no sync failed before.
  std::uint64_t messages_on_medium() const { return on_medium_; }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  struct ChunkIndex {
    std::uint64_t start_time, end_time, offset, length, index_length, compressed_size, uncompressed_size;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };
  McapWriter(FileWriter file, const Config& config) : config_(config), file_(std::move(file)) {}
  /// A chunk that the disk may not have yet.
  struct InFlight {
    ChunkIndex index;
    std::uint64_t count = 0;
    std::map<std::uint16_t, std::uint64_t> channel_counts;
    std::uint32_t data_crc = 0;  ///< of the file's data to its end
    std::uint64_t end() const { return index.offset + index.length + index.index_length; }
  };
  Status put_record(ByteView record);
  Status synced(Status result);
  void take_in();
  void forget_medium();
  Error lose_chunks(const Error& why);
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
  std::deque<InFlight> in_flight_;
  Bytes attachment_indexes_, metadata_indexes_;  // encoded records
  std::uint64_t lost_messages_ = 0, on_medium_ = 0;
  bool sync_failed_ = false;  // a later sync may succeed and mean nothing
  std::optional<Error> error_;
};

}  // namespace hueline::storage
