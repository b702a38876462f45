#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "core/keys.hpp"
#include "core/measurements.hpp"

namespace hueline::fusion {

/// Why there is no pose at an instant.
enum class NoPose : std::uint8_t {
  None,         ///< there is one
  NoSolution,   ///< no good solution has come yet
  BeforeFirst,  ///< older than the oldest solution kept
  AfterLast,    ///< newer than the newest solution
  Gap,          ///< between two solutions farther apart than max_gap (lost messages, or a stretch that was not good)
};
constexpr int kNoPoseReasons = 5;
/// For people.
const char* name(NoPose reason);

/// The vehicle at one instant, against the local level at the drive's origin.
struct Pose {
  Transform<Enu, Body> T_enu_body;
  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();    ///< m/s
  Eigen::Vector3d sigma_position = Eigen::Vector3d::Zero();  ///< one sigma east, north, up, m
  Eigen::Vector3d sigma_attitude = Eigen::Vector3d::Zero();  ///< one sigma roll, pitch, heading, rad
};

/// The POS's solutions as a continuous path. Position: cubic Hermite through positions and velocities. Attitude: cubic
/// through the rotation vectors of four neighbouring solutions (slerp's error grows with angular acceleration: 3e-6 rad
/// at 1 rad/s^2 and 200 Hz; the cubic stays below 1e-7). Thread-bound for add and forget; pose_at may run in many
/// threads while nobody adds.
class Trajectory {
 public:
  struct Config {
    nanoseconds max_gap{200'000'000};  ///< farther apart: no pose between them
    double sigma_acceleration =
        1.0;  ///< m/s^2 that the interpolation may not know of; sigma grows with it inside a gap
    double sigma_angular_acceleration = 0.5;  ///< rad/s^2, likewise
    double sigma_position_m = 0.05;           ///< each axis, where the receiver gives none
    double sigma_attitude = 5e-4;             ///< rad, each angle, where the receiver gives none
    /// A solution this far from where the one before it leads (beyond three sigma of both) is a leap: 0.5 acceleration
    /// dt^2 + slack.
    double leap_acceleration = 5.0;           ///< m/s^2
    double leap_angular_acceleration = 20.0;  ///< rad/s^2
    double leap_slack_m = 0.05;
    double leap_slack = 2e-3;             ///< rad
    double origin_grid_deg = 1e-3;        ///< the drive's origin is rounded to this in latitude and longitude
    double origin_grid_m = 10.0;          ///< and to this in height
    std::size_t max_solutions = 200'000;  ///< kept at most (16 minutes at 200 Hz); the oldest go first
    void visit(Keys& keys);
    KeyError validate() const;
  };
  struct Counts {
    std::uint64_t used = 0, not_good = 0, out_of_order = 0, not_finite = 0, crowded_out = 0, leaps = 0;
  };
  struct PoseOrReason {
    std::optional<Pose> pose;
    NoPose reason = NoPose::None;
  };

  /// `config.validate()` must be empty.
  explicit Trajectory(const Config& config) : config_(config) {}

  /// Solutions in order of time; those that are not good, not finite or not newer than the last are counted and left
  /// out.
  void add(const InsSolution& solution);
  /// Sigma for the solutions that follow and bring none themselves.
  void add(const InsUncertainty& uncertainty) { uncertainty_ = uncertainty.sigma; }

  /// The local level's origin: the first good position, rounded to the grid, so that drives in one place share it.
  /// Empty before.
  const std::optional<Geodetic>& origin() const { return origin_; }
  PoseOrReason pose_at(GpsTime time) const;
  /// True once two solutions lie after `time`: later solutions do not change its pose.
  bool is_settled(GpsTime time) const { return solutions_.size() > 1 && solutions_[solutions_.size() - 2].time > time; }
  /// Solutions that no pose at or after `time` needs are dropped.
  void forget_before(GpsTime time);
  const Counts& counts() const { return counts_; }
  /// Of the last leap: m and rad. Which side of a leap is right nobody can tell: the sigma of what follows it contains
  /// the leap, until another one leads back.
  double leapt_m() const { return leapt_.position.norm(); }
  double leapt_angle() const { return leapt_.attitude.norm(); }

 private:
  struct Solution {
    GpsTime time;
    Eigen::Quaterniond q_enu_body;
    Eigen::Vector3d position, velocity, sigma_position, sigma_attitude;
    Eigen::Vector3d own_sigma_position, own_sigma_attitude;  // without the doubt of leaps
  };
  struct Leap {
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), attitude = Eigen::Vector3d::Zero();  // Enu, m and rad
  };
  void judge_leap(Solution& solution);
  Eigen::Quaterniond attitude_between(std::size_t after, double h, double s) const;

  Config config_;
  std::optional<Geodetic> origin_;
  Transform<Enu, Ecef> T_enu_ecef_;
  std::deque<Solution> solutions_;
  std::optional<std::array<double, 9>> uncertainty_;
  Eigen::Vector3d omega_body_ = Eigen::Vector3d::Zero();  // rad/s, of the last interval without a leap
  bool has_omega_ = false;
  Leap leapt_, doubt_;  // the last leap; all that have not been taken back
  Counts counts_;
};

}  // namespace hueline::fusion
