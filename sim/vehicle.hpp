#pragma once

#include <string>
#include <vector>

#include "sim/earth.hpp"
#include "sim/scenario.hpp"
#include "sim/vec3.hpp"

/// Where the vehicle truly is. Local level ("enu"): tangent to WGS84 at the scenario's origin, x east, y north, z up,
/// m.
namespace hueline::sim {

/// Centre line of the street: a straight, one bend whose curvature fades in and out (seventh-order blend: three
/// continuous derivatives of the heading), a straight. Immutable after construction; thread-safe.
class CentreLine {
 public:
  /// Covers s = from_m .. to_m.
  CentreLine(const StreetConfig& street, double heading_deg, double from_m, double to_m);

  /// rad, clockwise from north.
  double heading(double s) const;
  double curvature(double s) const;  ///< d heading / ds, 1/m
  /// `lateral` m to the right of the centre line, `up` above the road. Integrated to 1e-12 m.
  Vec3 place(double s, double lateral, double up = 0) const;
  double from_m() const { return from_; }
  double to_m() const { return to_; }

 private:
  double heading0_, turn_, start_, length_, from_, to_;
  std::vector<Vec3> nodes_;  // every kStep metres from from_
};

/// True pose and velocity at an instant.
struct TrueState {
  Pose T_enu_body;
  Vec3 velocity_enu;
  double roll = 0, pitch = 0,
         heading = 0;  ///< against the scene's level; right side down +, nose up +, clockwise from north
};

/// Body's true motion, analytic but for the centre line's integral. Twice continuously differentiable. Thread-safe.
class Motion {
 public:
  explicit Motion(const Scenario& scenario);

  TrueState state(GpsNs t) const;
  Pose T_enu_body(GpsNs t) const { return state(t).T_enu_body; }
  /// Metres along the centre line; 0 before the start. Falls on a way back.
  double along(GpsNs t) const;
  /// Way over ground since the start of a point `lateral_m` to the right of the body's origin, m.
  double way(GpsNs t, double lateral_m) const;
  /// Heading without a wrap: what the vehicle turned since the start is the difference, rad.
  double turned_heading(GpsNs t) const;
  /// The largest along().
  double length_m() const { return length_; }
  const CentreLine& centre_line() const { return line_; }

 private:
  /// A stretch along the road from halt to halt, and the turn after it.
  struct Leg {
    double start_s = 0, from_m = 0, cruise_s = 0;
    double direction = 1;  ///< along the centre line, or against it
    double turned = 0;     ///< heading, by all turns before it
    double turn_s = 0;     ///< 0: no turn follows
    double end_s(const DriveConfig& drive) const { return start_s + drive.accelerate_s + cruise_s + drive.brake_s; }
  };
  struct Place {
    double s = 0, lateral = 0;  ///< on the road
    double v = 0, a = 0;        ///< without a bend's share; over ground in a turn
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

/// What of `drive.turns` cannot be driven, as a sentence that names the key; empty when all can.
std::string check_turns(const Scenario& scenario);

/// R_enu_body from roll, pitch, heading, element by element as the transpose of the printed matrix of the sphere
/// method's step 2.
Mat3 R_enu_body(double roll, double pitch, double heading);
/// Its inverse: {roll, pitch, heading}, heading in [0, 2 pi).
std::array<double, 3> attitude_of(const Mat3& R_enu_body);

}  // namespace hueline::sim
