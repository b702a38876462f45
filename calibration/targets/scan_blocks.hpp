#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"

namespace hueline::calibration {

/// A static scan as blocks of points, so that memory does not grow with the scan. The readers of scan files implement
/// it.
class ScanBlocks {
 public:
  virtual ~ScanBlocks() = default;
  /// Returns the number of blocks.
  virtual std::size_t blocks() const = 0;
  /// Returns the points of block `index` as x, y, z, x, y, z ... in the scanner's frame, m. They are valid until
  /// `scratch` changes. A point without a return may be NaN or 0 0 0.
  /// Thread safety: threads may call this at the same time if each has its own `scratch`.
  virtual Result<std::span<const float>> block(std::size_t index, std::vector<std::byte>& scratch) const = 0;
};

}  // namespace hueline::calibration
