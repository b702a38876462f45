#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/keys.hpp"
#include "sim/lens_optics.hpp"
#include "sim/vec3.hpp"

/// The sensors of a scenario: their properties and their mountings. scenario_keys.cpp lists their keys.
namespace hueline::sim {

/// The mounting of a sensor in Body (x right, y forward, z up; origin at the IMU). R_body_sensor = Rz(rot_z) Ry(rot_y)
/// Rx(rot_x).
struct MountConfig {
  double x_m = 0, y_m = 0, z_m = 0;
  double rot_x_deg = 0, rot_y_deg = 0, rot_z_deg = 0;

  void visit(Keys& keys);
  /// Returns the mounting as a transform from the sensor's frame into Body.
  Pose T_body_sensor() const {
    return {rotation_zyx(radians(rot_x_deg), radians(rot_y_deg), radians(rot_z_deg)), {x_m, y_m, z_m}};
  }
};

/// The kind of scanner. The value of a Velodyne is the product byte of its data packets; Profile is a single rotating
/// mirror in the generic wire format.
enum class LaserModel : std::uint8_t { Profile = 0, Hdl32e = 0x21, Vlp16 = 0x22 };

/// The scanner. Scanner frame: z along the spin axis, y forward (azimuth 0), x right; azimuth counts clockwise seen
/// from above. Frame of a profile scanner: z along the mirror's axis, y in the direction of angle 0; rot_x_deg -90 lays
/// the axis along the driving direction, with angle 0 down.
struct LaserConfig {
  LaserModel model = LaserModel::Vlp16;
  /// 0: the rate nearest to 600 rpm at which each block turns by a whole number of hundredths of a degree, so that the
  /// azimuths on the wire are exact (VLP-16: 0.40 deg, 602.816 rpm; HDL-32E: 0.17 deg, 614.873 rpm).
  double rate_rpm = 0;
  double lines_per_s = 200;         ///< Profile: turns of the mirror
  double points_per_s = 200'000;    ///< Profile: pulses, spread evenly over the whole turn
  double motor_jitter_deg = 0.003;  ///< sigma of the reported azimuth of a block against the true azimuth
  double range_sigma_m = 0.012;
  double dropout_probability = 0.002;
  double min_range_m = 0.5, max_range_m = 100.0;
  /// Range at which a matt surface of reflectance 0.1 that faces the beam is only just measured; 0: the scanner
  /// measures every surface up to max_range_m.
  double detection_range_m = 0;
  /// VLP-16: whether lasers start up to 11.2 mm above or below the optical centre, as its manual lists.
  bool vertical_offsets = true;
  MountConfig mount{.x_m = 0.02, .y_m = -1.28, .z_m = 1.83, .rot_x_deg = 28.0, .rot_y_deg = 0.6, .rot_z_deg = -0.9};

  void visit(Keys& keys);
};

/// The vehicle's wheel encoder: the control unit of its brakes, which sends speeds and pulses of the wheels on the CAN
/// bus.
struct WheelConfig {
  double rate_hz = 0;  ///< rate of each of its two messages; 0: the vehicle has none
  double circumference_m = 1.96;
  double scale = 1.0;  ///< reported distance divided by the true one, for tyres that are worn or not the maker's
  int pulses_per_turn = 96;
  double track_m = 1.55;      ///< distance between the wheels of an axle
  double speed_sigma = 0.01;  ///< white error of each wheel that turns, m/s

  void visit(Keys& keys);
};

/// How linear light becomes the camera's 8 bits.
enum class ToneCurve { Linear, Srgb };
/// Whether all rows are exposed at once or one after the other.
enum class ShutterKind { Global, Rolling };
/// What the camera sends: the raw mosaic, or 24 JPEGs (wire/jpeg_planes_encode.hpp).
enum class ImagePayload : std::uint8_t { Raw, JpegPlanes };

/// A drift of the camera head that its calibration does not know of: from a moment on it is turned, or its images are
/// taken later than its strobe says. The truth follows the drift; the rig of the scenario does not.
struct HeadDriftConfig {
  double at_s = 0;  ///< time after the sensors' start
  /// Rotation of the head about its own axes: R_body_head = the mounting's x Rz Ry Rx.
  double rot_x_deg = 0, rot_y_deg = 0, rot_z_deg = 0;
  double late_us = 0;  ///< true middle of the exposure minus that by the strobe

  bool is_there() const { return rot_x_deg != 0 || rot_y_deg != 0 || rot_z_deg != 0 || late_us != 0; }
  void visit(Keys& keys);
};

/// The camera head. All lenses expose at one moment. Their raw images are stacked in one image, row by row: lens i
/// stands in column i % columns and row i / columns.
struct CameraConfig {
  double rate_hz = 2.0;
  /// Time of strobe 0 after the sensors' start; not a round number, as with real cameras.
  double first_exposure_s = 0.250137;
  double exposure_us = 2000;
  double strobe_jitter_us = 0.5;  ///< sigma of the POS's event mark against the exposure's true start
  int blur_samples = 1;           ///< poses averaged over an exposure; 1: only the middle, without motion blur
  int lens_width = 612, lens_height = 512;
  int stack_columns = 3, stack_rows = 2;
  LensModel lens_model = LensModel::KannalaBrandt;
  ToneCurve tone_curve = ToneCurve::Srgb;  ///< applied before the 8 bits, as cameras do in their 8-bit modes
  double gain = 1.0;                       ///< 1: a white wall in the sun is just below saturation
  /// Share of light that is lost at the far corner of a lens image; it grows with 1 - cos of the angle off the axis.
  double vignetting = 0.15;
  double full_well_electrons = 9000, read_noise_electrons = 8;
  bool antialias = true;  ///< whether pixels along outlines have four samples
  ShutterKind shutter = ShutterKind::Global;
  /// Rolling shutter: time from one row of a lens image to the next; the strobe belongs to the middle row.
  double row_time_us = 12.0;
  /// What automatic exposure sets.
  enum class AutoSets : std::uint8_t {
    Gains,     ///< each lens its own amplification
    Shutter,   ///< one shutter for the whole head
    Shutters,  ///< each lens its own shutter; all open at one time
  };
  bool auto_exposure = false;  ///< whether each lens adapts its own gain from image to image (exposure_control.hpp)
  double auto_exposure_target = 0.22;  ///< mean of the delivered light, linear; 1 saturates
  double auto_exposure_rate = 0.4;     ///< share of the logarithmic error that each image removes
  double auto_exposure_limit = 8.0;    ///< largest factor on `gain` or `exposure_us`; the smallest is its inverse
  AutoSets auto_exposure_sets = AutoSets::Gains;
  /// Whether the camera writes into each image how it was exposed: with JPEG planes the shutter and gain of each lens,
  /// else those of all.
  bool reports_exposure = false;
  ImagePayload payload = ImagePayload::Raw;
  int jpeg_quality = 85;  ///< jpeg_planes: quality of the 24 JPEGs
  MountConfig mount{.x_m = 0.03, .y_m = -0.35, .z_m = 1.85, .rot_x_deg = 0.4, .rot_y_deg = -0.7, .rot_z_deg = 90.8};
  HeadDriftConfig drift;
  std::vector<LensConfig> lenses = ladybug5_lenses();

  void visit(Keys& keys);
};

}  // namespace hueline::sim
