#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "calibration/targets/scan_blocks.hpp"
#include "core/result.hpp"

/// Step 1 of sphere-target orientation: of a scan only the points matter whose distance is that of a target.
namespace hueline::calibration {

/// Distances from the scanner, m.
struct Ring {
  double inner = 0, outer = 0;
};

/// Keeps the points of some rings. The hot kernel: squared distances in float, vectorised for the processor at hand
/// without fused multiply-add, so that every processor decides alike.
class RingFilter {
 public:
  explicit RingFilter(std::span<const Ring> rings);
  /// Appends the points of `xyz` that lie in any ring, in their order, and raises `farthest_squared` to that of the
  /// farthest one of all.
  void keep(std::span<const float> xyz, std::vector<Eigen::Vector3f>& kept, float& farthest_squared) const;

 private:
  std::vector<std::pair<float, float>> squared_;  // disjoint, rising
};

/// What a scan has in its rings.
struct RingPoints {
  std::vector<Eigen::Vector3f> points_scanner;
  std::uint64_t points_read = 0;
  double farthest_m = 0;
};

/// Reads the whole scan once, on `threads` threads; the order of the points is the scan's with any number of them.
/// Exhausted if more than `most_points` lie in the rings.
Result<RingPoints> read_rings(const ScanBlocks& scan, std::span<const Ring> rings, unsigned threads,
                              std::size_t most_points);

}  // namespace hueline::calibration
