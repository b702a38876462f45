#include "fusion/trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {

Eigen::Quaterniond exp_of(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-12) return {1.0, 0.5 * rotation.x(), 0.5 * rotation.y(), 0.5 * rotation.z()};
  const double scale = portable::sin(0.5 * angle) / angle;
  return {portable::cos(0.5 * angle), scale * rotation.x(), scale * rotation.y(), scale * rotation.z()};
}

double round_to(double value, double grid) { return std::round(value / grid) * grid; }

bool is_finite(const InsSolution& s) {
  return std::isfinite(s.position.latitude) && std::isfinite(s.position.longitude) &&
         std::isfinite(s.position.ellipsoidal_height) && s.velocity_enu.allFinite() && std::isfinite(s.attitude.roll) &&
         std::isfinite(s.attitude.pitch) && std::isfinite(s.attitude.heading);
}

/// The cubic is used only if the neighbouring interval is comparable. Differences over a short interval say little
/// about a long one.
constexpr double kComparable = 4.0;

}  // namespace

const char* name(NoPose reason) {
  switch (reason) {
    case NoPose::None:
      return "None";
    case NoPose::NoSolution:
      return "the POS gave no good solution";
    case NoPose::BeforeFirst:
      return "older than the first good POS solution kept";
    case NoPose::AfterLast:
      return "newer than the last good POS solution";
    case NoPose::Gap:
      return "in a gap between good POS solutions";
  }
  return "?";
}

void Trajectory::Config::visit(Keys& keys) {
  keys.duration({"max_pose_gap_s", "s", "There is no pose between solutions that are farther apart."}, max_gap,
                {0.001, 10});
}

KeyError Trajectory::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  const auto outside = [](double v, double low, double high) { return !(v >= low && v <= high); };
  if (outside(sigma_acceleration, 0, 100))
    return not_allowed("sigma_acceleration", number_text(sigma_acceleration), "0 to 100 m/s^2");
  if (outside(sigma_angular_acceleration, 0, 100)) {
    return not_allowed("sigma_angular_acceleration", number_text(sigma_angular_acceleration), "0 to 100 rad/s^2");
  }
  if (outside(sigma_position_m, 0, 1000))
    return not_allowed("sigma_position_m", number_text(sigma_position_m), "0 to 1000 m");
  if (outside(sigma_attitude, 0, 1)) return not_allowed("sigma_attitude", number_text(sigma_attitude), "0 to 1 rad");
  if (outside(leap_acceleration, 0, 1000))
    return not_allowed("leap_acceleration", number_text(leap_acceleration), "0 to 1000 m/s^2");
  if (outside(leap_angular_acceleration, 0, 1e4)) {
    return not_allowed("leap_angular_acceleration", number_text(leap_angular_acceleration), "0 to 10000 rad/s^2");
  }
  if (outside(leap_slack_m, 0, 1000)) return not_allowed("leap_slack_m", number_text(leap_slack_m), "0 to 1000 m");
  if (outside(leap_slack, 0, 4)) return not_allowed("leap_slack", number_text(leap_slack), "0 to 4 rad");
  if (outside(origin_grid_deg, 1e-9, 1))
    return not_allowed("origin_grid_deg", number_text(origin_grid_deg), "1e-9 to 1 deg");
  if (outside(origin_grid_m, 1e-3, 1000))
    return not_allowed("origin_grid_m", number_text(origin_grid_m), "0.001 to 1000 m");
  if (max_solutions < 16) return not_allowed("max_solutions", std::to_string(max_solutions), "16 or more");
  return {};
}

