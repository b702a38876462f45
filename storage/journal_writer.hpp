#pragma once

#include <optional>

#include "core/packet.hpp"
#include "storage/journal_header.hpp"
#include "storage/mcap_writer.hpp"

namespace hueline::storage {

/// The raw recording: every packet in ingest order, bytes as received, in one MCAP file. Thread-bound (the recorder's
/// thread). Payloads of 4 KiB and more are not copied: their buffers are held until their chunk is written (at most
/// `chunk_bytes` or `chunk_time` later).
///
/// A failed write is returned by that append() and by all later ones; what was recorded before stays readable.
class JournalWriter {
 public:
  struct Config {
    Compression compression = Compression::None;  ///< images do not compress at the speed they come
    std::uint64_t chunk_bytes = 4u << 20;         ///< see McapWriter::Config
    /// Data is handed to the kernel this often: a killed program loses at most this much. By the clock that append() is
    /// told, as sync_interval: the packets' stamps come from devices, and promises to users do not hang on those.
    nanoseconds chunk_time = std::chrono::milliseconds(500);
    /// Data is forced to the medium this often; 0: only by sync() and close(). A power cut loses at most this.
    nanoseconds sync_interval = std::chrono::seconds(2);
    IfExists if_exists = IfExists::Refuse;
    std::string validate() const;
  };
  /// By sensor. Over all sensors and after close(): packets == packets_written() + packets_lost().
  struct Counts {
    std::uint64_t packets = 0;        ///< accepted by append()
    std::uint64_t payload_bytes = 0;  ///< of those
    std::uint64_t refused = 0;        ///< append() returned an Error before it took the packet
  };

  /// `disk` must outlive the writer.
  static Result<JournalWriter> create(const std::filesystem::path& path, const JournalHeader& header,
                                      const Config& config, Disk& disk = Disk::kernel());
  static Result<JournalWriter> create(const std::filesystem::path& path, const JournalHeader& header) {
    return create(path, header, Config());
  }

  /// `now`: of any clock that does not step. Invalid if the sensor is not in the header; Io if the file could not be
  /// written (now or earlier).
  Status append(const Packet& packet, nanoseconds now);
  /// Everything so far to the kernel: call it when packets pause.
  Status flush() { return writer_.flush(); }
  /// Everything so far to the medium.
  Status sync() { return writer_.sync(); }
  /// Whether the file is still there, whole, under its path: as FileWriter::check_place().
  Status check_place() { return writer_.check_place(); }
  /// Everything to the medium, with summary and indexes.
  Status close() { return writer_.close(); }

  std::uint64_t bytes_written() const { return writer_.bytes_written(); }
  /// Packets in the file; those still waiting for their chunk are not counted yet.
  std::uint64_t packets_written() const { return writer_.statistics().message_count; }
  /// Packets that are on the medium for certain: those of the last sync. After close() all written ones, unless the
  /// disk failed.
  std::uint64_t packets_on_medium() const { return writer_.messages_on_medium(); }
  /// Accepted, but lost with a chunk that could not be written.
  std::uint64_t packets_lost() const { return writer_.lost_messages(); }
  const std::vector<Counts>& counts() const { return counts_; }  ///< by SensorId
  const std::filesystem::path& path() const { return writer_.path(); }

 private:
  JournalWriter(McapWriter writer, std::size_t sensors, const Config& config)
      : writer_(std::move(writer)), config_(config), counts_(sensors) {}

  McapWriter writer_;
  Config config_;
  std::vector<Counts> counts_;
  std::optional<nanoseconds> chunk_begun_, last_sync_;  // by the clock of append()
  Bytes head_;
};

}  // namespace hueline::storage
