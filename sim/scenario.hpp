#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/scenario_rig.hpp"
#include "sim/scenario_scene.hpp"
#include "sim/surroundings.hpp"

/// Everything that decides a simulated drive. Two equal scenarios give the same bytes. Each Config names its keys, units and
/// allowed ranges once, in visit(): validate(), the cache's fingerprint and the YAML loader all walk the same list.
namespace hueline::sim {

/// The street: its centre line starts along the drive's heading and bends once. s counts metres along the centre line from
/// where the vehicle starts; lateral offsets count to the right.
struct StreetConfig {
  double road_width_m = 7.0;
  double pavement_width_m = 2.8;
  double kerb_height_m = 0.12;
  double curve_deg = 14.0;      ///< clockwise (to the right) in all; negative: to the left
  double curve_start_m = 70.0;
  double curve_length_m = 70.0;
  double zebra_at_m = 45.0;
  double tree_spacing_m = 16.0;
  double pole_spacing_m = 27.0;
  int leaves_per_tree = 1500;
  int parked_cars = 9;
  int moving_cars = 2;
  double moving_car_speed = 9.0;  ///< m/s, oncoming
  double sun_azimuth_deg = 170.0;  ///< clockwise from north
  double sun_elevation_deg = 54.0;
  double sky_brightness = 1.0;     ///< times the clear sky's light, as seen: 3 saturates a camera that exposes for the street
  bool furnished = true;           ///< false: ground and facades alone

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("road_width_m", c.road_width_m, 5, 30);
    v("pavement_width_m", c.pavement_width_m, 1, 20);
    v("kerb_height_m", c.kerb_height_m, 0.02, 0.3);
    v("curve_deg", c.curve_deg, -60, 60);
    v("curve_start_m", c.curve_start_m, 0, 10000);
    v("curve_length_m", c.curve_length_m, 20, 10000);
    v("zebra_at_m", c.zebra_at_m, -40, 10000);
    v("tree_spacing_m", c.tree_spacing_m, 5, 1000);
    v("pole_spacing_m", c.pole_spacing_m, 5, 1000);
    v("leaves_per_tree", c.leaves_per_tree, 0, 20000);
    v("parked_cars", c.parked_cars, 0, 200);
    v("moving_cars", c.moving_cars, 0, 20);
    v("moving_car_speed", c.moving_car_speed, 0, 30);
    v("sun_azimuth_deg", c.sun_azimuth_deg, 0, 360);
    v("sun_elevation_deg", c.sun_elevation_deg, 5, 90);
    v("sky_brightness", c.sky_brightness, 0.1, 20);
    v("furnished", c.furnished);
  }
};

/// Stand, speed up, hold, brake, stand. Body origin: the IMU's centre of navigation.
/// A U-turn around a place of the centre line, to the other side of the road; the vehicle comes to a halt before and after it.
struct TurnConfig {
  double at_m = 40;  ///< of its centre, along the centre line
  double for_s = 10;

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("at_m", c.at_m, -40, 10000);
    v("for_s", c.for_s, 4, 60);
  }
};

struct DriveConfig {
  double heading_deg = 37.0;  ///< of the street's first stretch, clockwise from north
  double lane_offset_m = 1.75;
  double stand_s = 1.0;       ///< at the start, after the lead-in
  double accelerate_s = 5.0;
  double speed = 8.0;         ///< m/s
  double brake_s = 4.0;
  double halt_s = 1.0;        ///< at the end
  double imu_height_m = 0.8;  ///< of the body origin above the road
  double roll_amplitude_deg = 0.35, pitch_amplitude_deg = 0.25, heave_amplitude_m = 0.012;  ///< suspension, fades in with the speed
  std::vector<TurnConfig> turns;  ///< in the order in which they come; between them the road is driven there and back

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("heading_deg", c.heading_deg, 0, 360);
    v("lane_offset_m", c.lane_offset_m, -10, 10);
    v("stand_s", c.stand_s, 0, 600);
    v("accelerate_s", c.accelerate_s, 0.5, 60);
    v("speed", c.speed, 0.1, 30);
    v("brake_s", c.brake_s, 0.5, 60);
    v("halt_s", c.halt_s, 0, 600);
    v("imu_height_m", c.imu_height_m, 0.2, 3);
    v("roll_amplitude_deg", c.roll_amplitude_deg, 0, 5);
    v("pitch_amplitude_deg", c.pitch_amplitude_deg, 0, 5);
    v("heave_amplitude_m", c.heave_amplitude_m, 0, 0.1);
    v("turns", c.turns);
  }
};

/// Whose error budget the POS has.
enum class InsGrade : std::uint8_t { Custom, PosLv220, PosLv420, SpanCpt };

/// A time without satellites, s after the sensors' start.
struct InsOutage {
  double at_s = 0, for_s = 1;

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("at_s", c.at_s, 0, 3600);
    v("for_s", c.for_s, 0.01, 3600);
  }
};

