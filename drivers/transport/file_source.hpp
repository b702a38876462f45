#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "core/input_file.hpp"
#include "core/packet.hpp"

namespace hueline::drivers {

/// Any file of bytes as a stream in pieces, such as a receiver's own log (*.gps). Nobody knows when its bytes arrived:
/// `received` is counted, one `interval` a piece, and says nothing about clocks. Thread-bound.
class FileSource final : public PacketSource {
 public:
  struct Config {
    std::string path;
    std::size_t chunk_bytes = 4096;
    HostTime first_received{};
    nanoseconds interval{std::chrono::milliseconds(1)};
    /// Empty if fine, else which key is outside which range.
    std::string validate() const;
  };
  explicit FileSource(Config config) : config_(std::move(config)) {}

  Status open() override;
  /// EndOfData behind the last byte.
  Result<Packet> next(std::stop_token stop) override;
  void close() override { file_.reset(); }

 private:
  Config config_;
  std::optional<InputFile> file_;
  std::uint64_t offset_ = 0;
  HostTime received_{};
};

}  // namespace hueline::drivers
