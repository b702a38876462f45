#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/measurements.hpp"

namespace hueline::drivers {

/// Makes solutions of the high-rate messages of a u-blox receiver with inertial sensors (NEO-M8L, M8U, ZED-F9R):
/// HNR-PVT (position and velocity) and HNR-ATT (attitude) of the same time of week, up to 30 a second. They come sooner
/// than the navigation epochs of the NAV messages, whose time they may be ahead of. Thread safety: none; one thread
/// calls it.
class UbloxHighRate {
 public:
  /// What the receiver said besides: the difference of GPS time and UTC, and the state of the fusion (ESF-STATUS; 1: it
  /// fuses its inertial sensors).
  struct Known {
    std::optional<std::chrono::seconds> utc_offset;
    std::optional<std::uint8_t> fusion_mode;
  };
  /// The time of the epoch, if a message has one, and the solution, if the message completes it. Sensor is not set.
  struct Taken {
    bool is_used = false;
    std::optional<GpsTime> time;
    std::optional<InsSolution> solution;
  };

  /// Takes the payload of a message of the class HNR.
  Taken take(std::uint8_t id, std::span<const std::byte> payload, HostTime received, const Known& known);
  void forget();

 private:
  struct Motion {
    Motion() {}  // without it clang 14 cannot make one inside an optional of the enclosing class
    std::uint32_t itow_ms = 0;
    InsSolution solution;  ///< without attitude
    double velocity_sigma = 0;
    Eigen::Vector2d along{0, 1};  ///< east and north of the heading
    double plane = 0, slope = 0;  ///< speeds over ground and up or down, m/s
    bool is_good = false;
  };
  struct Turn {
    std::uint32_t itow_ms = 0;
    Attitude attitude;
    std::array<double, 3> sigma{};
  };
  void learn_course(const std::optional<Motion>& before, const Motion& now);
  std::optional<InsSolution> join(const Known& known);

  std::optional<Motion> motion_;
  std::optional<Turn> turn_;
  std::optional<std::uint32_t> joined_itow_;
  /// Where the vehicle goes, seen from its heading: to the right, and ahead. HNR-PVT's heading of motion is that of the
  /// vehicle (firmware of the NEO-M8L), also if it goes backwards, and its speed in space does not say up or down.
  Eigen::Vector2d course_{0, 1};
  bool knows_course_ = false;
  std::optional<int> climbs_;
};

}  // namespace hueline::drivers
