#include "sync/clock_instability.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>

namespace hueline::sync {

ClockInstability::ClockInstability(int window) : ring_(static_cast<std::size_t>(window)) {}

void ClockInstability::reset() {
  std::fill(ring_.begin(), ring_.end(), Reading{});
  first_ = 0;
  last_ = -1;
  count_ = 0;
}

void ClockInstability::add(std::int64_t pulse, double phase_ns) {
  if (pulse < 0) return;
  if (count_ == 0) first_ = pulse;
  ring_[static_cast<std::size_t>(pulse) % ring_.size()] = {pulse, phase_ns};
  last_ = pulse;
  ++count_;
}

Instability ClockInstability::estimate(const Instability& prior) const {
  if (count_ < 32) return prior;
  const auto size = static_cast<std::int64_t>(ring_.size());
  const std::int64_t begin = std::max(first_, last_ - size + 1);
  const auto at = [&](std::int64_t pulse) -> const Reading& { return ring_[static_cast<std::size_t>(pulse) % ring_.size()]; };
  // Weighted least squares of relative misfit: variances of noise have a constant relative error per degree of freedom.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const std::int64_t lag : {1, 2, 4, 8, 16, 32, 64}) {
    double sum = 0;
    std::int64_t n = 0;
    for (std::int64_t k = begin; k + 2 * lag <= last_; ++k) {
      const Reading &a = at(k), &b = at(k + lag), &c = at(k + 2 * lag);
      if (a.pulse != k || b.pulse != k + lag || c.pulse != k + 2 * lag) continue;
      const double d = c.phase_ns - 2 * b.phase_ns + a.phase_ns;
      sum += d * d;
      ++n;
    }
    // Readings shared between differences: about n / lag are independent.
    const double independent = static_cast<double>(n) / static_cast<double>(lag);
    if (independent < 3 || sum <= 0) continue;
    const double variance = sum / static_cast<double>(n), m = static_cast<double>(lag);
    const Eigen::Vector3d row = Eigen::Vector3d(6.0, 2.0 * m, 2.0 / 3.0 * m * m * m) / variance;
    normal += independent * row * row.transpose();
    right += independent * row;
  }
  // Non-negative: the best of the seven subsets that has no negative part.
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double best_gain = 0;
  for (int subset = 1; subset < 8; ++subset) {
    std::array<int, 3> index{};
    int n = 0;
    for (int i = 0; i < 3; ++i)
      if (subset >> i & 1) index[static_cast<std::size_t>(n++)] = i;
    Eigen::MatrixXd a(n, n);
    Eigen::VectorXd b(n);
    for (int r = 0; r < n; ++r) {
      const int ir = index[static_cast<std::size_t>(r)];
      const double scale_r = 1.0 / std::sqrt(normal(ir, ir));
      b(r) = right(ir) * scale_r;
      for (int c = 0; c < n; ++c) {
        const int ic = index[static_cast<std::size_t>(c)];
        a(r, c) = normal(ir, ic) * scale_r / std::sqrt(normal(ic, ic));
      }
    }
    const Eigen::VectorXd x = a.ldlt().solve(b);
    if (!x.allFinite() || x.minCoeff() < 0) continue;
    const double gain = x.dot(b);  // reduction of the weighted sum of squares
    if (gain <= best_gain) continue;
    best_gain = gain;
    best.setZero();
    for (int r = 0; r < n; ++r) {
      const int ir = index[static_cast<std::size_t>(r)];
      best(ir) = x(r) / std::sqrt(normal(ir, ir));
    }
  }
  if (best_gain <= 0) return prior;
  return {best(0), best(1), best(2)};
}

}  // namespace hueline::sync
