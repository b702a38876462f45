#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

#include "core/time.hpp"
#include "sync/clock_bank.hpp"

namespace hueline::sync {

/// Offset and rate of the host clock against the pulses: Kalman filters whose noise is measured, not set (ClockBank).
/// The pulse axis is ns with a whole second at every pulse, its zero at the pulse it was started with; which GPS second
/// that was is SecondLabel's matter. Reentrant.
class ClockFilter {
 public:
  struct Config {
    double jitter_us = 10;                   ///< of one edge, until measured; [0.01, 10000]
    double jitter_floor_us = 0.05;           ///< never believed to be better (resolution of the stamp); [0, 1000]
    double phase_walk_us = 0.1;              ///< us per square root of a second, until measured; [0, 1000]
    double frequency_walk_ppb = 5;           ///< ppb per square root of a second, until measured; [0, 1e5]
    double frequency_walk_floor_ppb = 0.02;  ///< no oscillator is believed to be better; [0, 1000]
    double rate_limit_ppm = 200;             ///< largest believable rate error of the host clock; [1, 10000]
    double gate_sigmas = 5;                  ///< an edge further off its prediction is refused; [3, 20]
    double edge_bias_us = 0.5;  ///< one sigma of the constant, unknowable part of the interrupt latency; [0, 10000]
    std::string validate() const;
  };
  explicit ClockFilter(Config config);

  void start(HostTime edge);
  bool is_started() const { return started_; }

  struct Innovation {
    std::int64_t pulse = 0;  ///< the nearest pulse
    double error_ns = 0;     ///< pulse minus prediction
    double sigma_ns = 0;     ///< expected size of error_ns
    bool fits = false;       ///< within the gate
  };
  Innovation examine(HostTime edge) const;
  /// Takes an edge that fits.
  void update(HostTime edge, const Innovation& innovation);
  /// Tells the filter of an edge it refused but that was near: a lasting rise of jitter opens the gate.
  void notice(const Innovation& innovation);

  /// Place on the pulse axis, ns; before or after the last edge.
  std::int64_t pulse_ns_at(HostTime t) const;
  double sigma_ns_at(HostTime t) const;
  /// Pulses (GPS seconds) per host second minus 1.
  double rate() const { return rate_; }
  HostTime last_edge() const { return anchor_; }
  const Instability& instability() const { return bank_.instability(); }

 private:
  Eigen::Matrix2d covariance_after(double dt_s) const;
  double jitter_variance() const;
  void remember(double error_ns);

  Config config_;
  ClockBank bank_;
  bool started_ = false;
  HostTime anchor_{};
  std::int64_t anchor_pulse_ns_ = 0;
  double phase_ns_ = 0;  // at anchor_: pulse axis = anchor_pulse_ns_ + phase_ns_
  double rate_ = 0;
  std::array<double, 16> recent_{};  // |innovation|, ns, the newest ones, refused ones included
  int recent_count_ = 0;
};

}  // namespace hueline::sync
