#pragma once

#include <chrono>
#include <optional>

#include "core/time.hpp"

namespace hueline::apps {

/// Holds a replay back to the pace of the drive. Pace is all it decides: what comes out does not depend on it. Thread-bound.
class Pacer {
 public:
  /// 0: no pace, as fast as possible.
  explicit Pacer(double speed) : speed_(speed) {}

  bool is_due(HostTime received) { return wait(received).count() <= 0; }
  /// Until the packet's turn, at most 200 ms at a time.
  std::chrono::milliseconds wait(HostTime received) {
    using Clock = std::chrono::steady_clock;
    if (speed_ <= 0) return std::chrono::milliseconds(0);
    if (!first_) first_ = received, began_ = Clock::now();
    const std::chrono::duration<double> due(to_seconds(received - *first_) / speed_);
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(due - (Clock::now() - began_));
    return std::min(left, std::chrono::milliseconds(200));
  }

 private:
  const double speed_;
  std::optional<HostTime> first_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace hueline::apps
