#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "core/packet.hpp"
#include "core/result.hpp"

/// Metadata of an Ouster that lie in a file.
namespace hueline::drivers {

/// Returns the text of the file. Errors: those of read_input().
Result<std::string> read_ouster_metadata_file(const std::string& path);

/// A source that delivers the metadata in a file before the first packet of another source, as a packet that arrived
/// with it. So the journal holds them, and a replay needs no file.
/// Thread safety: none; one thread calls all functions.
class OusterFileSource final : public PacketSource {
 public:
  OusterFileSource(std::unique_ptr<PacketSource> datagrams, std::string path)
      : datagrams_(std::move(datagrams)), path_(std::move(path)) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { datagrams_->close(); }

 private:
  std::unique_ptr<PacketSource> datagrams_;
  std::string path_;
  std::string text_;               // of the metadata, until they are delivered
  std::optional<Packet> waiting_;  // the first packet, which comes behind the metadata
};

}  // namespace hueline::drivers
