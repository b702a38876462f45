#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/measurements.hpp"
#include "sync/fault_log.hpp"

namespace hueline::sync {

/// Says where there is no navigation solution, or none to be trusted: what was measured there cannot be placed. Whether
/// solutions were lost on the way or never made, their decoder knows. Reentrant; bounded memory.
class SolutionWatch {
 public:
  /// In order of arrival. How many are missing before it, by the usual step between solutions.
  std::uint64_t add(const InsSolution& solution, FaultLog& faults);

 private:
  std::optional<GpsTime> last_;
  std::deque<nanoseconds> steps_;  // between the last solutions
};

}  // namespace hueline::sync
