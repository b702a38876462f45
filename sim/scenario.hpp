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

/// Everything that decides a simulated drive. Two equal scenarios give the same bytes. Each Config names its keys,
/// units and allowed ranges once, in visit() (scenario_keys.cpp): validate(), the cache's fingerprint, the YAML loader
/// and docs/scenario.md go by that list.
namespace hueline::sim {

/// The street: its centre line starts along the drive's heading and bends once. s counts metres along the centre line
/// from where the vehicle starts; lateral offsets count to the right.
struct StreetConfig {
  double road_width_m = 7.0;
  double pavement_width_m = 2.8;
  double kerb_height_m = 0.12;
  double curve_deg = 14.0;  ///< clockwise (to the right) in all; negative: to the left
  double curve_start_m = 70.0;
  double curve_length_m = 70.0;
  double zebra_at_m = 45.0;
  double tree_spacing_m = 16.0;
  double pole_spacing_m = 27.0;
  int leaves_per_tree = 1500;
  int parked_cars = 9;
  int moving_cars = 2;
  double moving_car_speed = 9.0;   ///< m/s, oncoming
  double sun_azimuth_deg = 170.0;  ///< clockwise from north
  double sun_elevation_deg = 54.0;
  double sky_brightness =
      1.0;                ///< times the clear sky's light, as seen: 3 saturates a camera that exposes for the street
  bool furnished = true;  ///< false: ground and facades alone

  void visit(Keys& keys);
};

/// A U-turn around a place of the centre line, to the other side of the road; the vehicle comes to a halt before and
/// after it.
struct TurnConfig {
  double at_m = 40;  ///< of its centre, along the centre line
  double for_s = 10;

  void visit(Keys& keys);
};

/// The motion: stand, speed up, hold, brake, stand. The body's origin is the IMU's centre of navigation.
struct DriveConfig {
  double heading_deg = 37.0;  ///< of the street's first stretch, clockwise from north
  double lane_offset_m = 1.75;
  double stand_s = 1.0;  ///< at the start, after the lead-in
  double accelerate_s = 5.0;
  double speed = 8.0;  ///< m/s
  double brake_s = 4.0;
  double halt_s = 1.0;        ///< at the end
  double imu_height_m = 0.8;  ///< of the body origin above the road
  double roll_amplitude_deg = 0.35, pitch_amplitude_deg = 0.25,
         heave_amplitude_m = 0.012;  ///< suspension, fades in with the speed
  std::vector<TurnConfig> turns;  ///< in the order in which they come; between them the road is driven there and back

  void visit(Keys& keys);
};

/// Whose error budget the POS has.
enum class InsGrade : std::uint8_t { Custom, PosLv220, PosLv420, SpanCpt };

/// A time without satellites, s after the sensors' start.
struct InsOutage {
  double at_s = 0, for_s = 1;

  void visit(Keys& keys);
};

struct InsConfig {
  int rate_hz = 200;               ///< a divisor of 1000
  double position_sigma_m = 0.01;  ///< first-order Gauss-Markov
  double velocity_sigma = 0.005;   ///< m/s
  double roll_pitch_sigma_deg = 0.007;
  double heading_sigma_deg = 0.02;
  double correlation_s = 90.0;
  double position_white_m = 0.0003;  ///< on each sample, on top
  double attitude_white_deg = 0.0004;
  InsGrade grade =
      InsGrade::Custom;  ///< another one sets the sigmas above and the five below (ins_outage.cpp names its sources)
  double gyro_bias_deg_h = 0.3;  ///< what the filter leaves of it; grows into the attitude of an outage
  double angle_random_walk_deg_sqrt_h = 0.02;
  double velocity_random_walk_sqrt_h = 0.02;  ///< m/s/sqrt(h)
  double accelerometer_bias_ug = 60;          ///< what the filter leaves of it
  double wheel_s = 0;  ///< time within which a wheel sensor pulls velocity back in an outage; 0: none is there
  double high_variance_m = 1.0;  ///< horizontal sigma from which the receiver says INS_HIGH_VARIANCE
  std::vector<InsOutage> outages;

  void visit(Keys& keys);
};

/// Stamp of an edge by the capture computer against the true second: interrupt latency.
struct PpsConfig {
  double jitter_us = 1.5;  ///< sigma
  double spike_probability = 0.02;
  double spike_us = 40.0;  ///< largest lateness of a spike

  void visit(Keys& keys);
};

struct Scenario {
  std::uint64_t seed = 1;
  double duration_s = 32.0;  ///< laser and camera run this long ...
  double lead_in_s = 4.0;    ///< ... after this, in which only POS and PPS run and the vehicle stands; whole seconds
  bool noise = true;         ///< master switch of every random error; quantisation on the wire stays
  int start_gps_week = 2381;
  int start_time_of_week_s = 302403;  ///< the default crosses a full UTC hour 15 s in: 18 leap seconds
  double origin_latitude_deg = 48.1372, origin_longitude_deg = 11.5755,
         origin_height_m = 565.0;  ///< of the road where s = 0
  SceneKind scene = SceneKind::Street;
  StreetConfig street;
  AlleyConfig alley;
  TrafficConfig traffic;
  TunnelConfig tunnel;
  TargetsConfig targets;
  DriveConfig drive;
  InsConfig ins;
  PpsConfig pps;
  LaserConfig laser;
  CameraConfig camera;
  WheelConfig wheel;
  /// Null: the painted sky. Not in visit(): its identity is in text().
  std::shared_ptr<const Surroundings> surroundings;
  /// Spoil what the devices send (faults/faulty_timeline.hpp), not what is rendered: not in visit(), text() and
  /// fingerprint(), so that drives that differ in their faults alone share one folder.
  std::vector<FaultLine> faults;

  void visit(Keys& keys);

  GpsNs begin_gps_ns() const;          ///< first PPS edge and INS sample
  GpsNs sensors_begin_gps_ns() const;  ///< laser and camera start
  GpsNs sensors_end_gps_ns() const;
  GpsNs end_gps_ns() const;  ///< one second after the sensors stop, so that every measurement lies between POS samples

  KeyError validate() const;
  /// A line "key=value" for every key but the faults; keys younger than the format (see scenario.cpp) only where they
  /// differ from their default.
  std::string text() const;
  /// 16 hex digits over text() and the renderer's revision: the name of its folder in the cache.
  std::string fingerprint() const;
};

}  // namespace hueline::sim
