#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"

namespace hueline::calibration {

/// A static scan as blocks of points, so that memory does not grow with it. Whoever reads files implements it.
class ScanBlocks {
 public:
  virtual ~ScanBlocks() = default;
  virtual std::size_t blocks() const = 0;
  /// The points of block `index` as x, y, z, x, y, z ... in the scanner's frame, m; valid until `scratch` changes. A
  /// point without a return may be NaN or 0 0 0. Thread-safe when each thread has its own `scratch`.
  virtual Result<std::span<const float>> block(std::size_t index, std::vector<std::byte>& scratch) const = 0;
};

}  // namespace hueline::calibration
