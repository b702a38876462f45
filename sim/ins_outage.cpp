#include "sim/ins_outage.hpp"

#include <cmath>

namespace hueline::sim {
namespace {

constexpr double kGravity = 9.81;
// With satellites back, a fixed RTK solution is found again; the attitude follows by manoeuvres.
constexpr double kPlaceBack_s = 1.5, kAttitudeBack_s = 20;
enum State : std::size_t { kBias, kAngle, kLean, kVelocity, kPlace, kPlaceByHeading };

}  // namespace

// pos_lv_220 and pos_lv_420 are of the class of those systems with real-time RTK (position 0.035 m, roll and pitch
// 0.020 deg, heading 0.050 and 0.020 deg); they were not checked against the maker's datasheet. Their inertial figures
// are chosen so that with the wheel sensor a minute without satellites costs a few decimetres. span_cpt: in-run bias of
// the gyros 1 deg/h and random walk 0.0667 deg/sqrt(h) from NovAtel's SPAN-CPT manual OM-20000122, table 9. The biases
// in the table below are what a filter leaves of them.
InsConfig graded(const InsConfig& c) {
  InsConfig g = c;
  const auto set = [&](double place, double velocity, double level_deg, double heading_deg, double bias, double walk,
                       double velocity_walk, double lean, double wheel_s) {
    g.position_sigma_m = place;
    g.velocity_sigma = velocity;
    g.roll_pitch_sigma_deg = level_deg;
    g.heading_sigma_deg = heading_deg;
    g.gyro_bias_deg_h = bias;
    g.angle_random_walk_deg_sqrt_h = walk;
    g.velocity_random_walk_sqrt_h = velocity_walk;
    g.accelerometer_bias_ug = lean;
    g.wheel_s = wheel_s;
  };
  switch (c.grade) {
    case InsGrade::Custom:
      break;
    case InsGrade::PosLv220:
      set(0.035, 0.005, 0.020, 0.050, 0.5, 0.05, 0.02, 60, 8);
      break;
    case InsGrade::PosLv420:
      set(0.035, 0.005, 0.020, 0.020, 0.1, 0.02, 0.01, 40, 8);
      break;
    case InsGrade::SpanCpt:
      set(0.020, 0.015, 0.015, 0.030, 0.5, 0.0667, 0.032, 60, 0);
      break;
  }
  return g;
}

OutageDrift::OutageDrift(const InsConfig& c, std::uint64_t seed)
    : config_(c),
      seed_(seed),
      gyro_bias_(radians(c.gyro_bias_deg_h) / 3600),
      angle_walk_(radians(c.angle_random_walk_deg_sqrt_h) / 60),
      velocity_walk_(c.velocity_random_walk_sqrt_h / 60),
      accelerometer_bias_(c.accelerometer_bias_ug * 1e-6 * kGravity) {
  axis_[0].leak = kGravity;
}

void OutageDrift::propagate(Axis& axis, double dt, double speed) const {
  std::array<std::array<double, kStates>, kStates> F{}, next{};
  for (std::size_t i = 0; i < kStates; ++i) F[i][i] = 1;
  F[kAngle][kBias] = dt;
  F[kVelocity][kAngle] = axis.leak * dt;
  F[kVelocity][kLean] = dt;
  if (config_.wheel_s > 0) F[kVelocity][kVelocity] = std::exp(-dt / config_.wheel_s);
  F[kPlace][kVelocity] = dt;
  F[kPlaceByHeading][kAngle] = speed * dt;
  for (std::size_t i = 0; i < kStates; ++i)
    for (std::size_t j = 0; j < kStates; ++j)
      for (std::size_t k = 0; k < kStates; ++k)
        for (std::size_t l = 0; l < kStates; ++l)
          if (F[i][k] != 0 && F[j][l] != 0) next[i][j] += F[i][k] * axis.P[k][l] * F[j][l];
  next[kAngle][kAngle] += angle_walk_ * angle_walk_ * dt;
  next[kVelocity][kVelocity] += axis.accelerometer_noise * axis.accelerometer_noise * dt;
  axis.P = next;
}

void OutageDrift::advance(double dt, bool has_gnss, double heading, double speed, std::uint64_t index) {
  if (!has_gnss && !was_out_) {
    // At the beginning of an outage, draw the part of the biases that the filter does not know.
    ++outages_;
    for (std::size_t i = 0; i < 3; ++i) {
      bias_[i] = gyro_bias_ * gaussian(seed_, kStreamInsOutage + i, outages_);
      lean_[i] = accelerometer_bias_ * gaussian(seed_, kStreamInsOutage + 3 + i, outages_);
    }
    for (Axis& axis : axis_) {
      for (std::size_t i = 0; i < kStates; ++i)
        for (const std::size_t j : {kBias, kLean}) axis.P[i][j] = axis.P[j][i] = 0;
      axis.P[kBias][kBias] = &axis == &axis_[1] ? 0 : gyro_bias_ * gyro_bias_;
      axis.P[kLean][kLean] = &axis == &axis_[2] ? 0 : accelerometer_bias_ * accelerometer_bias_;
      axis.accelerometer_noise = &axis == &axis_[2] ? 0 : velocity_walk_;
    }
  }
  was_out_ = !has_gnss;
  if (has_gnss) {
    const double quick = std::exp(-dt / kPlaceBack_s), slow = std::exp(-dt / kAttitudeBack_s);
    for (std::size_t i = 0; i < 9; ++i) error_[i] *= i < 6 ? quick : slow;
    for (Axis& axis : axis_)
      for (std::size_t i = 0; i < kStates; ++i)
        for (std::size_t j = 0; j < kStates; ++j)
          axis.P[i][j] *= (i < kVelocity ? slow : quick) * (j < kVelocity ? slow : quick);
    return;
  }
  const double root = std::sqrt(dt), s = std::sin(heading), c = std::cos(heading);
  // Roll and pitch leak gravity into the acceleration to the right and forward. Their signs do not matter, because the
  // errors are symmetric.
  const double right = kGravity * error_[6] + lean_[0], forward = kGravity * error_[7] + lean_[1];
  const std::array<double, 3> acceleration{c * right + s * forward, -s * right + c * forward, lean_[2]};
  const double keep = config_.wheel_s > 0 ? std::exp(-dt / config_.wheel_s) : 1.0;
  // A wrong heading turns the driven distance aside.
  const double aside = config_.wheel_s > 0 ? speed * error_[8] : 0.0;
  const std::array<double, 3> off{c * aside, -s * aside, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    error_[i] += (error_[3 + i] + off[i]) * dt;
    error_[3 + i] = keep * error_[3 + i] + acceleration[i] * dt +
                    velocity_walk_ * root * gaussian(seed_, kStreamInsOutage + 6 + i, index);
    error_[6 + i] += bias_[i] * dt + angle_walk_ * root * gaussian(seed_, kStreamInsOutage + 9 + i, index);
  }
  for (Axis& axis : axis_) propagate(axis, dt, config_.wheel_s > 0 ? speed : 0.0);
}

std::array<double, 9> OutageDrift::sigma() const {
  const auto of = [&](std::size_t axis, std::size_t state) { return std::sqrt(axis_[axis].P[state][state]); };
  // A heading error causes no error along the direction of motion. The claimed sigma does not separate the directions
  // of the level plane.
  const double level = std::hypot(of(0, kPlace), of(2, kPlaceByHeading));
  return {level,         level,         of(1, kPlace), of(0, kVelocity), of(0, kVelocity), of(1, kVelocity),
          of(0, kAngle), of(0, kAngle), of(2, kAngle)};
}

}  // namespace hueline::sim
