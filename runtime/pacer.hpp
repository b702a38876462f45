#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <vector>

#include "core/packet.hpp"

namespace hueline::runtime {

/// Measures how long a drive had been running when its packets came. It uses the packets' stamps and trusts none of
/// them alone: the time of each sensor starts at its own first packet, and a step of its stamps backwards or by more
/// than `longest_step` counts as a step of its clock.
/// Thread safety: none; one thread calls all functions.
class DrivenTime {
 public:
  explicit DrivenTime(nanoseconds longest_step) : longest_step_(longest_step) {}

  /// Returns the time from the first packet of all to this packet. It never falls.
  nanoseconds of(const Packet& packet) {
    if (sensors_.size() <= packet.sensor) sensors_.resize(packet.sensor + 1u);
    Sensor& sensor = sensors_[packet.sensor];
    const nanoseconds step = packet.received - sensor.last;
    if (!sensor.has_spoken || step < nanoseconds(0) || step > longest_step_) {
      // After a step of its clock the sensor continues from the present time of the drive.
      sensor.zero = packet.received - driven_;
      sensor.has_spoken = true;
    }
    sensor.last = packet.received;
    driven_ = std::max(driven_, packet.received - sensor.zero);
    return driven_;
  }

 private:
  struct Sensor {
    bool has_spoken = false;
    HostTime zero{}, last{};
  };
  const nanoseconds longest_step_;
  std::vector<Sensor> sensors_;
  nanoseconds driven_{0};
};

/// How fast a replay runs.
struct Pace {
  double speed = 0;  ///< 1: as fast as it was driven; 0: as fast as the computer can
  bool is_paused = false;
  bool operator==(const Pace&) const = default;
};

/// Slows a replay down to the pace of the drive. It decides only the pace: the output does not depend on it. It skips
/// the time of long gaps without packets.
/// Thread safety: one thread calls take(), is_due() and wait(); pace() and set() may be called on any.
class Pacer {
 public:
  /// Nothing waits, or is paused, before the drive has lasted `from`.
  explicit Pacer(double speed, nanoseconds from = nanoseconds(0)) : from_(from), speed_(speed) {}

  /// Takes the next packet. Call it once for each packet.
  void take(const Packet& packet) { due_ = driven_.of(packet); }
  bool is_due() { return wait().count() <= 0; }
  /// Returns the time until the packet's turn, at most 200 ms; while the replay is paused always 200 ms.
  std::chrono::milliseconds wait() {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::milliseconds kMost(200);
    if (due_ < from_) return std::chrono::milliseconds(0);
    if (const Pace now = pace(); now != followed_) {
      // From here on the time of the drive goes on at the new pace.
      followed_ = now;
      began_ = Clock::now();
      begun_at_ = due_;
    }
    if (followed_->is_paused) return kMost;
    if (followed_->speed <= 0) return std::chrono::milliseconds(0);
    const std::chrono::duration<double> due(to_seconds(due_ - begun_at_) / followed_->speed);
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(due - (Clock::now() - began_));
    return std::min(left, kMost);
  }

  Pace pace() const { return {speed_, is_paused_}; }
  /// The thread that waits follows within 200 ms.
  void set(const Pace& pace) {
    speed_ = pace.speed;
    is_paused_ = pace.is_paused;
  }

 private:
  const nanoseconds from_;
  std::atomic<double> speed_;
  std::atomic<bool> is_paused_{false};
  DrivenTime driven_{std::chrono::seconds(5)};
  nanoseconds due_{0}, begun_at_{0};
  std::optional<Pace> followed_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace hueline::runtime
