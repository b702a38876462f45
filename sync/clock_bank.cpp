#include "sync/clock_bank.hpp"

#include <algorithm>
#include <cmath>

#include "core/portable_math.hpp"

namespace hueline::sync {
namespace {

// Forgetting per reading: the jitter is followed within ten minutes, the kind of wander within an hour and a half.
constexpr double kScaleMemory = 1.0 - 1.0 / 600;
constexpr double kLikelihoodMemory = 1.0 - 1.0 / 5400;
constexpr int kReadingsForRate = 4;    // the first readings determine the rate and say nothing about the noise
constexpr double kPriorReadings = 4;   // weight of the prior jitter
constexpr double kPriorDecades = 1.0;  // one sigma of the prior walks
double log_prior(double walk, double expected) {
  const double decades = std::log10(std::max(walk, 1e-12) / std::max(expected, 1e-12)) / kPriorDecades;
  return -0.5 * decades * decades;
}

}  // namespace

ClockBank::ClockBank(Instability prior, Instability floor) : prior_(prior), floor_(floor), noise_(prior) {
  for (double frequency = 1e-12; frequency < 2e-2; frequency *= 10)
    for (double phase = 1e-6; phase < 20; phase *= 10)
      models_.push_back(
          {phase, frequency, Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero(), 0, 0, 0, prior.jitter_ns2, 0});
}

void ClockBank::start(double rate_variance, double jitter_ns2) {
  readings_ = 0;
  prior_.jitter_ns2 = jitter_ns2;
  for (Model& m : models_) {
    m.x.setZero();
    m.P << 1, 0, 0, rate_variance / prior_.jitter_ns2;
    m.sum_squares = m.readings = m.log_likelihood = 0;
    m.scale = prior_.jitter_ns2;
  }
  collapse();
}

void ClockBank::predict(double t) {
  for (Model& m : models_) {
    m.x(0) += m.x(1) * t;
    Eigen::Matrix2d& P = m.P;
    const double f = m.frequency_ratio;
    P(0, 0) += 2 * t * P(0, 1) + t * t * P(1, 1) + m.phase_ratio * t + f * t * t * t / 3;
    P(0, 1) = P(1, 0) = P(0, 1) + t * P(1, 1) + f * t * t / 2;
    P(1, 1) += f * t;
  }
}

void ClockBank::update(double phase_ns, double widened) {
  ++readings_;
  for (Model& m : models_) {
    const double R = widened, S = m.P(0, 0) + R, innovation = phase_ns - m.x(0);
    const Eigen::Vector2d gain = m.P.col(0) / S;
    m.x += gain * innovation;
    Eigen::Matrix2d I_KH = Eigen::Matrix2d::Identity();
    I_KH.col(0) -= gain;
    m.P = I_KH * m.P * I_KH.transpose() + gain * gain.transpose() * R;
    if (readings_ < kReadingsForRate) continue;
    const double square = innovation * innovation / S;
    m.sum_squares = kScaleMemory * m.sum_squares + square;
    m.readings = kScaleMemory * m.readings + 1;
    m.scale = std::max((kPriorReadings * prior_.jitter_ns2 + m.sum_squares) / (kPriorReadings + m.readings),
                       floor_.jitter_ns2);
    m.log_likelihood = kLikelihoodMemory * m.log_likelihood - 0.5 * (portable::log(S * m.scale) + square / m.scale);
  }
  collapse();
}

void ClockBank::collapse() {
  double best = -1e300;
  for (Model& m : models_) {
    m.weight = m.log_likelihood + log_prior(m.phase_ratio * m.scale, prior_.phase_walk) +
               log_prior(m.frequency_ratio * m.scale, prior_.frequency_walk);
    best = std::max(best, m.weight);
  }
  double sum = 0;
  for (Model& m : models_) sum += m.weight = portable::exp(m.weight - best);
  state_.setZero();
  noise_ = {0, 0, 0};
  for (Model& m : models_) {
    m.weight /= sum;
    state_ += m.weight * m.x;
    noise_.jitter_ns2 += m.weight * m.scale;
    noise_.phase_walk += m.weight * m.phase_ratio * m.scale;
    noise_.frequency_walk += m.weight * m.frequency_ratio * m.scale;
  }
  covariance_.setZero();
  for (const Model& m : models_) {
    const Eigen::Vector2d apart = m.x - state_;
    covariance_ += m.weight * (m.scale * m.P + apart * apart.transpose());
  }
  noise_.jitter_ns2 = std::max(noise_.jitter_ns2, floor_.jitter_ns2);
  noise_.phase_walk = std::max(noise_.phase_walk, floor_.phase_walk);
  noise_.frequency_walk = std::max(noise_.frequency_walk, floor_.frequency_walk);
}

}  // namespace hueline::sync