struct InsConfig {
  int rate_hz = 200;                    ///< a divisor of 1000
  double position_sigma_m = 0.01;       ///< first-order Gauss-Markov
  double velocity_sigma = 0.005;        ///< m/s
  double roll_pitch_sigma_deg = 0.007;
  double heading_sigma_deg = 0.02;
  double correlation_s = 90.0;
  double position_white_m = 0.0003;     ///< on each sample, on top
  double attitude_white_deg = 0.0004;
  InsGrade grade = InsGrade::Custom;    ///< another one sets the sigmas above and the five below (ins_outage.cpp names its sources)
  double gyro_bias_deg_h = 0.3;         ///< what the filter leaves of it; grows into the attitude of an outage
  double angle_random_walk_deg_sqrt_h = 0.02;
  double velocity_random_walk_sqrt_h = 0.02;  ///< m/s/sqrt(h)
  double accelerometer_bias_ug = 60;    ///< what the filter leaves of it
  double wheel_s = 0;                   ///< time within which a wheel sensor pulls velocity back in an outage; 0: none is there
  double high_variance_m = 1.0;         ///< horizontal sigma from which the receiver says INS_HIGH_VARIANCE
  std::vector<InsOutage> outages;

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("rate_hz", c.rate_hz, 1, 1000);
    v("position_sigma_m", c.position_sigma_m, 0, 10);
    v("velocity_sigma", c.velocity_sigma, 0, 10);
    v("roll_pitch_sigma_deg", c.roll_pitch_sigma_deg, 0, 10);
    v("heading_sigma_deg", c.heading_sigma_deg, 0, 10);
    v("correlation_s", c.correlation_s, 0.1, 10000);
    v("position_white_m", c.position_white_m, 0, 1);
    v("attitude_white_deg", c.attitude_white_deg, 0, 1);
    v("grade", c.grade,
      {{"custom", InsGrade::Custom}, {"pos_lv_220", InsGrade::PosLv220}, {"pos_lv_420", InsGrade::PosLv420}, {"span_cpt", InsGrade::SpanCpt}});
    v("gyro_bias_deg_h", c.gyro_bias_deg_h, 0, 1000);
    v("angle_random_walk_deg_sqrt_h", c.angle_random_walk_deg_sqrt_h, 0, 10);
    v("velocity_random_walk_sqrt_h", c.velocity_random_walk_sqrt_h, 0, 10);
    v("accelerometer_bias_ug", c.accelerometer_bias_ug, 0, 100000);
    v("wheel_s", c.wheel_s, 0, 1000);
    v("high_variance_m", c.high_variance_m, 0.01, 1000);
    v("outages", c.outages);
  }
};

/// Stamp of an edge by the capture computer against the true second: interrupt latency.
struct PpsConfig {
  double jitter_us = 1.5;        ///< sigma
  double spike_probability = 0.02;
  double spike_us = 40.0;        ///< largest lateness of a spike

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("jitter_us", c.jitter_us, 0, 10000);
    v("spike_probability", c.spike_probability, 0, 1);
    v("spike_us", c.spike_us, 0, 100000);
  }
};

struct Scenario {
  std::uint64_t seed = 1;
  double duration_s = 32.0;  ///< laser and camera run this long ...
  double lead_in_s = 4.0;    ///< ... after this, in which only POS and PPS run and the vehicle stands; whole seconds
  bool noise = true;         ///< master switch of every random error; quantisation on the wire stays
  int start_gps_week = 2381;
  int start_time_of_week_s = 302403;  ///< the default crosses a full UTC hour 15 s in: 18 leap seconds
  double origin_latitude_deg = 48.1372, origin_longitude_deg = 11.5755, origin_height_m = 565.0;  ///< of the road where s = 0
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
  /// Spoil what the devices send (faults/faulty_timeline.hpp), not what is rendered: not in visit(), text() and fingerprint(), so that
  /// drives that differ in their faults alone share one folder.
  std::vector<FaultLine> faults;

  template <class Self, class V>
  static void visit(Self& c, V&& v) {
    v("seed", c.seed, 0, 1e15);
    v("duration_s", c.duration_s, 0.5, 3600);
    v("lead_in_s", c.lead_in_s, 1, 600);
    v("noise", c.noise);
    v("start_gps_week", c.start_gps_week, 1, 10000);
    v("start_time_of_week_s", c.start_time_of_week_s, 0, 604799);
    v("origin_latitude_deg", c.origin_latitude_deg, -89, 89);
    v("origin_longitude_deg", c.origin_longitude_deg, -180, 180);
    v("origin_height_m", c.origin_height_m, -500, 9000);
    v("scene", c.scene,
      {{"street", SceneKind::Street},
       {"square", SceneKind::Square},
       {"canyon", SceneKind::Canyon},
       {"alley", SceneKind::Alley},
       {"traffic", SceneKind::Traffic},
       {"tunnel", SceneKind::Tunnel},
       {"targets", SceneKind::Targets}});
    v("street", c.street);
    v("alley", c.alley);
    v("traffic", c.traffic);
    v("tunnel", c.tunnel);
    v("targets", c.targets);
    v("drive", c.drive);
    v("ins", c.ins);
    v("pps", c.pps);
    v("laser", c.laser);
    v("camera", c.camera);
    v("wheel", c.wheel);
  }

  GpsNs begin_gps_ns() const;       ///< first PPS edge and INS sample
  GpsNs sensors_begin_gps_ns() const;  ///< laser and camera start
  GpsNs sensors_end_gps_ns() const;
  GpsNs end_gps_ns() const;         ///< one second after the sensors stop, so that every measurement lies between POS samples

  /// Empty if the scenario can be driven; else a sentence that names the key and what is allowed.
  std::string validate() const;
  /// A line "key=value" for every key but the faults; keys younger than the format (see scenario.cpp) only where they differ from their
  /// default.
  std::string text() const;
  /// 16 hex digits over text() and the renderer's revision: the name of its folder in the cache.
  std::string fingerprint() const;
};

}  // namespace hueline::sim
