#pragma once

#include <cstdint>

/// The paper's check: objects that are picked in an image and measured from the laser points there, compared with their
/// true places. Lens and mounting are those that the tools find from simulated boards and targets, never the true ones.
namespace hueline::calibration::test {

struct MeasuredObjects {
  int points = 0;          ///< number of objects measured
  double plane_rms_m = 0;  ///< root mean square of the error east and north
  double height_rms_m = 0;
};
struct MeasuringNoise {
  double pick_px = 0.5;      ///< sigma of the operator's pixel
  double range_m = 0.02;     ///< sigma of a laser return
  double position_m = 0.01;  ///< sigma of the POS, each axis
  double roll_pitch_deg = 0.007, heading_deg = 0.02;
};

/// Measures `count` objects on walls 4 to 30 m away. Returns 0 points if a calibration fails.
MeasuredObjects measure_objects(int count, int board_views, const MeasuringNoise& noise, std::uint32_t seed);

}  // namespace hueline::calibration::test
