#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "drivers/ros/ros_pose_message.hpp"

namespace hueline::drivers {

/// Joins orientations with positions of another sensor: each orientation gets the position at its time, between the
/// two around it. Both come with delays of their own, so an orientation often stands in a recording behind a position
/// that was measured later. It is waited for: an orientation is joined kPatience after it came, by the recorder's
/// clock, and what comes out is in the order of time whatever the order of the input.
/// Memory is bounded: of more than kMost waiting ones, the oldest does not wait any longer.
/// Thread safety: none.
class RosPoseJoiner {
 public:
  static constexpr nanoseconds kPatience = std::chrono::seconds(1);
  /// No position is given between two that are farther apart: nobody knows where the vehicle was meanwhile.
  static constexpr nanoseconds kLongestSpan = std::chrono::seconds(3);
  static constexpr std::size_t kMost = 20'000;

  /// An orientation with its position.
  struct Joined {
    RosOrientation orientation;
    RosPosition position;                                    ///< at the same time, with the sigma of the later one
    Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();  ///< m/s, the mean between the two positions
  };

  /// Takes a message that the recorder received at `recorded`. Returns false if it is not used, because there is one
  /// of its time already or because it came after what is later was given.
  bool add(const RosPosition& position, UnixTime recorded);
  bool add(const RosOrientation& orientation, UnixTime recorded);
  /// Nothing more comes, so nothing waits any longer.
  void end() { is_ended_ = true; }
  /// Returns the next pose that need not wait. Call it until it returns nothing.
  std::optional<Joined> next();

  /// Returns how many orientations had no positions around them that are close enough.
  std::uint64_t unplaced() const { return unplaced_; }

 private:
  struct Waiting {
    RosOrientation orientation;
    UnixTime recorded{};  ///< when it came
  };
  bool is_due(UnixTime time, const Waiting& one) const;
  std::optional<Joined> join(const RosOrientation& orientation) const;
  void forget_positions();

  std::map<UnixTime, RosPosition> positions_;  // by their times, as the next
  std::map<UnixTime, Waiting> waiting_;
  std::optional<UnixTime> given_;  // nothing up to this time is given any more
  UnixTime now_{UnixTime::min()};  // by the recorder's clock
  bool is_ended_ = false;
  std::uint64_t unplaced_ = 0;
};

}  // namespace hueline::drivers
