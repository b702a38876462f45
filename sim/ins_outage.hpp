#pragma once

#include <array>

#include "sim/noise.hpp"
#include "sim/scenario.hpp"

namespace hueline::sim {

/// Returns `config` with the values of its grade: unchanged with Custom, else with the figures of the product (the
/// table in ins_outage.cpp names its sources).
InsConfig graded(const InsConfig& config);

/// The drift of a strapdown solution while it has no satellites, on top of its usual error, and the sigma that its
/// filter claims for the drift. The tilt grows by the residual bias of the gyros and by angle random walk. Gravity
/// leaks through the tilt into the velocity, to which the accelerometers add bias and velocity random walk; the
/// velocity integrates into the position. A wheel sensor pulls the velocity back. When satellites return, position and
/// velocity recover within seconds and the attitude slowly. The claimed sigma is the covariance of the same linear
/// system, so on average it is true. Call `advance()` for one sample after the other. Thread safety: none.
class OutageDrift {
 public:
  OutageDrift(const InsConfig& graded, std::uint64_t seed);

  /// Advances the drift by `step_s` to sample `index`, which numbers its random draws. `heading` in rad, `speed` in
  /// m/s.
  void advance(double step_s, bool has_gnss, double heading, double speed, std::uint64_t index);

  /// Returns the drift: east, north, up (m), velocity likewise (m/s), roll, pitch, heading (rad).
  const std::array<double, 9>& error() const { return error_; }
  /// Returns the claimed sigmas in the order of `error()`.
  std::array<double, 9> sigma() const;

 private:
  /// Covariance of one axis. The states are bias, angle, accelerometer bias, velocity, position, and position error
  /// caused by the heading.
  static constexpr std::size_t kStates = 6;
  struct Axis {
    std::array<std::array<double, kStates>, kStates> P{};
    double leak = 0;  ///< acceleration that a tilt of one radian causes, m/s2
    double accelerometer_noise = 0;
  };
  void propagate(Axis& axis, double step_s, double speed) const;

  InsConfig config_;
  std::uint64_t seed_;
  double gyro_bias_, angle_walk_, velocity_walk_, accelerometer_bias_;  // rad/s, rad/sqrt(s), m/s/sqrt(s), m/s2
  bool was_out_ = false;
  std::uint64_t outages_ = 0;
  // biases of this outage: gyros about roll, pitch, heading; accelerometers to the right, forward, up
  std::array<double, 3> bias_{}, lean_{};
  std::array<double, 9> error_{};
  std::array<Axis, 3> axis_;  // level, up, heading
};

}  // namespace hueline::sim
