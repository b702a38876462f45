#include "calibration/boresight/trajectory_correction.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::calibration {
namespace {

// Least sigmas, because a POS that states 0 does not know its own errors.
constexpr double kLeastPosition_m = 1e-4, kLeastTurn = 1e-6;

Vector6d six_of(const PosSigma& sigma) {
  Vector6d out;
  // Roll is a rotation about Body's y axis, pitch about x, heading about -z.
  out << sigma.position, sigma.attitude[1], sigma.attitude[0], sigma.attitude[2];
  out.head<3>() = out.head<3>().cwiseMax(kLeastPosition_m);
  out.tail<3>() = out.tail<3>().cwiseMax(kLeastTurn);
  return out;
}

}  // namespace

TrajectoryCorrection::TrajectoryCorrection(const std::vector<PosSigma>& sigmas, double end_s, const Config& config) {
  const double most = static_cast<double>(std::max<std::size_t>(config.most_knots, 2) - 1);
  knot_s_ = std::max(config.knot_s, end_s / most);
  keep_ = std::exp(-knot_s_ / config.correlation_s);
  const auto count = static_cast<std::size_t>(end_s / knot_s_) + 2;
  std::size_t i = 0;
  for (std::size_t knot = 0; knot < count; ++knot) {
    const double time_s = static_cast<double>(knot) * knot_s_;
    while (i + 1 < sigmas.size() && sigmas[i + 1].time_s <= time_s) ++i;
    sigma_.push_back(sigmas.empty() ? six_of({}) : six_of(sigmas[i]));
  }
  state_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * count));
}

TrajectoryCorrection::Place TrajectoryCorrection::at(double time_s) const {
  const double place = std::clamp(time_s / knot_s_, 0.0, static_cast<double>(knots() - 1));
  const std::size_t knot = std::min(static_cast<std::size_t>(place), knots() - 2);
  return {knot, place - static_cast<double>(knot)};
}

Vector6d TrajectoryCorrection::value(const Place& place) const {
  const auto of = [&](std::size_t knot) -> Vector6d {
    return sigma_[knot].cwiseProduct(state_.segment<6>(static_cast<Eigen::Index>(6 * knot)));
  };
  return (1 - place.share) * of(place.knot) + place.share * of(place.knot + 1);
}

void TrajectoryCorrection::add_prior(Eigen::MatrixXd& information, Eigen::VectorXd& gradient,
                                     Eigen::Index first) const {
  const double fresh = 1 / (1 - keep_ * keep_);
  for (Eigen::Index i = 0; i < state_.size(); ++i) {
    const Eigen::Index at = first + i, before = at - 6;
    if (i < 6) {
      information(at, at) += 1;
      gradient[at] += state_[i];
      continue;
    }
    const double step = state_[i] - keep_ * state_[i - 6];
    information(at, at) += fresh;
    information(before, before) += fresh * keep_ * keep_;
    information(at, before) -= fresh * keep_;
    information(before, at) -= fresh * keep_;
    gradient[at] += fresh * step;
    gradient[before] -= fresh * keep_ * step;
  }
}

}  // namespace hueline::calibration
