#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "core/input_file.hpp"
#include "core/packet.hpp"

namespace hueline::drivers {

/// Reads any file of bytes piece by piece, such as a receiver's own log (*.gps). The file does not say when its bytes
/// arrived. So `received` is invented: it starts at `first_received` and grows by `interval` with each piece. It says
/// nothing about clocks.
/// Thread safety: none; one thread calls all functions.
class FileSource final : public PacketSource {
 public:
  struct Config {
    std::string path;
    std::size_t chunk_bytes = 4096;                      ///< bytes in one packet; the last one may have fewer
    HostTime first_received{};                           ///< `received` of the first packet
    nanoseconds interval{std::chrono::milliseconds(1)};  ///< from the `received` of one packet to that of the next
    /// Returns an empty text if all values are allowed, else a sentence that names the wrong one and its range.
    std::string validate() const;
  };
  explicit FileSource(Config config) : config_(std::move(config)) {}

  Status open() override;
  /// Returns EndOfData after the last byte.
  Result<Packet> next(std::stop_token stop) override;
  void close() override { file_.reset(); }

 private:
  Config config_;
  std::optional<InputFile> file_;
  std::uint64_t offset_ = 0;
  HostTime received_{};
};

}  // namespace hueline::drivers