void Trajectory::add(const InsSolution& solution) {
  if (!is_finite(solution)) {
    ++counts_.not_finite;
    return;
  }
  if (!solution.is_good) {
    ++counts_.not_good;
    return;
  }
  if (!solutions_.empty() && solution.time <= solutions_.back().time) {
    ++counts_.out_of_order;
    return;
  }
  if (!origin_) {
    const double grid = config_.origin_grid_deg * std::numbers::pi / 180.0;
    origin_ = Geodetic{round_to(solution.position.latitude, grid), round_to(solution.position.longitude, grid),
                       round_to(solution.position.ellipsoidal_height, config_.origin_grid_m)};
    T_enu_ecef_ = ecef_from_enu(*origin_).inverse();
  }
  // Velocity and attitude refer to the local level at the vehicle. At 10 km from the origin, it is tilted by 1.6 mrad
  // against the origin's.
  const Transform<Enu, Enu> T_enu_local = T_enu_ecef_ * ecef_from_enu(solution.position);
  Solution s;
  s.time = solution.time;
  s.position = T_enu_local.translation;
  s.velocity = T_enu_local.rotation * solution.velocity_enu;
  s.q_enu_body = (T_enu_local.rotation * rotation_enu_body(solution.attitude)).normalized();
  const auto& sigma = solution.sigma ? solution.sigma : uncertainty_;
  if (sigma) {
    s.sigma_position = {(*sigma)[0], (*sigma)[1], (*sigma)[2]};
    s.sigma_attitude = {(*sigma)[6], (*sigma)[7], (*sigma)[8]};
  } else {
    s.sigma_position.setConstant(config_.sigma_position_m);
    s.sigma_attitude.setConstant(config_.sigma_attitude);
  }
  s.own_sigma_position = s.sigma_position;
  s.own_sigma_attitude = s.sigma_attitude;
  if (!solutions_.empty()) s.leapt = solutions_.back().leapt;
  judge_leap(s);
  solutions_.push_back(s);
  ++counts_.used;
  if (solutions_.size() > config_.max_solutions) {
    solutions_.pop_front();
    ++counts_.crowded_out;
  }
}

void Trajectory::judge_leap(Solution& now) {
  if (solutions_.empty()) return;
  const Solution& last = solutions_.back();
  const double dt = to_seconds(now.time - last.time);
  if (dt > to_seconds(config_.max_gap)) {
    has_omega_ = false;  // nothing is placed in the gap, and much may have happened in it
    return;
  }
  const Eigen::Vector3d off = now.position - last.position - 0.5 * dt * (last.velocity + now.velocity);
  const Eigen::Vector3d turned = portable::rotation_vector(last.q_enu_body.conjugate() * now.q_enu_body);
  const Eigen::Vector3d bent = has_omega_ ? Eigen::Vector3d(turned - dt * omega_body_) : Eigen::Vector3d::Zero();
  const auto noise = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double slack) {
    return 3.0 * portable::hypot(a.norm(), b.norm()) + slack;
  };
  // A rate that a short step says is as uncertain as that step's errors are, as often as it fits into this one: poses
  // that were stamped when they arrived, two at once, are microseconds apart.
  const double times = has_omega_ ? std::max(1.0, dt / omega_step_s_) : 1.0;
  const bool leaps = off.norm() > noise(last.own_sigma_position, now.own_sigma_position, config_.leap_slack_m) +
                                      0.5 * config_.leap_acceleration * dt * dt;
  const bool spins = bent.norm() > times * noise(last.own_sigma_attitude, now.own_sigma_attitude, config_.leap_slack) +
                                       0.5 * config_.leap_angular_acceleration * dt * dt;
  if (!spins) {
    omega_body_ = turned / dt;
    omega_step_s_ = dt;
    has_omega_ = true;
  }
  if (leaps || spins) {
    ++counts_.leaps;
    leapt_.position = leaps ? off : Eigen::Vector3d::Zero();
    leapt_.attitude = spins ? Eigen::Vector3d(last.q_enu_body * bent) : Eigen::Vector3d::Zero();
    const auto settle = [](Eigen::Vector3d& doubt, const Eigen::Vector3d& leap) {
      if (leap.isZero()) return;
      doubt += leap;
      if (doubt.norm() < 0.2 * leap.norm()) doubt.setZero();  // it leapt back
    };
    now.leapt.position += leapt_.position;
    now.leapt.attitude += leapt_.attitude;
    settle(doubt_.position, leapt_.position);
    settle(doubt_.attitude, leapt_.attitude);
  }
  // The direction of the leap is known, but not how the error is distributed over the axes. So every axis gets the
  // whole.
  const auto grow = [](Eigen::Vector3d& sigma, double doubt) {
    sigma = (sigma.array().square() + doubt * doubt).sqrt().matrix();
  };
  grow(now.sigma_position, doubt_.position.norm());
  grow(now.sigma_attitude, doubt_.attitude.norm());
}

