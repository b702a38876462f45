#pragma once

#include <cstdint>
#include <filesystem>
#include <utility>

#include "core/result.hpp"
#include "core/time.hpp"
#include "storage/byte_order.hpp"
#include "storage/file_writer.hpp"

namespace hueline::storage {

/// Writes datagrams as a capture file (pcap) that other programs read: link type raw IP, times in nanoseconds. The
/// headers of IPv4 and UDP are made, because a journal holds the payloads alone; they say 127.0.0.1 as address of both
/// sides. A datagram of more bytes than one frame of the network carries stays one packet.
/// Thread safety: none; one thread calls all functions.
/// Source: draft-ietf-opsawg-pcap; RFC 768, RFC 791.
class PcapWriter {
 public:
  /// The largest payload that IPv4 can carry.
  static constexpr std::size_t kMostPayload = 65507;

  /// Creates the file. An existing file is replaced.
  static Result<PcapWriter> create(const std::filesystem::path& path, Disk& disk = Disk::kernel());
  /// Appends a datagram that came at `time`, from 1970 to 2106, to a port. Errors: Invalid if the payload is too large
  /// or the time out of range; Io.
  Status write(UnixTime time, std::uint16_t port, ByteView payload);
  /// Closes the file. Errors: Io.
  Status close() { return file_.close(); }

 private:
  explicit PcapWriter(FileWriter file) : file_(std::move(file)) {}
  FileWriter file_;
  Bytes head_;
};

}  // namespace hueline::storage
