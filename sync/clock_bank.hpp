#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace hueline::sync {

/// What disturbs a clock read against a perfect pulse per second.
struct Instability {
  double jitter_ns2 = 0;      ///< variance of one reading (white phase noise): interrupt latency, edge noise
  double phase_walk = 0;      ///< ns^2/s: white frequency noise
  double frequency_walk = 0;  ///< ns^2/s^3: random walk of the frequency, temperature included
};

/// Offset and rate of a clock whose Instability is not known. Kalman filters (offset, rate) run side by side, one for
/// each ratio of the walks to the jitter on a logarithmic grid; the scale of each is estimated from its own
/// innovations, and how well each predicted them is its weight (multiple-model estimation, with forgetting). The answer
/// is their mixture, so the stated variance holds what is not known about the noise as well. Innovations tell apart
/// what second differences at any one lag cannot: a frequency walk whose effect in a minute is far below the jitter.
/// Deterministic; reentrant.
class ClockBank {
 public:
  /// `prior`: weights before data; a decade off costs little. `floor`: smaller is never believed.
  ClockBank(Instability prior, Instability floor);

  /// `rate_variance`: (ns/s)^2, of the unknown rate. The clock was just read once, at phase 0.
  void start(double rate_variance);
  /// Time passes without a reading.
  void predict(double dt_s);
  /// A reading: `phase_ns` of the clock against the pulse, now. `widened`: jitter variance is this much larger than
  /// usual (a burst).
  void update(double phase_ns, double widened);

  /// Mixture now: phase (ns) and rate (ns/s), and their covariance.
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
