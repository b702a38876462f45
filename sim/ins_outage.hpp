#pragma once

#include <array>

#include "sim/noise.hpp"
#include "sim/scenario.hpp"

namespace hueline::sim {

/// The keys of a grade: those of the scenario with Custom, else the figures of a product (table in ins_outage.cpp, with
/// its sources).
InsConfig graded(const InsConfig& config);

/// What a strapdown solution drifts by while it has no satellites, beside its usual error, and the sigma that its
/// filter claims for it. Tilt grows by what is left of the gyros' bias and by angle random walk; gravity leaks through
/// the tilt into velocity, to which the accelerometers add bias and velocity random walk; velocity adds up to place. A
/// wheel pulls the velocity back. Satellites pull all of it back: place and velocity within seconds, attitude slowly.
/// The claim is the covariance of the same linear system: on average it is true. One step after the other; not
/// thread-safe.
class OutageDrift {
 public:
  OutageDrift(const InsConfig& graded, std::uint64_t seed);

  /// Goes on by `step_s` to sample `index`. `heading` rad, `speed` m/s.
  void advance(double step_s, bool has_gnss, double heading, double speed, std::uint64_t index);

  /// E N U (m), vE vN vU (m/s), roll pitch heading (rad).
  const std::array<double, 9>& error() const { return error_; }
  std::array<double, 9> sigma() const;

 private:
  /// Second moments of one axis: bias, angle, accelerometer bias, velocity, place, and place by heading.
  static constexpr std::size_t kStates = 6;
  struct Axis {
    std::array<std::array<double, kStates>, kStates> P{};
    double leak = 0;  ///< of the angle into acceleration, m/s2 a rad
    double accelerometer_noise = 0;
  };
  void propagate(Axis& axis, double step_s, double speed) const;

  InsConfig config_;
  std::uint64_t seed_;
  double gyro_bias_, angle_walk_, velocity_walk_, accelerometer_bias_;  // rad/s, rad/sqrt(s), m/s/sqrt(s), m/s2
  bool was_out_ = false;
  std::uint64_t outages_ = 0;
  std::array<double, 3> bias_{}, lean_{};  // of this outage: gyros roll pitch heading, accelerometers right forward up
  std::array<double, 9> error_{};
  std::array<Axis, 3> axis_;  // level, up, heading
};

}  // namespace hueline::sim
