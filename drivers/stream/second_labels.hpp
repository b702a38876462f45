#pragma once

#include <chrono>
#include <optional>

#include "core/measurements.hpp"

namespace hueline::drivers {

/// Makes one TimeLabel for each second, from the first message of the second whose time is given.
/// Thread safety: none.
class SecondLabels {
 public:
  /// Returns the label of the second that `time` lies in, or nothing if it was returned before. Receivers solve up to a
  /// millisecond before the full second; such a time belongs to the next one.
  std::optional<TimeLabel> take(GpsTime time, std::optional<std::chrono::seconds> utc_offset) {
    const GpsTime second(
        std::chrono::floor<std::chrono::seconds>((time + std::chrono::milliseconds(1)).time_since_epoch()));
    if (latest_ == second) return {};
    latest_ = second;
    return TimeLabel{0, {}, second, utc_offset, true};
  }
  void forget() { latest_.reset(); }

 private:
  std::optional<GpsTime> latest_;
};

}  // namespace hueline::drivers
