#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/stamped.hpp"
#include "sync/exposure_matcher.hpp"
#include "sync/fault_log.hpp"

namespace hueline::sync {

/// Merges the exposures of several cameras into one order of time, with consecutive indices. Each exposure waits until
/// no other camera can give an earlier one. An exposure that comes even later is left out and reported as a fault Late.
/// Thread safety: one thread per object.
class ExposureMerger {
 public:
  explicit ExposureMerger(std::size_t cameras) : waiting_(cameras) {}

  /// Adds exposures of one camera, in order of time, and empties `exposures`.
  void add(std::size_t camera, std::vector<Exposure>& exposures);
  /// Appends to `out` the exposures that can be returned at `stream_time`; without `stream_time`, at the end, all of
  /// them.
  void merge(const std::vector<ExposureMatcher>& cameras, std::optional<GpsTime> stream_time,
             std::vector<Exposure>& out, FaultLog& faults);
  /// Returns the earliest of `time` and of all waiting exposures.
  GpsTime earliest(GpsTime time) const;

 private:
  std::vector<std::deque<Exposure>> waiting_;  // by camera
  std::optional<GpsTime> last_;
  std::uint32_t next_ = 0;
};

}  // namespace hueline::sync
