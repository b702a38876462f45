#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "storage/disk.hpp"

namespace hueline::runtime {

/// Keeps the last space of a disk for the recording. The products can be made again from the recording, so they end
/// first. Thread-safe.
class DiskReserve {
 public:
  /// The space that is kept is kLeastBytes, and in addition what the recording writes in kSeconds at its mean rate.
  /// This gives the operator time to act.
  static constexpr std::uint64_t kLeastBytes = 64'000'000;
  static constexpr double kSeconds = 300;

  /// `recording` must exist, and `disk` must outlive this object. `volumes` are the folders where the recording goes on
  /// when its disk is full.
  DiskReserve(std::filesystem::path recording, storage::Disk& disk, std::vector<std::string> volumes = {})
      : recording_(std::move(recording)), disk_(disk), volumes_(std::move(volumes)) {}

  /// Updates the mean rate: how much was recorded so far, and in what time. During the first minute the rate is
  /// computed as if a whole minute had passed.
  void note(std::uint64_t recorded_bytes, double seconds);
  /// Returns the space that is kept at present, bytes.
  std::uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }

  /// Returns the space that is left for the recording, on its disk and on those of its volumes, bytes.
  std::uint64_t free_bytes() const;

  /// Returns Exhausted if less space is free than is kept and `product` lies on the file system of the recording.
  Status check(const std::filesystem::path& product) const;

 private:
  const std::filesystem::path recording_;
  storage::Disk& disk_;
  const std::vector<std::string> volumes_;
  std::atomic<std::uint64_t> bytes_{kLeastBytes};
};

}  // namespace hueline::runtime
