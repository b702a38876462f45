#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

#include "core/packet.hpp"

namespace hueline::runtime {

/// How long a drive had been running when its packets came, by their stamps, none of which is believed alone: each
/// sensor counts from its own first packet on, and a step of its stamps backwards, or by more than `longest_step`, is a
/// step of its clock. Thread-bound.
class DrivenTime {
 public:
  explicit DrivenTime(nanoseconds longest_step) : longest_step_(longest_step) {}

  /// Of this packet, since the first of all. Never falls.
  nanoseconds of(const Packet& packet) {
    if (sensors_.size() <= packet.sensor) sensors_.resize(packet.sensor + 1u);
    Sensor& sensor = sensors_[packet.sensor];
    const nanoseconds step = packet.received - sensor.last;
    if (!sensor.has_spoken || step < nanoseconds(0) || step > longest_step_) {
      // A clock that stepped goes on from where the drive is.
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

/// Holds a replay back to the pace of the drive. Pace is all it decides: what comes out does not depend on it. Where
/// nothing came for long, it does not wait either. Thread-bound.
class Pacer {
 public:
  /// 0: no pace, as fast as possible.
  explicit Pacer(double speed) : speed_(speed) {}

  /// The next packet; once each.
  void take(const Packet& packet) { due_ = driven_.of(packet); }
  bool is_due() { return wait().count() <= 0; }
  /// Until the packet's turn, at most 200 ms at a time.
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
