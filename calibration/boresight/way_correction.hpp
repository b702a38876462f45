#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"

namespace hueline::calibration {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// What a POS's slow errors may have been: six corrections (east, north, up in m; turns about Body's x, y, z in rad) at
/// knots, straight lines between them. Each is a first-order Gauss-Markov process with the sigma that the POS states
/// and a correlation time,
///   x(k+1) = exp(-dt / tau) x(k) + w,   var w = sigma^2 (1 - exp(-2 dt / tau))
/// (Gelb, Applied Optimal Estimation, 1974, section 3.6). The state is in units of sigma, so that a sigma may change on
/// the way.
class WayCorrection {
 public:
  struct Config {
    double knot_s = 4;
    double correlation_s = 90;
    std::size_t most_knots = 400;  ///< a longer drive has its knots farther apart
  };
  WayCorrection(const std::vector<PosSigma>& sigmas, double end_s, const Config& config);

  /// Where a time lies: between knots `knot` and `knot + 1`.
  struct Place {
    std::size_t knot = 0;
    double share = 0;  ///< of the second one
  };
  Place at(double time_s) const;
  Vector6d value(const Place& place) const;

  std::size_t knots() const { return sigma_.size(); }
  double knot_s() const { return knot_s_; }
  /// One sigma of the six corrections at a knot: what a unit of the state is.
  const Vector6d& sigma(std::size_t knot) const { return sigma_[knot]; }
  /// Adds the process's information and its gradient at the present state; `first`: column of the state's first number.
  void add_prior(Eigen::MatrixXd& information, Eigen::VectorXd& gradient, Eigen::Index first) const;
  void move(const Eigen::Ref<const Eigen::VectorXd>& by) { state_ += by; }

 private:
  double knot_s_, keep_;
  std::vector<Vector6d> sigma_;
  Eigen::VectorXd state_;  // 6 a knot, in sigmas
};

}  // namespace hueline::calibration
