#include "sim/vehicle.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "sim/noise.hpp"

namespace hueline::sim {
namespace {

constexpr double kStep = 0.5;  // distance between nodes of the centre line, m

/// A blend from 0 to 1 over x = 0 .. 1 whose first three derivatives vanish at both ends, with its first and second
/// derivative and its integral.
double blend(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x)));
}
double blend_slope(double x) {
  if (x <= 0 || x >= 1) return 0;
  const double y = x * (1 - x);
  return 140 * y * y * y;
}
double blend_bend(double x) {
  if (x <= 0 || x >= 1) return 0;
  const double y = x * (1 - x);
  return 420 * y * y * (1 - 2 * x);
}
double blend_integral(double x) {
  const double over = std::max(0.0, x - 1.0);
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * x * x * (7 + x * (-14 + x * (10 - 2.5 * x))) + over;
}

// Gauss-Legendre quadrature with 8 points on -1 .. 1.
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
  return nodes_[static_cast<std::size_t>(index)] +
         Vec3{e * half + lateral * std::cos(h), n * half - lateral * std::sin(h), up};
}

namespace {

constexpr double kSmallestTurnRadius_m = 2.5;
constexpr double kStreetBegins_m = -30;  // the scenes have houses from there on

/// Returns the distance along the line from the halt before turn `i` to that turn; negative if the turn lies behind.
double ahead_m(const DriveConfig& drive, std::size_t i) {
  return (i % 2 == 0 ? 1 : -1) * (drive.turns[i].at_m - (i == 0 ? 0 : drive.turns[i - 1].at_m));
}
/// Returns the length of a stretch that is driven at full speed for `cruise_s`.
double stretch_m(const DriveConfig& drive, double cruise_s) {
  return drive.speed * (cruise_s + 0.5 * (drive.accelerate_s + drive.brake_s));
}
double cruise_seconds(const DriveConfig& drive, std::size_t turn) {
  return ahead_m(drive, turn) / drive.speed - 0.5 * (drive.accelerate_s + drive.brake_s);
}
/// Returns the time at full speed that the duration leaves for the last stretch.
double last_cruise_seconds(const Scenario& c) {
  double left = c.duration_s - c.drive.stand_s - c.drive.accelerate_s - c.drive.brake_s - c.drive.halt_s;
  for (std::size_t i = 0; i < c.drive.turns.size(); ++i)
    left -= c.drive.accelerate_s + cruise_seconds(c.drive, i) + c.drive.brake_s + c.drive.turns[i].for_s;
  return left;
}

std::string text_of(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", x);
  return text;
}

}  // namespace

std::string check_turns(const Scenario& c) {
  const DriveConfig& drive = c.drive;
  if (drive.turns.empty()) return {};
  const double radius = std::abs(drive.lane_offset_m);
  if (radius < kSmallestTurnRadius_m)
    return "drive.lane_offset_m is the radius of drive.turns: at least " + text_of(kSmallestTurnRadius_m) +
           " m to either side";
  for (std::size_t i = 0; i < drive.turns.size(); ++i) {
    const std::string key = "drive.turns[" + std::to_string(i) + "].at_m";
    if (ahead_m(drive, i) < stretch_m(drive, 0))
      return key + " must lie " + text_of(stretch_m(drive, 0)) + " m or more " + (i % 2 == 0 ? "beyond " : "before ") +
             (i == 0 ? "the start" : "the last turn") + ": drive.speed is reached and left in between";
    const double at = drive.turns[i].at_m;
    if (c.street.curve_deg != 0 && at + radius > c.street.curve_start_m &&
        at - radius < c.street.curve_start_m + c.street.curve_length_m)
      return key + " must lie on a straight, at least drive.lane_offset_m away from the bend";
  }
  const double left = last_cruise_seconds(c);
  if (left < 0)
    return "duration_s is too short for drive.turns: at least " + text_of(std::ceil(c.duration_s - left)) + " s";
  const double beyond = kStreetBegins_m - (drive.turns.back().at_m - stretch_m(drive, left));
  if (drive.turns.size() % 2 == 1 && beyond > 0)
    return "duration_s is too long for drive.turns: on the way back the vehicle passes the beginning of the street; at "
           "most " +
           text_of(std::floor(c.duration_s - beyond / drive.speed)) + " s";
  return {};
}

std::vector<Motion::Leg> Motion::legs(const Scenario& c) {
  const DriveConfig& drive = c.drive;
  std::vector<Leg> out(1);
  out[0].start_s = drive.stand_s;
  for (std::size_t i = 0; i < drive.turns.size(); ++i) {
    Leg& leg = out.back();
    leg.cruise_s = cruise_seconds(drive, i);
    leg.turn_s = drive.turns[i].for_s;
    Leg next;
    next.start_s = leg.end_s(drive) + leg.turn_s;
    next.from_m = drive.turns[i].at_m;
    next.direction = -leg.direction;
    next.turned = leg.turned - std::copysign(kPi, drive.lane_offset_m);
    out.push_back(next);
  }
  out.back().cruise_s = std::max(0.0, last_cruise_seconds(c));
  return out;
}

