#include "drivers/ros/ros_pose.hpp"

#include <array>
#include <numbers>
#include <utility>

#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/portable_math.hpp"
#include "drivers/novatel/crc32.hpp"
#include "drivers/ros/ros_solution.hpp"

namespace hueline::drivers {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::uint16_t kInspva = 507, kInsstdev = 2051;
constexpr std::uint8_t kFineSteering = 180;
constexpr std::uint32_t kSolutionGood = 3;
// A receiver's log is expected to arrive this long after its time (HostClockModel::Config::arrival_latency), so logs
// that are made here do.
constexpr nanoseconds kLatency = std::chrono::milliseconds(3);
// No receiver makes so many poses; what is nearer has waited, and was stamped when it was taken.
constexpr nanoseconds kTogether = std::chrono::microseconds(500);

/// The bytes of one log.
class Log {
 public:
  template <class T>
  Log& put(T value) {
    const auto* from = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), from, from + sizeof value);
    return *this;
  }
  /// Returns the log with its head and its CRC.
  std::vector<std::byte> whole(std::uint16_t id, GpsTime time) const {
    const GpsWeekTime week = to_gps_week(time);
    Log out;
    out.put(std::uint8_t{0xAA}).put(std::uint8_t{0x44}).put(std::uint8_t{0x12}).put(std::uint8_t{28});
    out.put(id).put(std::uint8_t{0}).put(std::uint8_t{0x20}).put(static_cast<std::uint16_t>(bytes_.size()));
    out.put(std::uint16_t{0}).put(std::uint8_t{0}).put(kFineSteering).put(static_cast<std::uint16_t>(week.week));
    out.put(static_cast<std::uint32_t>(week.time_of_week / std::chrono::milliseconds(1)));
    out.put(std::uint64_t{0});
    out.bytes_.insert(out.bytes_.end(), bytes_.begin(), bytes_.end());
    out.put(novatel_crc32(out.bytes_));
    return out.bytes_;
  }

 private:
  std::vector<std::byte> bytes_;
};

/// INSSTDEV of the sigmas, and behind it INSPVA of the values, as far as the solution has them.
RosPose::Logs logs_of(const RosSolution& solution, UnixTime received) {
  std::vector<std::byte> bytes;
  if (solution.sigma) {
    Log sigma;
    for (const float value : *solution.sigma) sigma.put(value);
    sigma.put(std::uint64_t{0}).put(std::uint64_t{0});
    bytes = sigma.whole(kInsstdev, solution.time);
  }
  if (const auto& values = solution.values) {
    const GpsWeekTime week = to_gps_week(solution.time);
    Log log;
    log.put(static_cast<std::uint32_t>(week.week)).put(to_seconds(week.time_of_week));
    for (const auto* three : {&values->place, &values->velocity, &values->angles})
      for (const double value : *three) log.put(value);
    log.put(values->status);
    const auto whole = log.whole(kInspva, solution.time);
    bytes.insert(bytes.end(), whole.begin(), whole.end());
  }
  return {received, Buffer::copy_of(bytes)};
}

}  // namespace

RosWorld world_about(const Geodetic& origin) {
  const auto place = [T_ecef_origin = ecef_from_enu(origin)](const Eigen::Vector3d& enu) {
    const Geodetic at = to_geodetic(T_ecef_origin * Point<Enu>{enu});
    return std::optional(RosPlace{at, ecef_from_enu(at).rotation.conjugate() * T_ecef_origin.rotation});
  };
  return {RosMetres::AboutPlace, place};
}

bool RosPose::take(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out) {
  switch (rank_) {
    case RosPoseRank::Logs: {
      const RosHeader header = message.take_header();
      const auto bytes = message.take_byte_sequence();
      if (!message.ok()) return false;
      out.push_back({count_ns(header.stamp) > 0 ? header.stamp : recorded, Buffer::copy_of(bytes)});
      return true;
    }
    case RosPoseRank::Solution:
      return take_solution(type, message, recorded, out);
    case RosPoseRank::Local:
      if (carries_transforms(type)) return take_transforms(type, message, recorded, out);
      if (const auto local = take_local_pose(type, message, world_.metres))
        return take_local(type, *local, recorded, out);
      if (!is_of_other_metres(type, message, world_.metres)) return false;
      ++dropped_[std::string(type)].outside;
      return true;
    case RosPoseRank::Part:
      return take_part(type, message, recorded, out);
    case RosPoseRank::None:
      break;
  }
  return false;
}

bool RosPose::take_solution(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out) {
  const auto solution = drivers::take_solution(type, message);
  if (!solution) return false;
  out.push_back(logs_of(*solution, count_ns(solution->stamp) > 0 ? solution->stamp : recorded));
  return true;
}

/// Replaces a stamp that is missing. Returns whether it is on the clock that is read, and counts it if it is not.
bool RosPose::settle(UnixTime& stamp, UnixTime recorded, std::string_view type) {
  if (count_ns(stamp) == 0) stamp = recorded;  // the driver did not stamp
  const bool is_simulated = shift_ != nanoseconds(0);
  if ((stamp < to_unix(GpsTime())) == is_simulated) return true;
  ++dropped_[std::string(type)].of_other_clock;
  return false;
}

