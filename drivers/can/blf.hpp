#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/result.hpp"
#include "drivers/can/can_log.hpp"

/// Vector's binary logs (BLF).
namespace hueline::drivers {

/// Returns whether a file that begins with `first_bytes` is a BLF.
bool is_blf(std::string_view first_bytes);

/// Reads the frames of a BLF: CAN, CAN FD and error frames in all the forms that loggers write (object types 1, 2, 73,
/// 86, 100, 101, 104), bare or in containers (type 10, plain or zlib). Objects of other kinds are counted and passed
/// over. What it knows of the format comes from descriptions of public readers and from logs.
///
/// A log that was cut by a crash is read up to its last whole container. Behind broken bytes the reader goes on at the
/// next object.
/// Memory: two containers, of at most 64 MB each.
/// Thread safety: none; one thread reads one log.
class BlfReader {
 public:
  explicit BlfReader(InputFile file) : file_(std::move(file)) {}

  /// Returns the next frame, with its time since the beginning of the log, or nothing at the end. Errors: Malformed and
  /// Truncated, which name the place, and the next call goes on behind it; Unsupported if the file is no BLF; Io.
  Result<std::optional<CanLogEntry>> next();
  /// Returns the number of objects that were passed over until now, by their kind in words: "Ethernet", "LIN",
  /// "FlexRay", "GPS", "other kinds".
  const std::map<std::string, std::uint64_t>& passed_over() const { return passed_over_; }

 private:
  Status read(std::uint64_t offset, std::span<std::byte> out) const;
  Status start();
  Result<bool> fill();
  Status take_container(std::uint64_t offset, std::uint32_t size, std::uint32_t header_size);
  Error lost(std::string what);
  std::size_t left() const { return objects_.size() - at_; }

  InputFile file_;
  bool is_started_ = false;
  bool is_searching_ = false;       // for the next object, behind broken bytes
  std::uint64_t file_at_ = 0;       // offset of the next object of the file itself
  std::uint64_t container_at_ = 0;  // offset of the latest container, for messages
  std::vector<std::byte> objects_;  // what the containers hold; read up to at_
  std::size_t at_ = 0;
  std::uint64_t skip_ = 0;  // bytes of an object that is passed over
  std::map<std::string, std::uint64_t> passed_over_;
};

}  // namespace hueline::drivers
