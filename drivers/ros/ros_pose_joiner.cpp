#include "drivers/ros/ros_pose_joiner.hpp"

#include <algorithm>
#include <iterator>

namespace hueline::drivers {

bool RosPoseJoiner::add(const RosPosition& position, UnixTime recorded) {
  now_ = std::max(now_, recorded);
  const bool is_too_late = given_ && !positions_.empty() && position.time < positions_.begin()->first;
  if (is_too_late || !positions_.try_emplace(position.time, position).second) return false;
  if (positions_.size() > kMost) positions_.erase(positions_.begin());
  return true;
}

bool RosPoseJoiner::add(const RosOrientation& orientation, UnixTime recorded) {
  now_ = std::max(now_, recorded);
  if (given_ && orientation.time <= *given_) return false;
  return waiting_.try_emplace(orientation.time, Waiting{orientation, recorded}).second;
}

bool RosPoseJoiner::is_due(UnixTime time, const Waiting& one) const {
  if (is_ended_ || waiting_.size() > kMost) return true;
  const bool has_end = !positions_.empty() && positions_.rbegin()->first >= time;
  return now_ - one.recorded >= (has_end ? kPatience : kPatience + kLongestSpan);
}

std::optional<RosPoseJoiner::Joined> RosPoseJoiner::next() {
  while (!waiting_.empty() && is_due(waiting_.begin()->first, waiting_.begin()->second)) {
    const RosOrientation orientation = waiting_.begin()->second.orientation;
    waiting_.erase(waiting_.begin());
    if (auto joined = join(orientation)) {
      given_ = orientation.time;
      forget_positions();
      return joined;
    }
    ++unplaced_;
  }
  return {};
}

std::optional<RosPoseJoiner::Joined> RosPoseJoiner::join(const RosOrientation& orientation) const {
  auto after = positions_.lower_bound(orientation.time);
  if (after == positions_.end()) return {};
  // An orientation at the first position of all is at the beginning of the way to the second one.
  if (after == positions_.begin() && after->first == orientation.time && ++after == positions_.end()) return {};
  if (after == positions_.begin()) return {};
  const auto before = std::prev(after);
  if (after->first - before->first > kLongestSpan) return {};
  const double span = to_seconds(after->first - before->first);
  const double share = to_seconds(orientation.time - before->first) / span;
  const Eigen::Vector3d from = to_ecef(before->second.place).xyz, step = to_ecef(after->second.place).xyz - from;
  const RosPosition position{orientation.time, to_geodetic({from + step * share}), after->second.sigma_enu};
  return Joined{orientation, position, ecef_from_enu(after->second.place).rotation.conjugate() * step / span};
}

/// Forgets the positions that no later orientation needs: those before the last one that lies before what was given.
void RosPoseJoiner::forget_positions() {
  while (positions_.size() > 1 && std::next(positions_.begin())->first < *given_) positions_.erase(positions_.begin());
}

}  // namespace hueline::drivers