double Motion::longest(const DriveConfig& drive, const std::vector<Leg>& legs) {
  double out = 0;
  for (const Leg& leg : legs)
    out = std::max({out, leg.from_m, leg.from_m + leg.direction * stretch_m(drive, leg.cruise_s)});
  return legs.size() == 1 ? out : out + std::abs(drive.lane_offset_m);
}

Motion::Motion(const Scenario& c)
    : drive_(c.drive),
      start_(c.sensors_begin_gps_ns()),
      legs_(legs(c)),
      length_(longest(c.drive, legs_)),
      line_(c.street, c.drive.heading_deg, -70.0, length_ + 90.0) {
  for (std::size_t i = 0; i < phase_.size(); ++i) phase_[i] = 2 * kPi * uniform(c.seed, kStreamVibration, i);
}

Motion::Place Motion::place(GpsNs gps_ns) const {
  const double t = static_cast<double>(gps_ns - start_) * 1e-9;
  const double ta = drive_.accelerate_s, tb = drive_.brake_s, v = drive_.speed;
  Place out;
  out.leg = legs_.data();
  while (out.leg != &legs_.back() && t >= out.leg[1].start_s) ++out.leg;
  const Leg& leg = *out.leg;
  const double x = (t - leg.start_s) / ta;
  const double y = (t - leg.start_s - ta - leg.cruise_s) / tb;
  out.s = leg.from_m + leg.direction * (v * (ta * blend_integral(x) - tb * blend_integral(y)));
  out.lateral = leg.direction * drive_.lane_offset_m;
  out.v = v * (blend(x) - blend(y));
  out.a = v * (blend_slope(x) / ta - blend_slope(y) / tb);
  if (leg.turn_s > 0 && t > leg.end_s(drive_)) {
    const double radius = std::abs(drive_.lane_offset_m), z = (t - leg.end_s(drive_)) / leg.turn_s;
    out.turn = kPi * blend(z);
    out.s += leg.direction * radius * std::sin(out.turn);
    out.lateral *= std::cos(out.turn);
    out.v = radius * kPi * blend_slope(z) / leg.turn_s;
    out.a = radius * kPi * blend_bend(z) / (leg.turn_s * leg.turn_s);
  }
  return out;
}

double Motion::along(GpsNs t) const { return place(t).s; }

double Motion::heading(const Place& p) const {
  return line_.heading(p.s) + (p.leg->turned - std::copysign(p.turn, drive_.lane_offset_m));
}

double Motion::turned_heading(GpsNs t) const { return heading(place(t)); }

double Motion::way(GpsNs t, double lateral_m) const {
  const double offset = drive_.lane_offset_m + lateral_m;
  // The length along the centre line, less what a point farther inside the bend saves: lateral offset times change of
  // heading, which is exact.
  const auto along_road = [&](const Leg& leg, double to_m) {
    return leg.direction * (to_m - leg.from_m) - offset * (line_.heading(to_m) - line_.heading(leg.from_m));
  };
  const auto in_turn = [&](double angle) { return (drive_.lane_offset_m < 0 ? -offset : offset) * angle; };
  const Place now = place(t);
  double before = 0;
  for (const Leg* leg = legs_.data(); leg != now.leg; ++leg) before += along_road(*leg, leg[1].from_m) + in_turn(kPi);
  const bool is_turning = now.turn > 0;
  return before + along_road(*now.leg, is_turning ? now.leg[1].from_m : now.s) + (is_turning ? in_turn(now.turn) : 0.0);
}

TrueState Motion::state(GpsNs gps_ns) const {
  const double t = static_cast<double>(gps_ns - start_) * 1e-9;
  const Place p = place(gps_ns);
  const double fade = p.v / drive_.speed;
  // The motions of a car on its springs, at incommensurate frequencies below 2.5 Hz.
  static constexpr std::array<double, 9> kHertz{0.71, 1.37, 2.23, 0.83, 1.61, 2.41, 0.93, 1.49, 2.11};
  static constexpr std::array<double, 3> kShare{0.6, 0.3, 0.1};
  std::array<double, 3> sway{}, sway_rate{};
  for (std::size_t i = 0; i < 9; ++i) {
    const double w = 2 * kPi * kHertz[i];
    sway[i / 3] += kShare[i % 3] * std::sin(w * t + phase_[i]);
    sway_rate[i / 3] += kShare[i % 3] * w * std::cos(w * t + phase_[i]);
  }
  TrueState out;
  const double h = heading(p);
  out.heading = h - 2 * kPi * std::floor(h / (2 * kPi));
  out.roll = radians(drive_.roll_amplitude_deg) * fade * sway[0];
  // The nose lifts under acceleration, by half a degree at 2 m/s2.
  out.pitch = radians(drive_.pitch_amplitude_deg) * (fade * sway[1] + p.a);
  const double up = drive_.imu_height_m + drive_.heave_amplitude_m * fade * sway[2];
  out.T_enu_body = {R_enu_body(out.roll, out.pitch, out.heading), line_.place(p.s, p.lateral, up)};
  const double ground_speed = p.v * (1 - line_.curvature(p.s) * p.lateral);
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
