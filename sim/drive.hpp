#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// What the simulated world hands to the simulated devices, and the truth beside it. The members are plain numbers with
/// their units in the names, because the simulator shares no geometry, no time types and no encoders with the program
/// that it tests.
namespace hueline::sim {

/// GPS time, ns since 1980-01-06, without leap seconds.
using GpsNs = std::int64_t;

/// One solution of the POS, with its errors. `gps_ns` is the time at which it is valid. Angles as in
/// docs/conventions.md; velocities in m/s.
struct InsSample {
  GpsNs gps_ns = 0;
  double latitude_rad = 0, longitude_rad = 0, ellipsoidal_height_m = 0;
  double velocity_east = 0, velocity_north = 0, velocity_up = 0;
  double roll_rad = 0, pitch_rad = 0, heading_rad = 0;
  /// The sigmas that the POS claims: position east, north, up (m), velocity likewise (m/s), roll, pitch, heading (rad).
  std::array<double, 9> sigma{};
  /// INS status as NovAtel counts it: 3 good solution, 6 good solution without GNSS, 2 high variance.
  std::uint8_t status = 3;
  bool has_gnss = true;
};

/// One Velodyne data packet before encoding: 24 firing sequences of 16 lasers (VLP-16), or 12 of 32 lasers (HDL-32E).
struct LaserPacket {
  GpsNs first_firing_gps_ns = 0;
  std::array<std::uint16_t, 12> azimuth_centideg{};  ///< azimuth of each block, hundredths of a degree
  /// 12 x 32 distances in units of 2 mm, in the maker's order of lasers; 0 means no return.
  std::vector<std::uint16_t> distance_2mm;
  std::vector<std::uint8_t> reflectivity;  ///< 12 x 32 reflectivities in the same order
};

/// One data datagram of a profile scanner before encoding (docs/formats.md#profile-scanner).
struct ProfilePacket {
  GpsNs first_pulse_gps_ns = 0;                ///< when the first pulse left the scanner
  std::uint32_t line = 0;                      ///< number of the mirror's turn, from 0
  std::uint32_t angle = 0;                     ///< reported angle of the mirror at the first pulse, in 2^-32 of a turn
  std::int32_t angle_step = 0;                 ///< angle from one pulse to the next, in 2^-32 of a turn
  std::uint32_t period_ps = 0;                 ///< time from one pulse to the next
  std::vector<std::uint8_t> counts;            ///< number of returns of each pulse
  std::vector<std::uint32_t> range_100um;      ///< range of each return, in units of 0.1 mm
  std::vector<std::uint16_t> reflectance_1e4;  ///< reflectance of each return; 10000 is white
};

/// What the control unit of the brakes reports of the wheels at the end of one of its cycles.
struct WheelSample {
  GpsNs gps_ns = 0;               ///< end of the cycle
  std::array<double, 4> speed{};  ///< mean speed over the cycle, m/s: front left, front right, rear left, rear right
  std::array<std::uint32_t, 2> pulses{};  ///< pulses of the rear left and the rear right wheel since the drive began
};

/// One exposure: the stacked raw image of all lenses as the camera delivers it, or its JPEG planes.
struct CameraExposure {
  std::uint32_t number = 0;
  GpsNs exposure_start_gps_ns = 0;  ///< the strobe's edge, which the receiver stamps as the event mark
  std::int64_t exposure_ns = 0;     ///< duration of the exposure; where lenses differ, the mean
  /// Size of the mosaic in pixels; of JPEG planes, bytes a row and rows of the camera's buffer.
  std::uint32_t width = 0, height = 0;
  std::string image_file;  ///< file of width x height bytes, relative to the drive's folder in the cache
  /// What the camera writes into each image of its exposure: for each lens, or, if it is one, of all. Empty: nothing.
  struct Report {
    std::int64_t exposure_ns = 0;
    float gain = 0;  ///< amplification, a factor; 0: not told
  };
  std::vector<Report> reports{};
  std::int64_t longest_ns = 0;  ///< duration of the lens that is exposed longest; 0: all lenses are exposed alike
};

/// Truth of one laser return. Returns stand in the order of the packets, and within a packet in the order of blocks and
/// lasers.
struct TrueReturn {
  GpsNs fired_gps_ns = 0;
  std::uint16_t channel = 0;           ///< ring, counted from the lowest elevation
  std::uint16_t surface = 0;           ///< index into the scene's list of surfaces
  double east = 0, north = 0, up = 0;  ///< true place of the hit in the scene's local level (Enu), m
  /// True place of the scanner + true beam x the range as it was sent (with its noise, in the wire's steps), m.
  double beam_east = 0, beam_north = 0, beam_up = 0;
  /// The shaded colour as a perfect camera at the scanner would see it, 8-bit coded.
  std::uint8_t red = 0, green = 0, blue = 0;
  std::array<std::uint8_t, 3> albedo{};  ///< the surface's own colour, unshaded, sRGB-coded
  /// The linear light from which red, green and blue are made, 0 .. 4; 1 saturates at gain 1.
  std::array<float, 3> light{};
  bool is_moving = false;  ///< whether the surface moves by itself
};

/// Truth of one exposure: the pose of the camera head at the middle of the exposure.
struct TrueExposure {
  std::uint32_t number = 0;
  GpsNs exposure_mid_gps_ns = 0;
  std::array<double, 9> R_enu_head{};  ///< rotation matrix, row-major
  std::array<double, 3> p_enu_head{};
  std::vector<float> lens_gain;  ///< factor of each lens on top of the scenario's camera.gain
};

/// A drive, rendered before it is played. It is a function of the scenario, whose seed is a part of it.
struct Drive {
  /// Place of the scene's origin, the origin of its local level.
  double origin_latitude_rad = 0, origin_longitude_rad = 0, origin_height_m = 0;
  GpsNs begin_gps_ns = 0, end_gps_ns = 0;
  std::vector<InsSample> ins;
  std::vector<LaserPacket> laser;
  std::vector<ProfilePacket> profile;  ///< filled instead of `laser` where the scanner is a profile scanner
  std::vector<WheelSample> wheel;
  std::vector<CameraExposure> exposures;
  /// For each whole second from begin_gps_ns: stamp of the edge minus the true second.
  std::vector<std::int64_t> pps_edge_error_ns;
  std::string cache_dir;  ///< folder that holds the images and the truth
};

}  // namespace hueline::sim
