#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "core/time.hpp"
#include "sync/clock_bank.hpp"

namespace hueline::sync {

/// Estimates offset and rate of the host clock against the pulses, by Kalman filters that measure their noise
/// (ClockBank). The pulse axis is in ns: each pulse is at a whole second, and the pulse of start() is at zero. Which
/// GPS second that is, SecondLabel finds out. Thread safety: one thread per object.
class ClockFilter {
 public:
  struct Config {
    double jitter_us = 10;                   ///< jitter of one edge, unless the first ones show more; [0.01, 10000]
    double jitter_floor_us = 0.05;           ///< smallest jitter that is believed (resolution of the stamp); [0, 1000]
    double phase_walk_us = 0.1;              ///< us per square root of a second, until it is measured; [0, 1000]
    double frequency_walk_ppb = 5;           ///< ppb per square root of a second, until it is measured; [0, 1e5]
    double frequency_walk_floor_ppb = 0.02;  ///< smallest frequency walk that is believed of an oscillator; [0, 1000]
    double rate_limit_ppm = 200;             ///< largest believable rate error of the host clock; [1, 10000]
    double gate_sigmas = 5;                  ///< an edge that is further off its prediction is refused; [3, 20]
    /// One sigma of the constant part of the interrupt latency, which cannot be measured; [0, 10000].
    double edge_bias_us = 0.5;
    std::string validate() const;
  };
  explicit ClockFilter(Config config);

  /// Starts with edges of one phase, oldest first, and uses those that fit; at least one. Returns how many it used. If
  /// the edges scatter clearly more than Config::jitter_us says, then the jitter is what they show: with too small a
  /// jitter the first two would determine the rate, the others would be refused, and the wrong rate would stay.
  int start(std::span<const HostTime> edges);
  bool is_started() const { return started_; }

  /// An edge compared with its prediction.
  struct Innovation {
    std::int64_t pulse = 0;  ///< the nearest pulse
    double error_ns = 0;     ///< pulse minus prediction
    double sigma_ns = 0;     ///< expected size of error_ns
    bool fits = false;       ///< error_ns is within the gate
  };
  /// Compares an edge with its prediction, without using it.
  Innovation examine(HostTime edge) const;
  /// Uses an edge that fits.
  void update(HostTime edge, const Innovation& innovation);
  /// Notes the innovation of an edge that was refused. If it was small enough, it counts for the jitter, so a lasting
  /// rise of the jitter opens the gate.
  void notice(const Innovation& innovation);

  /// Returns the place of `t` on the pulse axis, ns; `t` may be before or after the last edge.
  std::int64_t pulse_ns_at(HostTime t) const;
  double sigma_ns_at(HostTime t) const;
  /// Returns pulse seconds (GPS seconds) per host second, minus 1.
  double rate() const { return rate_; }
  HostTime last_edge() const { return anchor_; }
  /// Returns the pulse of the last edge, counted from the first one.
  std::int64_t last_pulse() const { return anchor_pulse_ns_ / 1'000'000'000; }
  const Instability& instability() const { return bank_.instability(); }

 private:
  double first_jitter_ns2(std::span<const HostTime> edges) const;
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
  // innovation| of the newest edges, refused ones included, ns.
  std::array<double, 16> recent_{};
  int recent_count_ = 0;
};

}  // namespace hueline::sync
