#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// What the simulated world hands to the simulated devices, and the truth beside it. Plain numbers with units in the
/// names: the simulator shares no geometry, no time types and no encoders with the program that it tests.
namespace hueline::sim {

/// GPS time, ns since 1980-01-06 (continuous).
using GpsNs = std::int64_t;

/// The POS's output at `gps_ns`, errors included (truth is in Truth).
struct InsSample {
  GpsNs gps_ns = 0;
  double latitude_rad = 0, longitude_rad = 0, ellipsoidal_height_m = 0;
  double velocity_east = 0, velocity_north = 0, velocity_up = 0;
  double roll_rad = 0, pitch_rad = 0, heading_rad = 0;
  std::array<double, 9> sigma{};  ///< E N U (m), velocity (m/s), roll pitch heading (rad): what the POS claims
  std::uint8_t status = 3;        ///< as NovAtel counts: 3 good, 6 good without GNSS, 2 high variance
  bool has_gnss = true;
};

/// One Velodyne data packet before encoding: 24 firing sequences of 16 lasers (VLP-16) or 12 of 32 (HDL-32E).
struct LaserPacket {
  GpsNs first_firing_gps_ns = 0;
  std::array<std::uint16_t, 12> azimuth_centideg{};  ///< of each block
  std::vector<std::uint16_t> distance_2mm;           ///< 12 x 32, laser order of the maker; 0: no return
  std::vector<std::uint8_t> reflectivity;            ///< likewise
};

/// One data datagram of a profile scanner before encoding.
struct ProfilePacket {
  GpsNs first_pulse_gps_ns = 0;                ///< emission
  std::uint32_t line = 0;                      ///< turn of the mirror, from 0
  std::uint32_t angle = 0;                     ///< of the mirror at the first pulse, as it is reported, 2^-32 turn
  std::int32_t angle_step = 0;                 ///< from pulse to pulse, 2^-32 turn
  std::uint32_t period_ps = 0;                 ///< from pulse to pulse
  std::vector<std::uint8_t> counts;            ///< returns of each pulse
  std::vector<std::uint32_t> range_100um;      ///< of each return
  std::vector<std::uint16_t> reflectance_1e4;  ///< likewise, 10000 is white
};

/// What the control unit of the brakes tells of the wheels at the end of one of its cycles.
struct WheelSample {
  GpsNs gps_ns = 0;                       ///< end of the cycle
  std::array<double, 4> speed{};          ///< m/s, mean over the cycle: front left, front right, rear left, rear right
  std::array<std::uint32_t, 2> pulses{};  ///< of the rear left and right wheel since the drive's beginning
};

/// One exposure: the stacked raw image of all lenses as the camera delivers it, or its JPEG planes.
struct CameraExposure {
  std::uint32_t number = 0;
  GpsNs exposure_start_gps_ns = 0;      ///< the strobe's edge: what the event mark stamps
  std::int64_t exposure_ns = 0;         ///< duration
  std::uint32_t width = 0, height = 0;  ///< of the mosaic; of JPEG planes, bytes and rows of the camera's buffer
  std::string image_file;               ///< width x height bytes, in the drive's cache folder
};

/// Truth of one laser return, in the order of the packets: index = (packet, block, laser).
struct TrueReturn {
  GpsNs fired_gps_ns = 0;
  std::uint16_t channel = 0;           ///< ring from the lowest elevation
  std::uint16_t surface = 0;           ///< id in the scene's list
  double east = 0, north = 0, up = 0;  ///< true place of the hit, local level at the scene's origin
  double beam_east = 0, beam_north = 0,
         beam_up = 0;                         ///< true scanner place + true beam x the range that the wire can carry
  std::uint8_t red = 0, green = 0, blue = 0;  ///< colour as a perfect camera at the scanner would see it (shaded)
  std::array<std::uint8_t, 3> albedo{};       ///< the surface's own colour, unshaded, sRGB-coded
  std::array<float, 3> light{};  ///< linear light that makes red, green, blue: 1 saturates at gain 1; 0 .. 4
  bool is_moving = false;        ///< the surface moves by itself
};

/// Truth of one exposure: pose of the camera head at the middle of the exposure.
struct TrueExposure {
  std::uint32_t number = 0;
  GpsNs exposure_mid_gps_ns = 0;
  std::array<double, 9> R_enu_head{};  ///< row-major
  std::array<double, 3> p_enu_head{};
  std::vector<float> lens_gain;  ///< of each lens, beside the scenario's camera.gain
};

/// A drive, rendered ahead. Deterministic in the scenario (seed included).
struct Drive {
  double origin_latitude_rad = 0, origin_longitude_rad = 0, origin_height_m = 0;  ///< of the scene's local level
  GpsNs begin_gps_ns = 0, end_gps_ns = 0;
  std::vector<InsSample> ins;
  std::vector<LaserPacket> laser;
  std::vector<ProfilePacket> profile;  ///< instead of `laser`, where the scanner is a profile scanner
  std::vector<WheelSample> wheel;
  std::vector<CameraExposure> exposures;
  std::vector<std::int64_t> pps_edge_error_ns;  ///< of each whole second from begin: stamp minus true second
  std::string cache_dir;                        ///< where images and truth lie
};

}  // namespace hueline::sim
