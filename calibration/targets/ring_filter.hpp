#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "calibration/targets/scan_blocks.hpp"
#include "core/result.hpp"

/// Step 1 of the sphere-target orientation: keeps only the points of a scan that are as far from the scanner as a
/// target.
namespace hueline::calibration {

/// A range of distances from the scanner, m.
struct Ring {
  double inner = 0, outer = 0;
};

/// Keeps the points of some rings. Speed matters here: the filter compares squared distances in float and uses the
/// vector instructions of the processor. It does not use fused multiply-add, so that all processors give the same
/// result.
class RingFilter {
 public:
  /// `rings` may overlap and have any order.
  explicit RingFilter(std::span<const Ring> rings);
  /// Appends the points of `xyz` that lie in any ring to `kept`, in their order. Raises `farthest_squared` to the
  /// squared distance of the farthest point of all, in a ring or not.
  void keep(std::span<const float> xyz, std::vector<Eigen::Vector3f>& kept, float& farthest_squared) const;

 private:
  std::vector<std::pair<float, float>> squared_;  // disjoint, in increasing order
};

/// The points of a scan that lie in its rings.
struct RingPoints {
  std::vector<Eigen::Vector3f> points_scanner;
  /// Number of points of the whole scan.
  std::uint64_t points_read = 0;
  /// Distance of the farthest point of the whole scan.
  double farthest_m = 0;
};

/// Reads the whole scan once with `threads` threads. The points are in the order of the scan for any number of threads.
/// Errors: those of `scan`; Exhausted if more than `most_points` lie in the rings.
Result<RingPoints> read_rings(const ScanBlocks& scan, std::span<const Ring> rings, unsigned threads,
                              std::size_t most_points);

}  // namespace hueline::calibration
