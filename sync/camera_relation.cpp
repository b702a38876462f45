#include "sync/camera_relation.hpp"

#include <algorithm>
#include <cmath>

#include "core/portable_math.hpp"

namespace hueline::sync {

std::string CameraRelation::Config::validate() const {
  if (pairs < 4 || pairs > 1000) return "pairs must be 4 to 1000";
  if (clock_sigma <= nanoseconds(0)) return "clock_sigma must be positive";
  if (!(rate_sigma_ppm > 0 && rate_sigma_ppm <= 1000)) return "rate_sigma_ppm must be above 0 and at most 1000";
  if (!(wander_ppb >= 0 && wander_ppb <= 1e5)) return "wander_ppb must be 0 to 100000";
  return {};
}

void CameraRelation::start(const std::vector<Pair>& pairs) {
  pairs_.assign(pairs.begin(), pairs.end());
  std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) { return a.counter_ns < b.counter_ns; });
  while (pairs_.size() > config_.pairs) pairs_.pop_front();
  fit();
}

void CameraRelation::add(const Pair& pair) {
  pairs_.push_back(pair);
  while (pairs_.size() > config_.pairs) pairs_.pop_front();
  fit();
}

void CameraRelation::fit() {
  const Pair& first = pairs_.front();
  // y is the GPS time since the first pair minus the counter's time since the first pair.
  const auto x = [&](const Pair& p) { return static_cast<double>(p.counter_ns - first.counter_ns); };
  const auto y = [&](const Pair& p) {
    return static_cast<double>((p.mark - first.mark).count() - (p.counter_ns - first.counter_ns));
  };
  const double n = static_cast<double>(pairs_.size());
  mean_x_ = mean_y_ = 0;
  for (const Pair& p : pairs_) {
    mean_x_ += x(p) / n;
    mean_y_ += y(p) / n;
  }
  const double floor = static_cast<double>(config_.clock_sigma.count());
  // The crystal's tolerance is one more observation of the slope. Its weight needs the scatter, so there are two
  // passes.
  scatter_ = floor;
  double xx = 0, xy = 0;
  for (const Pair& p : pairs_) {
    xx += (x(p) - mean_x_) * (x(p) - mean_x_);
    xy += (x(p) - mean_x_) * (y(p) - mean_y_);
  }
  for (int pass = 0; pass < 2; ++pass) {
    spread_ = xx + portable::square(scatter_ / (config_.rate_sigma_ppm * 1e-6));
    slope_ = xy / spread_;
    double sum = 0;
    for (const Pair& p : pairs_) sum += portable::square(y(p) - mean_y_ - slope_ * (x(p) - mean_x_));
    if (pairs_.size() > 2) scatter_ = std::max(floor, std::sqrt(sum / (n - 2)));
  }
}

CameraRelation::Prediction CameraRelation::predict(std::int64_t counter_ns) const {
  const Pair& first = pairs_.front();
  const std::int64_t elapsed = counter_ns - first.counter_ns;
  const double dx = static_cast<double>(elapsed) - mean_x_;
  const double ahead_s = std::max(0.0, static_cast<double>(counter_ns - pairs_.back().counter_ns)) * 1e-9;
  const double wander_ns = config_.wander_ppb * ahead_s * std::sqrt(ahead_s / 3);
  const double n = static_cast<double>(pairs_.size());
  Prediction out;
  out.mark = first.mark + nanoseconds(elapsed + static_cast<std::int64_t>(std::llround(mean_y_ + slope_ * dx)));
  out.sigma_ns = std::sqrt(scatter_ * scatter_ * (1 + 1 / n + dx * dx / spread_) + wander_ns * wander_ns);
  return out;
}

}  // namespace hueline::sync
