#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/scenario_rig.hpp"
#include "sim/scenario_scene.hpp"
#include "sim/surroundings.hpp"

/// The settings of a simulated drive. Each Config names its keys with their units and allowed ranges once, in `visit()`
/// (scenario_keys.cpp); `validate()`, the fingerprint of the cache, the YAML loader and docs/scenario.md use that list.
namespace hueline::sim {

/// The colours of the cars that a scene has by itself.
enum class CarPaints : std::uint8_t {
  Usual,          ///< nine colours
  BlackAndWhite,  ///< snow-white (reflectance 0.93) and black (0.012)
};

/// Which fences stand between road and pavements.
enum class Fence : std::uint8_t { None, Bars, ChainLink, Both };

/// The street. Its centre line starts along the drive's heading and bends once. s is the distance along the centre line
/// from the place where the vehicle starts, in m; lateral offsets count to the right.
struct StreetConfig {
  double road_width_m = 7.0;
  double pavement_width_m = 2.8;
  double kerb_height_m = 0.12;
  double curve_deg = 14.0;  ///< whole angle of the bend, clockwise (to the right); negative: to the left
  double curve_start_m = 70.0;
  double curve_length_m = 70.0;
  double zebra_at_m = 45.0;
  double tree_spacing_m = 16.0;
  double pole_spacing_m = 27.0;
  int leaves_per_tree = 1500;
  int parked_cars = 9;
  int moving_cars = 2;
  double moving_car_speed = 9.0;   ///< speed of the oncoming cars, m/s
  double sun_azimuth_deg = 170.0;  ///< clockwise from north
  double sun_elevation_deg = 54.0;
  /// Light of the sky as seen, in multiples of the clear sky's; 3 saturates a camera that exposes for the street.
  double sky_brightness = 1.0;
  bool furnished = true;  ///< false: there are ground and facades only
  CarPaints car_paints = CarPaints::Usual;
  double wetness = 0;  ///< 0: the ground is dry, 1: it is under water
  /// Light of sun and sky, on the scene and as seen, in multiples of a clear day's.
  double daylight = 1;
  double lamp_light = 0;     ///< light of a street lamp on a white surface 1 m below, in multiples of the sun's; 0: off
  double car_lights = 0;     ///< like DriveConfig::headlights, of every vehicle that moves; 0: off
  double glazed_fronts = 0;  ///< share of the houses whose ground floor has panes with a room behind
  double wire_mm = 0;        ///< diameter of the overhead wires; 0: there are none
  double stake_spacing_m = 0;  ///< distance between stakes on the pavements; 0: there are none
  Fence fence = Fence::None;

  void visit(Keys& keys);
};

/// A U-turn to the other side of the road. The vehicle halts before and after it.
struct TurnConfig {
  double at_m = 40;  ///< place of its centre along the centre line
  /// Duration of the U-turn.
  double for_s = 10;

  void visit(Keys& keys);
};

/// The motion: the vehicle stands, accelerates, holds its speed, brakes and stands. The body's origin is the IMU's
/// centre of navigation.
struct DriveConfig {
  double heading_deg = 37.0;  ///< heading of the street's first stretch, clockwise from north
  double lane_offset_m = 1.75;
  double stand_s = 1.0;  ///< time at the start, after the lead-in
  double accelerate_s = 5.0;
  double speed = 8.0;  ///< m/s
  double brake_s = 4.0;
  double halt_s = 1.0;        ///< time at the end
  double imu_height_m = 0.8;  ///< height of the body's origin above the road
  /// Light of the vehicle's two headlights on a white surface 10 m ahead, in multiples of the sun's; 0: off.
  double headlights = 0;
  /// Amplitudes of the suspension, which fade in with the speed.
  double roll_amplitude_deg = 0.35, pitch_amplitude_deg = 0.25, heave_amplitude_m = 0.012;
  /// In the order in which they come; between them the vehicle drives the road there and back.
  std::vector<TurnConfig> turns;

  void visit(Keys& keys);
};

/// The product class whose error budget the POS has.
enum class InsGrade : std::uint8_t { Custom, PosLv220, PosLv420, SpanCpt };

/// A time without satellites. `at_s` counts from the start of the sensors.
struct InsOutage {
  double at_s = 0, for_s = 1;

