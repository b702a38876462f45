#include "sync/clock_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/portable_math.hpp"

namespace hueline::sync {
namespace {

constexpr double kSecond = 1e9;
bool in(double v, double low, double high) { return v >= low && v <= high; }  // false for NaN

}  // namespace

std::string ClockFilter::Config::validate() const {
  if (!in(jitter_us, 0.01, 10000)) return "jitter_us must be 0.01 to 10000";
  if (!in(jitter_floor_us, 0, 1000)) return "jitter_floor_us must be 0 to 1000";
  if (!in(phase_walk_us, 0, 1000)) return "phase_walk_us must be 0 to 1000";
  if (!in(frequency_walk_ppb, 0, 1e5)) return "frequency_walk_ppb must be 0 to 100000";
  if (!in(frequency_walk_floor_ppb, 0, 1000)) return "frequency_walk_floor_ppb must be 0 to 1000";
  if (!in(rate_limit_ppm, 1, 10000)) return "rate_limit_ppm must be 1 to 10000";
  if (!in(gate_sigmas, 3, 20)) return "gate_sigmas must be 3 to 20";
  if (!in(edge_bias_us, 0, 10000)) return "edge_bias_us must be 0 to 10000";
  return {};
}

ClockFilter::ClockFilter(Config config)
    : config_(config),
      bank_({portable::square(config.jitter_us * 1e3), portable::square(config.phase_walk_us * 1e3),
             portable::square(config.frequency_walk_ppb)},
            {portable::square(config.jitter_floor_us * 1e3), 0, portable::square(config.frequency_walk_floor_ppb)}) {}

int ClockFilter::start(std::span<const HostTime> edges) {
  // The rate limit is taken as three sigma. 1 ppm is 1000 ns/s.
  bank_.start(portable::square(config_.rate_limit_ppm * 1e3 / 3), first_jitter_ns2(edges));
  started_ = true;
  anchor_ = edges.front();
  anchor_pulse_ns_ = 0;
  phase_ns_ = 0;
  rate_ = 0;
  recent_count_ = 0;
  int used = 1;
  for (const HostTime edge : edges.subspan(1)) {
    const Innovation innovation = examine(edge);
    if (!innovation.fits || innovation.pulse <= last_pulse()) continue;
    update(edge, innovation);
    ++used;
  }
  return used;
}

/// The scatter around the median of the slopes between all edges (Theil and Sen), by the median of the residuals, so
/// that a late interrupt among a few good ones does not count.
double ClockFilter::first_jitter_ns2(std::span<const HostTime> edges) const {
  constexpr std::size_t kLeast = 4;  // a line has two unknowns
  constexpr double kClearly = 2;     // times the expected jitter
  constexpr double kSigmaOfMad = 1.4826;
  const double expected_ns = config_.jitter_us * 1e3;
  if (edges.size() < kLeast) return portable::square(expected_ns);
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  std::vector<double> off_ns, slopes, residuals;
  for (const HostTime edge : edges) {
    const double since_ns = static_cast<double>((edge - edges.front()).count());
    off_ns.push_back(since_ns - std::round(since_ns / kSecond) * kSecond);
  }
  const auto seconds_at = [&](std::size_t i) { return to_seconds(edges[i] - edges.front()); };
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t k = i + 1; k < edges.size(); ++k)
      slopes.push_back((off_ns[k] - off_ns[i]) / (seconds_at(k) - seconds_at(i)));
  const double slope = median(slopes);
  for (std::size_t i = 0; i < edges.size(); ++i) residuals.push_back(off_ns[i] - slope * seconds_at(i));
  const double offset = median(residuals);
  for (double& residual : residuals) residual = std::abs(residual - offset);
  const double count = static_cast<double>(edges.size());
  const double shown_ns = kSigmaOfMad * median(residuals) * std::sqrt(count / (count - 2));
  return portable::square(shown_ns > kClearly * expected_ns ? shown_ns : expected_ns);
}

