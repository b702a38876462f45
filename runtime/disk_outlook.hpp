#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "storage/cloud_format.hpp"

namespace hueline::runtime {

/// Returns what a point of the cloud takes on the disk, bytes: the size of its record in cloud.las (las_fields.hpp), or
/// two fifths of it if it is compressed, which is what drives take in the mean (docs/formats.md); as much again in the
/// cloud's parts.
constexpr double cloud_bytes_a_point(storage::CloudFormat format, bool has_parts) {
  constexpr double kRecord = 58, kCompressed = 0.4 * kRecord;
  return (format == storage::CloudFormat::Las ? kRecord : kCompressed) + (has_parts ? kCompressed : 0);
}

/// Foresees how fast a disk becomes full, by how its free space has changed in the last two minutes. So everything
/// counts that writes on the disk or makes room on it: the recording, the products, a ring, and other programs. Thread
/// safety: none; one thread calls all functions.
class DiskOutlook {
 public:
  static constexpr double kWindow_s = 120, kLeast_s = 20;

  /// Takes the free space at a time, which does not fall, s.
  void note(double at_s, std::uint64_t free_bytes);
  /// Returns how fast the free space falls, bytes/s; 0 if it does not fall. Empty until kLeast_s are known.
  std::optional<double> fill() const;

 private:
  struct Sample {
    double at_s;
    double free_bytes;
  };
  std::deque<Sample> samples_;  // a second apart or more
};

}  // namespace hueline::runtime