  void visit(Keys& keys);
};

/// The POS: rate, errors and outages.
struct InsConfig {
  int rate_hz = 200;               ///< must divide 1000
  double position_sigma_m = 0.01;  ///< sigma of a first-order Gauss-Markov error
  double velocity_sigma = 0.005;   ///< likewise, m/s
  double roll_pitch_sigma_deg = 0.007;
  double heading_sigma_deg = 0.02;
  double correlation_s = 90.0;
  double position_white_m = 0.0003;  ///< sigma of the white error that each sample has in addition
  double attitude_white_deg = 0.0004;
  /// Every grade but Custom sets the sigmas above and the five values below (ins_outage.cpp names its sources).
  InsGrade grade = InsGrade::Custom;
  double gyro_bias_deg_h = 0.3;  ///< residual bias after the filter; it makes the attitude drift in an outage
  double angle_random_walk_deg_sqrt_h = 0.02;
  double velocity_random_walk_sqrt_h = 0.02;  ///< m/s/sqrt(h)
  double accelerometer_bias_ug = 60;          ///< residual bias after the filter
  /// Time constant with which a wheel sensor pulls the velocity back in an outage; 0: there is no wheel sensor.
  double wheel_s = 0;
  double high_variance_m = 1.0;  ///< horizontal sigma from which the receiver reports INS_HIGH_VARIANCE
  std::vector<InsOutage> outages;

  void visit(Keys& keys);
};

/// Errors of the capture computer's stamp of a PPS edge against the true second: the latency of the interrupt.
struct PpsConfig {
  double jitter_us = 1.5;  ///< one sigma
  double spike_probability = 0.02;
  double spike_us = 40.0;  ///< largest delay of a spike

  void visit(Keys& keys);
};

/// Everything that decides a simulated drive. Equal scenarios give equal bytes.
struct Scenario {
  std::uint64_t seed = 1;
  double duration_s = 32.0;  ///< how long laser and camera run
  double lead_in_s = 4.0;    ///< time before that, in which only POS and PPS run and the vehicle stands; whole seconds
  bool noise = true;         ///< false: no random errors; the quantisation on the wire stays
  int start_gps_week = 2381;
  int start_time_of_week_s = 302403;  ///< with the default (and 18 leap seconds) a full UTC hour begins 15 s later
  /// Place of the road where s = 0.
  double origin_latitude_deg = 48.1372, origin_longitude_deg = 11.5755, origin_height_m = 565.0;
  SceneKind scene = SceneKind::Street;
  StreetConfig street;
  AlleyConfig alley;
  TrafficConfig traffic;
  TunnelConfig tunnel;
  TargetsConfig targets;
  GlassConfig glass;
  std::vector<RoadUserConfig> road_users;  ///< in addition to those of the scene
  DriveConfig drive;
  InsConfig ins;
  PpsConfig pps;
  LaserConfig laser;
  CameraConfig camera;
  WheelConfig wheel;
  /// Null: the painted sky. `visit()` leaves it out, because `text()` contains its identity.
  std::shared_ptr<const Surroundings> surroundings;
  /// Faults change what the devices send (faults/faulty_timeline.hpp), not what is rendered. `visit()`, `text()` and
  /// `fingerprint()` leave them out, so that drives that differ in their faults only share one folder of the cache.
  std::vector<FaultLine> faults;

  void visit(Keys& keys);

  GpsNs begin_gps_ns() const;          ///< time of the first PPS edge and the first POS solution
  GpsNs sensors_begin_gps_ns() const;  ///< time at which laser and camera start
  GpsNs sensors_end_gps_ns() const;
  /// One second after the sensors stop, so that every measurement lies between two POS solutions.
  GpsNs end_gps_ns() const;

  /// Returns the first key with a wrong value and what is wrong with it; empty if the scenario is valid.
  KeyError validate() const;
  /// Returns a line "key=value" for every key except the faults. Keys that are younger than the format (see
  /// scenario.cpp) appear only where they differ from their defaults.
  std::string text() const;
  /// Returns a hash (16 hex digits) over `text()` and the renderer's revision: the name of the drive's folder in the
  /// cache.
  std::string fingerprint() const;
};

}  // namespace hueline::sim
