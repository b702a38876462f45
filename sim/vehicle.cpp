#include "sim/vehicle.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace hueline::sim {
namespace {

constexpr double kStep = 0.5;  // m between nodes of the centre line

/// 0 to 1 over x = 0 to 1 with three vanishing derivatives at both ends; with its integral and slope.
double blend(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x)));
}
double blend_slope(double x) {
  if (x <= 0 || x >= 1) return 0;
  const double y = x * (1 - x);
  return 140 * y * y * y;
}
double blend_integral(double x) {
  const double over = std::max(0.0, x - 1.0);
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * x * x * (7 + x * (-14 + x * (10 - 2.5 * x))) + over;
}

// Gauss-Legendre, 8 points on -1 .. 1.
constexpr std::array<double, 4> kNode{0.18343464249564980494, 0.52553240991632898582, 0.79666647741362673959,
                                      0.96028985649753623168};
constexpr std::array<double, 4> kWeight{0.36268378337836198297, 0.31370664587788728734, 0.22238103445337447054,
                                        0.10122853629037625915};

}  // namespace

CentreLine::CentreLine(const StreetConfig& street, double heading_deg, double from_m, double to_m)
    : heading0_(radians(heading_deg)),
      turn_(radians(street.curve_deg)),
      start_(street.curve_start_m),
      length_(street.curve_length_m),
      from_(from_m),
      to_(to_m) {
  const auto steps = static_cast<std::size_t>(std::ceil((to_ - from_) / kStep)) + 1;
  nodes_.assign(1, Vec3{});
  Vec3 at_zero;
  for (std::size_t i = 0; i < steps; ++i) {
    const double a = from_ + kStep * static_cast<double>(i);
    double e = 0, n = 0;
    for (std::size_t k = 0; k < 4; ++k)
      for (const double sign : {-1.0, 1.0}) {
        const double h = heading(a + kStep / 2 * (1 + sign * kNode[k]));
        e += kWeight[k] * std::sin(h);
        n += kWeight[k] * std::cos(h);
      }
    nodes_.push_back(nodes_.back() + Vec3{e * kStep / 2, n * kStep / 2, 0});
  }
  at_zero = place(0, 0);
  for (Vec3& p : nodes_) p = p - at_zero;
}

double CentreLine::heading(double s) const { return heading0_ + turn_ * blend((s - start_) / length_); }
double CentreLine::curvature(double s) const { return turn_ / length_ * blend_slope((s - start_) / length_); }

Vec3 CentreLine::place(double s, double lateral, double up) const {
  const double index = std::clamp(std::floor((s - from_) / kStep), 0.0, static_cast<double>(nodes_.size() - 1));
  const double a = from_ + kStep * index, half = (s - a) / 2;
  double e = 0, n = 0;
  for (std::size_t k = 0; k < 4; ++k)
    for (const double sign : {-1.0, 1.0}) {
      const double h = heading(a + half * (1 + sign * kNode[k]));
      e += kWeight[k] * std::sin(h);
      n += kWeight[k] * std::cos(h);
    }
  const double h = heading(s);
  return nodes_[static_cast<std::size_t>(index)] + Vec3{e * half + lateral * std::cos(h), n * half - lateral * std::sin(h), up};
}

namespace {
double cruise_seconds(const Scenario& c) {
  return std::max(0.0, c.duration_s - c.drive.stand_s - c.drive.accelerate_s - c.drive.brake_s - c.drive.halt_s);
}
double drive_length(const Scenario& c) {
  return c.drive.speed * (cruise_seconds(c) + 0.5 * (c.drive.accelerate_s + c.drive.brake_s));
}
}  // namespace

Motion::Motion(const Scenario& c)
    : drive_(c.drive),
      start_(c.sensors_begin_gps_ns()),
      cruise_s_(cruise_seconds(c)),
      length_(drive_length(c)),
      line_(c.street, c.drive.heading_deg, -70.0, drive_length(c) + 90.0) {
  for (std::size_t i = 0; i < phase_.size(); ++i) phase_[i] = 2 * kPi * uniform(c.seed, kStreamVibration, i);
}

Motion::Profile Motion::profile(double t) const {
  const double ta = drive_.accelerate_s, tb = drive_.brake_s, v = drive_.speed;
  const double x = (t - drive_.stand_s) / ta;
  const double y = (t - drive_.stand_s - ta - cruise_s_) / tb;
  return {v * (ta * blend_integral(x) - tb * blend_integral(y)), v * (blend(x) - blend(y)),
          v * (blend_slope(x) / ta - blend_slope(y) / tb)};
}

double Motion::along(GpsNs t) const { return profile(static_cast<double>(t - start_) * 1e-9).s; }

TrueState Motion::state(GpsNs gps_ns) const {
  const double t = static_cast<double>(gps_ns - start_) * 1e-9;
  const Profile p = profile(t);
  const double fade = p.v / drive_.speed;
  // Body modes of a car on its springs: incommensurate frequencies below 2.5 Hz.
  static constexpr std::array<double, 9> kHertz{0.71, 1.37, 2.23, 0.83, 1.61, 2.41, 0.93, 1.49, 2.11};
  static constexpr std::array<double, 3> kShare{0.6, 0.3, 0.1};
  std::array<double, 3> sway{}, sway_rate{};
  for (std::size_t i = 0; i < 9; ++i) {
    const double w = 2 * kPi * kHertz[i];
    sway[i / 3] += kShare[i % 3] * std::sin(w * t + phase_[i]);
    sway_rate[i / 3] += kShare[i % 3] * w * std::cos(w * t + phase_[i]);
  }
  TrueState out;
  const double h = line_.heading(p.s);
  out.heading = h - 2 * kPi * std::floor(h / (2 * kPi));
  out.roll = radians(drive_.roll_amplitude_deg) * fade * sway[0];
  // The nose lifts under acceleration: half a degree at 2 m/s2.
  out.pitch = radians(drive_.pitch_amplitude_deg) * (fade * sway[1] + p.a);
  const double up = drive_.imu_height_m + drive_.heave_amplitude_m * fade * sway[2];
  out.T_enu_body = {R_enu_body(out.roll, out.pitch, out.heading), line_.place(p.s, drive_.lane_offset_m, up)};
  const double ground_speed = p.v * (1 - line_.curvature(p.s) * drive_.lane_offset_m);
  out.velocity_enu = {ground_speed * std::sin(h), ground_speed * std::cos(h),
                      drive_.heave_amplitude_m * (fade * sway_rate[2] + p.a / drive_.speed * sway[2])};
  return out;
}

Mat3 R_enu_body(double phi, double omega, double kappa) {
  const double sp = std::sin(phi), cp = std::cos(phi), so = std::sin(omega), co = std::cos(omega);
  const double sk = std::sin(kappa), ck = std::cos(kappa);
  return transposed({{cp * ck + sp * so * sk, -cp * sk + sp * so * ck, -sp * co,  //
                      co * sk, co * ck, so,                                       //
                      sp * ck - cp * so * sk, -sp * sk - cp * so * ck, cp * co}});
}

std::array<double, 3> attitude_of(const Mat3& R) {
  const double pitch = std::atan2(R.m[7], std::hypot(R.m[6], R.m[8]));
  const double roll = std::atan2(-R.m[6], R.m[8]);
  double heading = std::atan2(R.m[1], R.m[4]);
  if (heading < 0) heading += 2 * kPi;
  return {roll, pitch, heading};
}

}  // namespace hueline::sim
