#pragma once

#include <memory>

#include "core/packet.hpp"
#include "storage/journal_header.hpp"
#include "storage/mcap_reader.hpp"

namespace hueline::storage {

/// A recording as a packet source: the packets in their recorded order with their recorded sequence, kind and shed
/// mark. Reads finished and cut recordings. Never waits. Thread-bound.
class JournalReader final : public PacketSource {
 public:
  /// Reads the header. Errors: Io, Malformed or Truncated if it is no recording, Unsupported if the MCAP file holds no
  /// raw packets.
  static Result<std::unique_ptr<JournalReader>> open(const std::filesystem::path& path);

  const JournalHeader& header() const { return header_; }

  /// Starts again from the first packet.
  Status open() override;
  /// The next packet; its bytes are a part of its chunk's memory. Errors: EndOfData: all was read and whole. Truncated:
  /// the recording was cut (killed, power, full disk); everything whole was given; the message names the byte.
  /// Malformed: a chunk is damaged and skipped, call again to go on. Io. EndOfData, Truncated and Io are repeated by
  /// later calls.
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// For progress: where in the file the reading is.
  std::uint64_t position() const { return mcap_ ? mcap_->position() : 0; }
  std::uint64_t file_size() const { return mcap_ ? mcap_->file_size() : 0; }

 private:
  JournalReader(std::filesystem::path path, McapReader mcap) : path_(std::move(path)), mcap_(std::move(mcap)) {}
  Status read_header();

  std::filesystem::path path_;
  std::optional<McapReader> mcap_;
  JournalHeader header_;
  bool untouched_ = true;  // open() after the static open() need not read the header again
};

}  // namespace hueline::storage
