#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace hueline::sync {

/// The noise of a clock that is read against a perfect pulse per second.
struct Instability {
  double jitter_ns2 = 0;      ///< variance of one reading (white phase noise): interrupt latency and noise of the edge
  double phase_walk = 0;      ///< white frequency noise, ns^2/s
  double frequency_walk = 0;  ///< random walk of the frequency, including temperature, ns^2/s^3
};

/// Estimates offset and rate of a clock whose Instability is not known.
///
/// Kalman filters for (offset, rate) run side by side, one for each ratio of the walks to the jitter on a logarithmic
/// grid. Each estimates the scale of its noise from its own innovations. Its weight is how well it predicted them
/// (multiple-model estimation with forgetting). The result is the mixture of all filters, so the stated variance
/// includes what is not known about the noise. Innovations show what second differences at a single lag cannot: a
/// frequency walk whose effect in one minute is far below the jitter.
///
/// The same input always gives the same result. Thread safety: one thread per object.
class ClockBank {
 public:
  /// `prior` sets the weights before there are data; an error of a factor of ten matters little. `floor` is the
  /// smallest noise that is believed.
  ClockBank(Instability prior, Instability floor);

  /// Starts with one reading at phase 0. `rate_variance` is the variance of the unknown rate, (ns/s)^2. `jitter_ns2` is
  /// the variance of one reading until more is known, instead of the prior's.
  void start(double rate_variance, double jitter_ns2);
  /// Tells that time has passed without a reading.
  void predict(double dt_s);
  /// Adds a reading: `phase_ns` is the clock's phase against the pulse now. `widened` is the factor by which the jitter
  /// variance is larger than usual (a burst).
  void update(double phase_ns, double widened);

  /// Returns the mixture now: phase (ns) and rate (ns/s). covariance() is their covariance.
  const Eigen::Vector2d& state() const { return state_; }
  const Eigen::Matrix2d& covariance() const { return covariance_; }
  const Instability& instability() const { return noise_; }

 private:
  struct Model {
    double phase_ratio, frequency_ratio;  // walks per unit of jitter variance
    Eigen::Vector2d x;                    // ns, ns/s
    Eigen::Matrix2d P;                    // per unit of jitter variance
    double sum_squares, readings;         // of normalised innovations, with forgetting
    double log_likelihood;
    double scale, weight;
  };
  void collapse();

  Instability prior_, floor_;
  std::vector<Model> models_;
  std::int64_t readings_ = 0;
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
  Instability noise_;
};

}  // namespace hueline::sync