Eigen::Matrix2d ClockFilter::covariance_after(double dt_s) const {
  const Eigen::Matrix2d& P_now = bank_.covariance();
  const Instability& noise = bank_.instability();
  const double t = std::abs(dt_s), p = noise.phase_walk, f = noise.frequency_walk;
  Eigen::Matrix2d P;
  P(0, 0) = P_now(0, 0) + 2 * dt_s * P_now(0, 1) + dt_s * dt_s * P_now(1, 1) + p * t + f * t * t * t / 3;
  P(0, 1) = P(1, 0) = P_now(0, 1) + dt_s * P_now(1, 1) + (dt_s < 0 ? -1 : 1) * f * t * t / 2;
  P(1, 1) = P_now(1, 1) + f * t;
  return P;
}

double ClockFilter::jitter_variance() const {
  double variance = bank_.instability().jitter_ns2;
  // A burst of jitter is detected within half the ring of recent innovations. The long-term estimate needs minutes.
  if (recent_count_ >= 8) {
    std::array<double, 16> sorted = recent_;
    const auto end = sorted.begin() + std::min<int>(recent_count_, static_cast<int>(sorted.size()));
    const auto middle = sorted.begin() + (end - sorted.begin()) / 2;
    std::nth_element(sorted.begin(), middle, end);
    const double scale = 1.4826 * *middle;
    if (scale * scale > 4 * variance) variance = scale * scale;
  }
  return std::max(variance, portable::square(config_.jitter_floor_us * 1e3));
}

ClockFilter::Innovation ClockFilter::examine(HostTime edge) const {
  const double dt_s = to_seconds(edge - anchor_);
  const std::int64_t predicted = pulse_ns_at(edge);
  Innovation out;
  out.pulse = static_cast<std::int64_t>(std::llround(static_cast<double>(predicted) / kSecond));
  out.error_ns = static_cast<double>(out.pulse * 1'000'000'000 - predicted);
  out.sigma_ns = std::sqrt(covariance_after(dt_s)(0, 0) + jitter_variance());
  out.fits = std::abs(out.error_ns) <= std::min(config_.gate_sigmas * out.sigma_ns, 0.25e9);
  return out;
}

void ClockFilter::remember(double error_ns) {
  recent_[static_cast<std::size_t>(recent_count_) % recent_.size()] = std::abs(error_ns);
  ++recent_count_;
  if (recent_count_ >= 1 << 20) recent_count_ = static_cast<int>(recent_.size());
}

void ClockFilter::notice(const Innovation& innovation) {
  if (std::abs(innovation.error_ns) < 100 * innovation.sigma_ns && std::abs(innovation.error_ns) < 5e6)
    remember(innovation.error_ns);
}

void ClockFilter::update(HostTime edge, const Innovation& innovation) {
  // The bank counts the phase as pulse axis minus host time since the first edge, the same for all its filters.
  const double dt_s = to_seconds(edge - anchor_);
  const double predicted_ns = bank_.state()(0) + bank_.state()(1) * dt_s;
  const double widened = std::max(1.0, jitter_variance() / bank_.instability().jitter_ns2);
  bank_.predict(dt_s);
  bank_.update(predicted_ns + innovation.error_ns, widened);
  phase_ns_ = -innovation.error_ns + bank_.state()(0) - predicted_ns;
  anchor_pulse_ns_ = innovation.pulse * 1'000'000'000;
  rate_ = std::clamp(bank_.state()(1) * 1e-9, -config_.rate_limit_ppm * 1e-6, config_.rate_limit_ppm * 1e-6);
  anchor_ = edge;
  remember(innovation.error_ns);
}

std::int64_t ClockFilter::pulse_ns_at(HostTime t) const {
  const nanoseconds dt = t - anchor_;
  return anchor_pulse_ns_ + dt.count() +
         static_cast<std::int64_t>(std::llround(phase_ns_ + rate_ * static_cast<double>(dt.count())));
}

double ClockFilter::sigma_ns_at(HostTime t) const {
  return std::sqrt(std::max(0.0, covariance_after(to_seconds(t - anchor_))(0, 0)) +
                   portable::square(config_.edge_bias_us * 1e3));
}

}  // namespace hueline::sync
