#pragma once

#include <string>
#include <vector>

#include "sim/earth.hpp"
#include "sim/scenario.hpp"
#include "sim/vec3.hpp"

/// The true motion of the vehicle. The scene's local level ("enu") is tangent to WGS84 at the scenario's origin: x
/// east, y north, z up, in m.
namespace hueline::sim {

/// The centre line of the street: a straight, a bend, a straight. The curvature of the bend fades in and out by a
/// seventh-order blend, so the heading has three continuous derivatives. Immutable after construction; thread-safe.
class CentreLine {
 public:
  /// Builds the line for s = from_m .. to_m.
  CentreLine(const StreetConfig& street, double heading_deg, double from_m, double to_m);

  /// Returns the heading at `s`, rad, clockwise from north.
  double heading(double s) const;
  /// Returns d heading / ds at `s`, 1/m.
  double curvature(double s) const;
  /// Returns the point `lateral` m to the right of the centre line and `up` m above the road. The integral is good to
  /// 1e-12 m.
  Vec3 place(double s, double lateral, double up = 0) const;
  double from_m() const { return from_; }
  double to_m() const { return to_; }

 private:
  double heading0_, turn_, start_, length_, from_, to_;
  std::vector<Vec3> nodes_;  // a node every kStep metres from from_
};

/// The true pose and velocity at one time.
struct TrueState {
  Pose T_enu_body;
  Vec3 velocity_enu;
  /// Against the scene's level: right side down positive, nose up positive, clockwise from north.
  double roll = 0, pitch = 0, heading = 0;
};

/// The true motion of the body. It is analytic except for the integral of the centre line, and twice continuously
/// differentiable. Thread-safe.
class Motion {
 public:
  explicit Motion(const Scenario& scenario);

  /// Returns the true pose and velocity at time `t`.
  TrueState state(GpsNs t) const;
  Pose T_enu_body(GpsNs t) const { return state(t).T_enu_body; }
  /// Returns the distance along the centre line, m; 0 before the start. It decreases while the vehicle drives back.
  double along(GpsNs t) const;
  /// Returns the distance over ground since the start of a point `lateral_m` to the right of the body's origin, m.
  double way(GpsNs t, double lateral_m) const;
  /// Returns the heading without wrapping, rad: the difference of two values is the angle by which the vehicle turned
  /// between them.
  double turned_heading(GpsNs t) const;
  /// Returns the largest value of `along()`.
  double length_m() const { return length_; }
  const CentreLine& centre_line() const { return line_; }

 private:
  /// A stretch of road from halt to halt, and the turn after it.
  struct Leg {
    double start_s = 0, from_m = 0, cruise_s = 0;
    double direction = 1;  ///< 1: along the centre line, -1: against it
    double turned = 0;     ///< change of heading by all turns before this stretch
    double turn_s = 0;     ///< duration of the turn; 0: no turn follows
    double end_s(const DriveConfig& drive) const { return start_s + drive.accelerate_s + cruise_s + drive.brake_s; }
  };
  struct Place {
    double s = 0, lateral = 0;  ///< place on the road
    double v = 0, a = 0;        ///< speed and acceleration without the effect of a bend; in a turn, over ground
    double turn = 0;            ///< angle of the turn that is under way
    const Leg* leg = nullptr;
  };
  static std::vector<Leg> legs(const Scenario& scenario);
  static double longest(const DriveConfig& drive, const std::vector<Leg>& legs);
  Place place(GpsNs t) const;
  double heading(const Place& place) const;

  DriveConfig drive_;
  GpsNs start_;
  std::vector<Leg> legs_;
  double length_;
  CentreLine line_;
  std::array<double, 9> phase_{};
};

/// Returns which entry of `drive.turns` cannot be driven and why, as a sentence that names the key; empty if all can be
/// driven.
std::string check_turns(const Scenario& scenario);

/// Returns R_enu_body of an attitude. It is written element by element as the transpose of the matrix printed in step 2
/// of the sphere method.
Mat3 R_enu_body(double roll, double pitch, double heading);
/// Returns roll, pitch and heading of a rotation, the heading in [0, 2 pi): the inverse of `R_enu_body()`.
std::array<double, 3> attitude_of(const Mat3& R_enu_body);

}  // namespace hueline::sim
