#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/stamped.hpp"
#include "sync/exposure_matcher.hpp"
#include "sync/fault_log.hpp"

namespace hueline::sync {

/// Exposures of several cameras in one time order, indexed without a gap: each waits until none of the other cameras
/// can give an earlier one any more. One that comes later still is Fault Late and left out. Reentrant.
class ExposureMerger {
 public:
  explicit ExposureMerger(std::size_t cameras) : waiting_(cameras) {}

  /// Of one camera, in time order. Empties `exposures`.
  void add(std::size_t camera, std::vector<Exposure>& exposures);
  /// Appends what can come out at `stream_time`; without it, at the end: all.
  void merge(const std::vector<ExposureMatcher>& cameras, std::optional<GpsTime> stream_time,
             std::vector<Exposure>& out, FaultLog& faults);
  /// The earlier of `time` and of all that waits.
  GpsTime earliest(GpsTime time) const;

 private:
  std::vector<std::deque<Exposure>> waiting_;  // by camera
  std::optional<GpsTime> last_;
  std::uint32_t next_ = 0;
};

}  // namespace hueline::sync
