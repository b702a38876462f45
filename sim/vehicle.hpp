#pragma once

#include <vector>

#include "sim/earth.hpp"
#include "sim/scenario.hpp"
#include "sim/vec3.hpp"

/// Where the vehicle truly is. Local level ("enu"): tangent to WGS84 at the scenario's origin, x east, y north, z up, m.
namespace hueline::sim {

/// Centre line of the street: a straight, one bend whose curvature fades in and out (seventh-order blend: three continuous
/// derivatives of the heading), a straight. Immutable after construction; thread-safe.
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
  double roll = 0, pitch = 0, heading = 0;  ///< against the scene's level; right side down +, nose up +, clockwise from north
};

/// Body's true motion, analytic but for the centre line's integral. Twice continuously differentiable. Thread-safe.
class Motion {
 public:
  explicit Motion(const Scenario& scenario);

  TrueState state(GpsNs t) const;
  Pose T_enu_body(GpsNs t) const { return state(t).T_enu_body; }
  /// Metres along the centre line; 0 before the start.
  double along(GpsNs t) const;
  double length_m() const { return length_; }
  const CentreLine& centre_line() const { return line_; }

 private:
  struct Profile {
    double s = 0, v = 0, a = 0;
  };
  Profile profile(double seconds) const;

  DriveConfig drive_;
  GpsNs start_;
  double cruise_s_, length_;
  CentreLine line_;
  std::array<double, 9> phase_{};
};

/// R_enu_body from roll, pitch, heading, element by element as the transpose of the printed matrix of the sphere method's step 2.
Mat3 R_enu_body(double roll, double pitch, double heading);
/// Its inverse: {roll, pitch, heading}, heading in [0, 2 pi).
std::array<double, 3> attitude_of(const Mat3& R_enu_body);

}  // namespace hueline::sim
