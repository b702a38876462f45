#pragma once

#include <algorithm>
#include <chrono>
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

/// Slows a replay down to the pace of the drive. It decides only the pace: the output does not depend on it. It skips
/// the time of long gaps without packets.
/// Thread safety: none; one thread calls all functions.
class Pacer {
 public:
  /// `speed` 1 is real time. 0 means no pacing, as fast as possible.
  explicit Pacer(double speed) : speed_(speed) {}

  /// Takes the next packet. Call it once for each packet.
  void take(const Packet& packet) { due_ = driven_.of(packet); }
  bool is_due() { return wait().count() <= 0; }
  /// Returns the time until the packet's turn, at most 200 ms.
  std::chrono::milliseconds wait() {
    using Clock = std::chrono::steady_clock;
    if (speed_ <= 0) return std::chrono::milliseconds(0);
    if (!has_begun_) began_ = Clock::now(), has_begun_ = true;
    const std::chrono::duration<double> due(to_seconds(due_) / speed_);
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(due - (Clock::now() - began_));
    return std::min(left, std::chrono::milliseconds(200));
  }

 private:
  const double speed_;
  DrivenTime driven_{std::chrono::seconds(5)};
  nanoseconds due_{0};
  bool has_begun_ = false;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace hueline::runtime
