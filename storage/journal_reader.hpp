#pragma once

#include <memory>
#include <utility>

#include "core/packet.hpp"
#include "storage/journal_header.hpp"
#include "storage/mcap_reader.hpp"

namespace hueline::storage {

/// A recording as a packet source. It returns the packets in their recorded order with their recorded sequence, kind
/// and shed mark. It reads finished recordings and recordings that were cut. It never waits.
/// Thread safety: none; one thread calls all functions.
class JournalReader final : public PacketSource {
 public:
  /// Opens the file and reads its header. Errors: Io; Malformed or Truncated if the file is no recording; Unsupported
  /// if the MCAP file holds no raw packets.
  static Result<std::unique_ptr<JournalReader>> open(const std::filesystem::path& path);

  const JournalHeader& header() const { return header_; }

  /// Starts again at the first packet.
  Status open() override;
  /// Returns the next packet. Its bytes are a part of the memory of its chunk. Errors:
  /// - EndOfData: everything was read and the recording is whole.
  /// - Truncated: the recording was cut (program killed, power lost, disk full). All whole packets were returned
  ///   before, and the message names the byte.
  /// - Malformed: a chunk is damaged and was skipped. Call again to continue.
  /// - Io.
  ///
  /// EndOfData, Truncated and Io are repeated by later calls.
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// The position of the reader in the file, to show progress.
  std::uint64_t position() const { return mcap_ ? mcap_->position() : 0; }
  std::uint64_t file_size() const { return mcap_ ? mcap_->file_size() : 0; }

 private:
  JournalReader(std::filesystem::path path, McapReader mcap) : path_(std::move(path)), mcap_(std::move(mcap)) {}
  Status read_header();

  std::filesystem::path path_;
  std::optional<McapReader> mcap_;
  JournalHeader header_;
  bool untouched_ = true;  // open() right after the static open() does not read the header again
};

}  // namespace hueline::storage
