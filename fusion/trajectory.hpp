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
  None,         ///< there is a pose
  NoSolution,   ///< no good solution has come yet
  BeforeFirst,  ///< older than the oldest solution that is kept
  AfterLast,    ///< newer than the newest solution
  /// Between two solutions that are farther apart than max_gap, because messages were lost or solutions were not good.
  Gap,
};
constexpr int kNoPoseReasons = 5;
/// Returns the reason in words, for people.
const char* name(NoPose reason);

/// How far the POS's solutions leapt, as a sum of vectors: a leap and the leap back add to nothing.
struct Leap {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Enu, m
  Eigen::Vector3d attitude = Eigen::Vector3d::Zero();  ///< rotation vector in Enu, rad
};

/// The pose of the vehicle at one instant, in the local level at the drive's origin.
struct Pose {
  Transform<Enu, Body> T_enu_body;
  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();    ///< m/s
  Eigen::Vector3d sigma_position = Eigen::Vector3d::Zero();  ///< one sigma east, north, up, m
  Eigen::Vector3d sigma_attitude = Eigen::Vector3d::Zero();  ///< one sigma roll, pitch, heading, rad
  /// The sum of all leaps before. Two poses fit together as well as their sigmas say only if it is the same for both.
  Leap leapt;
};

/// Interpolates the POS's solutions to a continuous trajectory.
///
/// The position is a cubic Hermite spline through positions and velocities. The attitude is a cubic through the
/// rotation vectors of four neighbouring solutions. The error of slerp would grow with the angular acceleration: 3e-6
/// rad at 1 rad/s^2 and 200 Hz; that of the cubic stays below 1e-7 rad.
///
/// Thread safety: one thread calls add() and forget_before(); while it makes no such call, many threads may call
/// pose_at().
class Trajectory {
 public:
  struct Config {
    nanoseconds max_gap{200'000'000};  ///< no pose is given between solutions that are farther apart
    /// Acceleration that the interpolation may not know of, m/s^2. Inside a gap, sigma grows with it.
    double sigma_acceleration = 1.0;
    double sigma_angular_acceleration = 0.5;  ///< the same for the angular acceleration, rad/s^2
    double sigma_position_m = 0.05;           ///< for each axis, if the receiver gives no sigma
    double sigma_attitude = 5e-4;             ///< for each angle, if the receiver gives no sigma, rad
    /// A solution is a leap if it differs from the prediction of the one before by more than three sigma of both plus
    /// slack plus 0.5 acceleration dt^2. For the attitude, sigma and slack count as often as the interval from which
    /// the rate is fits into this one.
    double leap_acceleration = 5.0;           ///< m/s^2
    double leap_angular_acceleration = 20.0;  ///< rad/s^2
    double leap_slack_m = 0.05;
    double leap_slack = 2e-3;             ///< rad
    double origin_grid_deg = 1e-3;        ///< the latitude and longitude of the drive's origin are rounded to this
    double origin_grid_m = 10.0;          ///< and its height to this
    std::size_t max_solutions = 200'000;  ///< kept at most (16 minutes at 200 Hz); the oldest are dropped first
    void visit(Keys& keys);
    KeyError validate() const;
  };
  /// Solutions that were used, and those that were left out, by reason.
  struct Counts {
    std::uint64_t used = 0, not_good = 0, out_of_order = 0, not_finite = 0, crowded_out = 0, leaps = 0;
  };
  struct PoseOrReason {
    std::optional<Pose> pose;
    NoPose reason = NoPose::None;
  };

  /// `config.validate()` must be empty.
  explicit Trajectory(const Config& config) : config_(config) {}

  /// Adds a solution, in order of time. Solutions that are not good, not finite or not newer than the last are counted
  /// and left out.
  void add(const InsSolution& solution);
  /// Sets the sigma for later solutions that have none.
  void add(const InsUncertainty& uncertainty) { uncertainty_ = uncertainty.sigma; }

  /// Returns the origin of the local level: the first good position, rounded to the grid, so that drives in one place
  /// have the same origin. Empty before the first solution.
  const std::optional<Geodetic>& origin() const { return origin_; }
  /// Returns the pose at `time`, or why there is none.
  PoseOrReason pose_at(GpsTime time) const;
  /// Returns true if two solutions lie after `time`, so that later solutions do not change its pose.
  bool is_settled(GpsTime time) const { return solutions_.size() > 1 && solutions_[solutions_.size() - 2].time > time; }
  /// Removes solutions that no pose at or after `time` needs.
  void forget_before(GpsTime time);
  const Counts& counts() const { return counts_; }
  /// Size of the last leap, m and rad. Which side of a leap is right is not known. So the sigma of the solutions after
  /// it contains the leap, until another leap leads back.
  double leapt_m() const { return leapt_.position.norm(); }
  double leapt_angle() const { return leapt_.attitude.norm(); }

 private:
  struct Solution {
    GpsTime time;
    Eigen::Quaterniond q_enu_body;
    Eigen::Vector3d position, velocity, sigma_position, sigma_attitude;
    Eigen::Vector3d own_sigma_position, own_sigma_attitude;  // without the doubt from leaps
    Leap leapt;                                              // the sum of all leaps up to this one
  };
  void judge_leap(Solution& solution);
  Eigen::Quaterniond attitude_between(std::size_t after, double h, double s) const;

  Config config_;
  std::optional<Geodetic> origin_;
  Transform<Enu, Ecef> T_enu_ecef_;
  std::deque<Solution> solutions_;
  std::optional<std::array<double, 9>> uncertainty_;
  Eigen::Vector3d omega_body_ = Eigen::Vector3d::Zero();  // rad/s, of the last interval without a leap,
  double omega_step_s_ = 0;                               // which is as long as this
  bool has_omega_ = false;
  Leap leapt_, doubt_;  // the last leap; the sum of all leaps that no other leap has undone
  Counts counts_;
};

}  // namespace hueline::fusion
