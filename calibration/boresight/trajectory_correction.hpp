#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"

namespace hueline::calibration {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A model of the slow errors of a POS: six corrections (east, north, up in m; rotations about Body's x, y, z in rad)
/// at knots in time, with straight lines between them. Each correction is a first-order Gauss-Markov process with the
/// sigma that the POS states and a correlation time,
///   x(k+1) = exp(-dt / tau) x(k) + w,   var w = sigma^2 (1 - exp(-2 dt / tau))
/// (Gelb, Applied Optimal Estimation, 1974, section 3.6). The state is in units of sigma, so that the sigma may change
/// during the drive.
class TrajectoryCorrection {
 public:
  struct Config {
    /// time between two knots
    double knot_s = 4;
    double correlation_s = 90;
    std::size_t most_knots = 400;  ///< a longer drive has its knots farther apart
  };
  /// `sigmas` are in the order of time; `end_s` is the time of the last return.
  TrajectoryCorrection(const std::vector<PosSigma>& sigmas, double end_s, const Config& config);

  /// The position of a time between the knots `knot` and `knot + 1`.
  struct Place {
    std::size_t knot = 0;
    double share = 0;  ///< weight of the second knot, 0 to 1
  };
  /// Returns the place of a time. Times outside the drive have the place of its beginning or end.
  Place at(double time_s) const;
  /// Returns the six corrections at a place.
  Vector6d value(const Place& place) const;

  std::size_t knots() const { return sigma_.size(); }
  double knot_s() const { return knot_s_; }
  /// Returns one sigma of the six corrections at a knot. It is the unit of the state.
  const Vector6d& sigma(std::size_t knot) const { return sigma_[knot]; }
  /// Adds the information of the process and its gradient at the present state. `first` is the column of the state's
  /// first number.
  void add_prior(Eigen::MatrixXd& information, Eigen::VectorXd& gradient, Eigen::Index first) const;
  /// Adds `by` to the state.
  void move(const Eigen::Ref<const Eigen::VectorXd>& by) { state_ += by; }

 private:
  double knot_s_, keep_;
  std::vector<Vector6d> sigma_;
  Eigen::VectorXd state_;  // six numbers a knot, in sigmas
};

}  // namespace hueline::calibration
