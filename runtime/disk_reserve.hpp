#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

#include "core/result.hpp"
#include "storage/disk.hpp"

namespace hueline::runtime {

/// The disk's last space belongs to the recording: what is made from it can be made again, and ends first. Thread-safe.
class DiskReserve {
 public:
  /// Kept at least, and on top of it what the recording writes in kSeconds at its mean rate: time to do something about
  /// it.
  static constexpr std::uint64_t kLeastBytes = 64'000'000;
  static constexpr double kSeconds = 300;

  /// `recording` exists; `disk` must outlive this.
  DiskReserve(std::filesystem::path recording, storage::Disk& disk) : recording_(std::move(recording)), disk_(disk) {}

  /// How much was recorded so far, and in what time. Before the first minute is over the rate counts over a minute.
  void note(std::uint64_t recorded_bytes, double seconds);
  std::uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }

  /// Exhausted if less is free than is kept, and `product` is a file of the recording's file system.
  Status check(const std::filesystem::path& product) const;

 private:
  const std::filesystem::path recording_;
  storage::Disk& disk_;
  std::atomic<std::uint64_t> bytes_{kLeastBytes};
};

}  // namespace hueline::runtime