bool RosPose::take_part(std::string_view type, RosReader in, UnixTime recorded, std::vector<Logs>& out) {
  bool is_used = false;
  if (pose_part(type) != RosPosePart::Position) {
    orientation_type_ = type;
    auto orientation = take_orientation(type, in);
    if (!orientation) return false;
    if (!settle(orientation->time, recorded, type)) return true;
    is_used = joiner_.add(*orientation, recorded);
  } else {
    auto position = take_position(type, in);
    if (!position && !is_without_fix(type, in)) return false;
    if (!position) {
      ++dropped_[std::string(type)].without_fix;
      return true;
    }
    if (!settle(position->time, recorded, type)) return true;
    is_used = joiner_.add(*position, recorded);
  }
  if (!is_used) ++dropped_[std::string(type)].late;
  give_joined(out);
  return true;
}

void RosPose::give_joined(std::vector<Logs>& out) {
  while (const auto one = joiner_.next()) {
    const RosPosition& at = one->position;
    give({at.time, at.place, one->orientation.q_enu_flu, at.sigma_enu, {}}, one->velocity_enu, out);
  }
  if (joiner_.unplaced() > 0) dropped_[orientation_type_].unplaced = joiner_.unplaced();
}

void RosPose::finish(std::vector<Logs>& out) {
  joiner_.end();
  give_joined(out);
}

/// Takes the steps of the path that stand in a message. The first one ends a pose; those above it are taken before.
bool RosPose::take_transforms(std::string_view type, RosReader in, UnixTime recorded, std::vector<Logs>& out) {
  const auto transforms = drivers::take_transforms(in);
  if (!transforms) return false;
  for (std::size_t i = path_.steps.size(); i-- > 0;)
    for (const RosTransform& one : *transforms) {
      const RosTransformPath::Step& step = path_.steps[i];
      if (step.fixed || one.child != step.child || one.parent != step.parent) continue;
      steps_[i] = one.T_parent_child;
      if (i > 0) continue;
      Eigen::Isometry3d T_world_body = Eigen::Isometry3d::Identity();
      bool is_whole = true;
      for (std::size_t above = 0; above < steps_.size() && is_whole; ++above) {
        const auto& T = path_.steps[above].fixed ? path_.steps[above].fixed : steps_[above];
        is_whole = T.has_value();
        if (is_whole) T_world_body = *T * T_world_body;
      }
      if (!is_whole || !fits(world_.metres, T_world_body.translation())) continue;
      RosLocalPose pose;
      pose.time = one.time;
      pose.enu = T_world_body.translation();
      pose.q_enu_flu = Eigen::Quaterniond(T_world_body.linear()).normalized();
      if (!take_local(type, pose, recorded, out)) return false;
    }
  return true;
}

bool RosPose::take_local(std::string_view type, RosLocalPose local, UnixTime recorded, std::vector<Logs>& out) {
  if (!world_.place) return false;
  if (!settle(local.time, recorded, type)) return true;
  Dropped& dropped = dropped_[std::string(type)];
  const auto at = world_.place(local.enu);
  if (!at) {
    ++dropped.outside;
    return true;
  }
  const Pose now{local.time, at->place, at->q_enu_world * local.q_enu_flu, local.sigma_enu, local.sigma_flu};
  if (last_ && now.time <= last_->time) {
    ++(now.time == last_->time ? dropped.repeated : dropped.late);
    return true;
  }
  if (last_ && now.time - last_->time < kTogether) {
    ++dropped.together;
    return true;
  }
  const auto before = std::exchange(last_, now);
  if (!before) {
    ++dropped.alone;
    return true;
  }
  const Eigen::Vector3d step = to_ecef(now.place).xyz - to_ecef(before->place).xyz;
  const Eigen::Vector3d velocity =
      ecef_from_enu(now.place).rotation.conjugate() * step / to_seconds(now.time - before->time);
  if (std::exchange(dropped.alone, 0) > 0) give(*before, velocity, out);
  give(now, velocity, out);
  return true;
}

void RosPose::give(const Pose& pose, const Eigen::Vector3d& velocity, std::vector<Logs>& out) {
  course_.add(pose.time, pose.q_enu_flu, velocity);
  // From x right, y forward to x forward, y left: a quarter turn.
  const Eigen::Quaterniond flu_from_body = portable::rotation_about(Eigen::Vector3d::UnitZ(), -std::numbers::pi / 2);
  const Attitude attitude = attitude_from_enu_body(pose.q_enu_flu * flu_from_body);
  RosSolution solution;
  solution.time = from_unix(pose.time + shift_);
  RosSolutionValues& values = solution.values.emplace();
  values.status = kSolutionGood;
  values.place = {pose.place.latitude / kDegree, pose.place.longitude / kDegree, pose.place.ellipsoidal_height};
  values.velocity = {velocity.y(), velocity.x(), velocity.z()};
  values.angles = {attitude.roll / kDegree, attitude.pitch / kDegree, attitude.heading / kDegree};
  if (pose.sigma_enu) {
    // Messages of this kind say little about velocity, and some nothing of the attitude: 0.1 m/s, 0.2 deg, heading
    // 0.5 deg.
    const Eigen::Vector3f s = pose.sigma_enu->cast<float>();
    const Eigen::Vector3d known = pose.sigma_flu.value_or(Eigen::Vector3d(0.2, 0.2, 0.5) * kDegree) / kDegree;
    const Eigen::Vector3f turn = known.cast<float>();
    solution.sigma = {s.y(), s.x(), s.z(), 0.1f, 0.1f, 0.1f, turn.x(), turn.y(), turn.z()};
  }
  out.push_back(logs_of(solution, pose.time + kLatency));
}

}  // namespace hueline::drivers
