#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/measurements.hpp"
#include "sync/fault_log.hpp"

namespace hueline::sync {

/// Reports where navigation solutions are missing or not good, because what was measured there cannot be placed.
/// Whether solutions were lost on the way or never made is known to their decoder. Memory is bounded. Thread safety:
/// one thread per object.
class SolutionWatch {
 public:
  /// Adds a solution, in order of arrival. Returns how many solutions are missing before it, by the usual step between
  /// solutions.
  std::uint64_t add(const InsSolution& solution, FaultLog& faults);

 private:
  std::optional<GpsTime> last_;
  std::deque<nanoseconds> steps_;  // between the last solutions
};

}  // namespace hueline::sync
