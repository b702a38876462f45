#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/keys.hpp"
#include "sim/lens_optics.hpp"
#include "sim/vec3.hpp"

/// Sensors of a scenario: what they are and how they sit on the vehicle. scenario_keys.cpp lists their keys.
namespace hueline::sim {

/// A sensor's frame in Body (x right, y forward, z up; origin at the IMU). R_body_sensor = Rz(rot_z) Ry(rot_y)
/// Rx(rot_x).
struct MountConfig {
  double x_m = 0, y_m = 0, z_m = 0;
  double rot_x_deg = 0, rot_y_deg = 0, rot_z_deg = 0;

  void visit(Keys& keys);
  Pose T_body_sensor() const {
    return {rotation_zyx(radians(rot_x_deg), radians(rot_y_deg), radians(rot_z_deg)), {x_m, y_m, z_m}};
  }
};

/// Value: product byte of a Velodyne's data packets; Profile: a single rotating mirror in the generic wire format.
enum class LaserModel : std::uint8_t { Profile = 0, Hdl32e = 0x21, Vlp16 = 0x22 };

/// Scanner frame: z along the spin axis, y forward (azimuth 0), x right; azimuth counts clockwise seen from above.
/// Profile: z along the mirror's axis, y where its angle is 0; rot_x_deg -90 lays the axis along the driving direction,
/// angle 0 down.
struct LaserConfig {
  LaserModel model = LaserModel::Vlp16;
  /// 0: the rate nearest to 600 rpm at which each block turns a whole number of hundredths of a degree (VLP-16: 0.40
  /// deg, 602.816 rpm; HDL-32E: 0.17 deg, 614.873 rpm), so that the wire's azimuths are exact.
  double rate_rpm = 0;
  double lines_per_s = 200;         ///< Profile: turns of the mirror
  double points_per_s = 200'000;    ///< Profile: pulses, evenly over the whole turn
  double motor_jitter_deg = 0.003;  ///< sigma of the reported azimuth of a block against the true one
  double range_sigma_m = 0.012;
  double dropout_probability = 0.002;
  double min_range_m = 0.5, max_range_m = 100.0;
  bool vertical_offsets =
      true;  ///< VLP-16: lasers start up to 11.2 mm above or below the optical centre, as its manual lists
  MountConfig mount{.x_m = 0.02, .y_m = -1.28, .z_m = 1.83, .rot_x_deg = 28.0, .rot_y_deg = 0.6, .rot_z_deg = -0.9};

  void visit(Keys& keys);
};

/// The vehicle's wheel encoder: its brakes' control unit, which tells speeds and pulses of the wheels on the CAN bus.
struct WheelConfig {
  double rate_hz = 0;  ///< of each of its two messages; 0: the vehicle has none
  double circumference_m = 1.96;
  double scale = 1.0;  ///< what it says of a way over the true way: tyres worn or other than the maker's
  int pulses_per_turn = 96;
  double track_m = 1.55;      ///< between the wheels of an axle
  double speed_sigma = 0.01;  ///< m/s, white, of each wheel that turns

  void visit(Keys& keys);
};

enum class ToneCurve { Linear, Srgb };
enum class ShutterKind { Global, Rolling };
/// What the camera sends: the mosaic itself, or 24 JPEGs (wire/jpeg_planes_encode.hpp).
enum class ImagePayload : std::uint8_t { Raw, JpegPlanes };

/// All lenses expose at one moment; their raw images are stacked in one, row by row: lens i at column i % columns, row
/// i / columns.
struct CameraConfig {
  double rate_hz = 2.0;
  double first_exposure_s =
      0.250137;  ///< strobe of exposure 0 after the sensors' start: on no round number, as in life
  double exposure_us = 2000;
  double strobe_jitter_us = 0.5;  ///< sigma: what the POS stamps against the exposure's true start
  int blur_samples = 1;           ///< poses averaged over an exposure; 1: the middle alone, no motion blur
  int lens_width = 612, lens_height = 512;
  int stack_columns = 3, stack_rows = 2;
  LensModel lens_model = LensModel::KannalaBrandt;
  ToneCurve tone_curve = ToneCurve::Srgb;  ///< applied before the 8 bits, as cameras do in their 8-bit modes
  double gain = 1.0;                       ///< 1: a white wall in the sun is just below saturation
  double vignetting = 0.15;  ///< share of light lost at the lens image's far corner, growing with 1 - cos of the angle
  double full_well_electrons = 9000, read_noise_electrons = 8;
  bool antialias = true;  ///< four samples a pixel along outlines
  ShutterKind shutter = ShutterKind::Global;
  double row_time_us =
      12.0;  ///< rolling: from one row of a lens image to the next; the strobe belongs to the middle row
  bool auto_exposure = false;          ///< each lens adapts its own gain from image to image (exposure_control.hpp)
  double auto_exposure_target = 0.22;  ///< mean of the delivered light, linear, 1 saturates
  double auto_exposure_rate = 0.4;     ///< share of the logarithmic error mended by each image
  double auto_exposure_limit = 8.0;    ///< largest and one over smallest factor on `gain`
  ImagePayload payload = ImagePayload::Raw;
  int jpeg_quality = 85;  ///< jpeg_planes: of the 24 JPEGs
  MountConfig mount{.x_m = 0.03, .y_m = -0.35, .z_m = 1.85, .rot_x_deg = 0.4, .rot_y_deg = -0.7, .rot_z_deg = 90.8};
  std::vector<LensConfig> lenses = ladybug5_lenses();

  void visit(Keys& keys);
};

}  // namespace hueline::sim