Eigen::Quaterniond Trajectory::attitude_between(std::size_t after, double h, double s) const {
  const Solution &a = solutions_[after - 1], &b = solutions_[after];
  const Eigen::Quaterniond a_inverse = a.q_enu_body.conjugate();
  const Eigen::Vector3d step = portable::rotation_vector(a_inverse * b.q_enu_body);
  Eigen::Vector3d turned = s * step;
  // Newton's form of the interpolation polynomial through the rotation vectors at the times -u, 0, 1 and 1 + w, in
  // units of h. Each neighbour that is there gives one more term.
  const bool has_left = after >= 2, has_right = after + 1 < solutions_.size();
  const double u = has_left ? to_seconds(a.time - solutions_[after - 2].time) / h : 0.0;
  const double w = has_right ? to_seconds(solutions_[after + 1].time - b.time) / h : 0.0;
  const bool use_left = has_left && u < kComparable && u > 1.0 / kComparable;
  const bool use_right = has_right && w < kComparable && w > 1.0 / kComparable;
  Eigen::Vector3d bend = Eigen::Vector3d::Zero();
  const double basis = s * (s - 1.0);
  if (use_left) {
    const Eigen::Vector3d left = portable::rotation_vector(a_inverse * solutions_[after - 2].q_enu_body);
    bend = (left + u * step) / (u * (u + 1.0));
    turned += basis * bend;
  }
  if (use_right) {
    const double x = 1.0 + w;
    const Eigen::Vector3d right = portable::rotation_vector(a_inverse * solutions_[after + 1].q_enu_body);
    const Eigen::Vector3d rest = right - x * step - x * (x - 1.0) * bend;
    turned += use_left ? Eigen::Vector3d(rest * (basis * (s + u) / (x * (x - 1.0) * (x + u))))
                       : Eigen::Vector3d(rest * (basis / (x * (x - 1.0))));
  }
  return (a.q_enu_body * exp_of(turned)).normalized();
}

Trajectory::PoseOrReason Trajectory::pose_at(GpsTime time) const {
  if (solutions_.empty()) return {std::nullopt, NoPose::NoSolution};
  if (time < solutions_.front().time) return {std::nullopt, NoPose::BeforeFirst};
  if (time > solutions_.back().time) return {std::nullopt, NoPose::AfterLast};
  const auto after_it = std::upper_bound(solutions_.begin(), solutions_.end(), time,
                                         [](GpsTime t, const Solution& s) { return t < s.time; });
  auto after = static_cast<std::size_t>(after_it - solutions_.begin());
  if (solutions_[after - 1].time == time) {
    const Solution& exact = solutions_[after - 1];
    return {Pose{{exact.q_enu_body, exact.position},
                 exact.velocity,
                 exact.sigma_position,
                 exact.sigma_attitude,
                 exact.leapt},
            NoPose::None};
  }
  const Solution &a = solutions_[after - 1], &b = solutions_[after];
  if (b.time - a.time > config_.max_gap) return {std::nullopt, NoPose::Gap};

  const double h = to_seconds(b.time - a.time), s = to_seconds(time - a.time) / h;
  const double s2 = s * s, s3 = s2 * s;
  Pose pose;
  // The position of the first solution is the large term, so rounding stays relative to the step.
  const Eigen::Vector3d step = b.position - a.position;
  pose.T_enu_body.translation =
      a.position + (3.0 * s2 - 2.0 * s3) * step + h * (s - 2.0 * s2 + s3) * a.velocity + h * (s3 - s2) * b.velocity;
  pose.velocity_enu =
      (6.0 * (s - s2) / h) * step + (1.0 - 4.0 * s + 3.0 * s2) * a.velocity + (3.0 * s2 - 2.0 * s) * b.velocity;
  pose.T_enu_body.rotation = attitude_between(after, h, s);
  const double bump = 0.5 * s * (1.0 - s) * h * h;  // how much a constant unknown acceleration bends the path
  const auto grown = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to, double unknown) {
    const Eigen::Array3d base = (1.0 - s) * from.array() + s * to.array();
    return Eigen::Vector3d((base.square() + (unknown * bump) * (unknown * bump)).sqrt().matrix());
  };
  pose.sigma_position = grown(a.sigma_position, b.sigma_position, config_.sigma_acceleration);
  pose.sigma_attitude = grown(a.sigma_attitude, b.sigma_attitude, config_.sigma_angular_acceleration);
  pose.leapt = s < 0.5 ? a.leapt : b.leapt;
  return {pose, NoPose::None};
}

void Trajectory::forget_before(GpsTime time) {
  // One solution at or before `time` and one more neighbour are still needed.
  while (solutions_.size() > 3 && solutions_[2].time <= time) solutions_.pop_front();
}

}  // namespace hueline::fusion
