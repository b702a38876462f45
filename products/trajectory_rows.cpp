#include <algorithm>
#include <cmath>
#include <utility>

#include "products/place_sigma.hpp"
#include "products/trajectory_export.hpp"

namespace hueline::products {
namespace {

constexpr nanoseconds kAround{5'000'000};  // poses this far before and after tell how the point turns with the vehicle
/// Rows of a POS that are no farther apart than this belong to one line, whatever the interpolation thinks of the gap.
constexpr nanoseconds kLongestStep{3'000'000'000};

}  // namespace

void TrajectoryRows::add(const InsSolution& solution) {
  const std::uint64_t used = trajectory_.counts().used;
  trajectory_.add(solution);
  if (trajectory_.counts().used == used) return;
  if (config_.rate_hz == 0) {
    times_.push_back(solution.time);
  } else {
    const auto interval = std::llround(1e9 / config_.rate_hz);
    const auto whole = [&](GpsTime time, std::int64_t add) {
      return gps_time_ns((count_ns(time) + add) / interval * interval);
    };
    for (GpsTime next = newest_ ? whole(*newest_, interval) : whole(solution.time, interval - 1); next <= solution.time;
         next += nanoseconds(interval)) {
      times_.push_back(next);
      newest_ = next;
    }
    if (!newest_) newest_ = whole(solution.time, 0);
  }
  give(false);
}

void TrajectoryRows::give(bool everything) {
  while (!times_.empty() && (everything || trajectory_.is_settled(times_.front() + kAround))) {
    const GpsTime time = times_.front();
    times_.pop_front();
    give(time);
    trajectory_.forget_before(time - 2 * kAround);
  }
}

void TrajectoryRows::give(GpsTime time) {
  const auto at = trajectory_.pose_at(time).pose;
  if (!at) {
    ++missing_;
    return;
  }
  const Eigen::Vector3d arm = at->T_enu_body.rotation * config_.point_body.xyz;
  TrajectoryRow row;
  row.time = time;
  const nanoseconds interval = from_seconds(config_.rate_hz > 0 ? 1 / config_.rate_hz : 0);
  const nanoseconds longest = std::max({kLongestStep, config_.trajectory.max_gap, 2 * interval});
  const auto before_this = std::exchange(given_, time);
  row.is_behind_gap = before_this && time - *before_this > longest;
  const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(*trajectory_.origin());
  row.position = to_geodetic(T_ecef_enu * Point<Enu>{at->T_enu_body.translation + arm});
  // The attitude is that in the local level of the place, which is turned a little against that of the origin.
  const Transform<Ecef, Enu> T_ecef_here = ecef_from_enu(row.position);
  const Eigen::Quaterniond here_from_origin = T_ecef_here.rotation.conjugate() * T_ecef_enu.rotation;
  row.attitude = attitude_from_enu_body(here_from_origin * at->T_enu_body.rotation);
  Eigen::Vector3d velocity = at->velocity_enu;
  const auto before = trajectory_.pose_at(time - kAround).pose, after = trajectory_.pose_at(time + kAround).pose;
  if (const double dt = to_seconds((after ? kAround : nanoseconds{0}) + (before ? kAround : nanoseconds{0})); dt > 0)
    velocity += ((after ? after : at)->T_enu_body.rotation * config_.point_body.xyz -
                 (before ? before : at)->T_enu_body.rotation * config_.point_body.xyz) /
                dt;
  row.velocity_enu = here_from_origin * velocity;
  row.sigma_position = place_sigma(*at, arm);
  row.sigma_attitude = at->sigma_attitude;
  use_(row);
}

}  // namespace hueline::products
