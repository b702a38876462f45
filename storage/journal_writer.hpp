#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/packet.hpp"
#include "storage/journal_header.hpp"
#include "storage/mcap_writer.hpp"

namespace hueline::storage {

/// Writes the raw recording: every packet in ingest order, bytes as received, in one MCAP file. Payloads of 4 KiB and
/// more are not copied; their buffers are held until their chunk is written, at most `chunk_bytes` or `chunk_time`
/// later. If the header says so, images are packed without loss (storage/packed_rows.hpp) where that makes them
/// smaller.
///
/// A failed write is returned by that append() and by all later ones. What was recorded before stays readable.
/// Thread safety: none; the recorder's thread calls all functions.
class JournalWriter {
 public:
  struct Config {
    Compression compression = Compression::None;  ///< of chunks
    std::uint64_t chunk_bytes = 4u << 20;         ///< see McapWriter::Config
    /// Longest time until data is handed to the kernel, if append() or write_due() is called then. A program that is
    /// killed loses at most the data of this time. This time and `sync_interval` are measured by the clock that
    /// append() is told. They are not measured by the packets' stamps, which come from devices: a promise to the user
    /// must not depend on those.
    nanoseconds chunk_time = std::chrono::milliseconds(80);
    /// Longest time until data is forced to the medium, likewise. A power cut loses at most the data of this time, and
    /// of the time that the disk then takes. 0: only sync() and close() force it.
    nanoseconds sync_interval = std::chrono::milliseconds(1500);
    IfExists if_exists = IfExists::Refuse;
    bool replaces_when_whole = false;  ///< see McapWriter::Config
    std::string validate() const;
    /// Returns how a recording is written that is made of another file: it takes the place of an earlier one when it is
    /// whole, and is forced to the medium at its end only. append() is told the packets' own times here, so that a
    /// chunk spans a second: that much is lost with a damaged one, also where few bytes come.
    static Config of_copy();
  };
  /// Counts of one sensor. Over all sensors and after close(): packets == packets_written() + packets_lost().
  struct Counts {
    std::uint64_t packets = 0;        ///< packets that append() accepted
    std::uint64_t payload_bytes = 0;  ///< payload bytes of those packets
    std::uint64_t refused = 0;        ///< packets for which append() returned an error before it took them
  };

  /// Creates the file and writes the header. `disk` must outlive the writer.
  static Result<JournalWriter> create(const std::filesystem::path& path, const JournalHeader& header,
                                      const Config& config, Disk& disk = Disk::kernel());
  static Result<JournalWriter> create(const std::filesystem::path& path, const JournalHeader& header) {
    return create(path, header, Config());
  }

  /// Takes a packet. `now` is the time of any clock that does not step. Errors: Invalid if the sensor is not in the
  /// header; Io if the file could not be written, now or earlier.
  Status append(const Packet& packet, nanoseconds now);
  /// Does what is due at `now` while no packet comes: hands data to the kernel, or forces it to the medium.
  Status write_due(nanoseconds now);
  /// Hands everything so far to the kernel.
  Status flush() { return writer_.flush(); }
  /// Writes everything so far to the medium.
  Status sync() { return writer_.sync(); }
  /// Checks that the file is still there, whole, under its path; see FileWriter::check_place().
  Status check_place() { return writer_.check_place(); }
  /// Writes everything to the medium, with summary and indexes, and closes the file.
  Status close() { return writer_.close(); }

  std::uint64_t bytes_written() const { return writer_.bytes_written(); }
  /// Bytes of packets that wait for their chunk.
  std::uint64_t bytes_waiting() const { return writer_.bytes_waiting(); }
  /// Packets in the file. Packets that still wait for their chunk are not counted yet.
  std::uint64_t packets_written() const { return writer_.statistics().message_count; }
  /// Packets that are certainly on the medium, which are those of the last sync. After close() these are all packets
  /// written, unless the disk failed.
  std::uint64_t packets_on_medium() const { return writer_.messages_on_medium(); }
  /// Packets that were accepted, but lost with a chunk that could not be written.
  std::uint64_t packets_lost() const { return writer_.lost_messages(); }
  const std::vector<Counts>& counts() const { return counts_; }  ///< by SensorId
  const std::filesystem::path& path() const { return writer_.path(); }

 private:
  JournalWriter(McapWriter writer, const JournalHeader& header, const Config& config)
      : writer_(std::move(writer)),
        config_(config),
        has_packed_images_(header.has_packed_images),
        counts_(header.sensors.size()) {}
  Buffer pack(const Packet& packet);
  bool is_chunk_old(nanoseconds now) const;
  bool is_sync_due(nanoseconds now) const;
  Status sync_at(nanoseconds now);

  McapWriter writer_;
  Config config_;
  bool has_packed_images_;
  BufferPool packed_{std::size_t{1} << 28};  // images that wait for their chunk
  std::vector<Counts> counts_;
  std::optional<nanoseconds> chunk_begun_, last_sync_;  // by the clock of append()
  Bytes head_;
};

}  // namespace hueline::storage
