#pragma once

#include <cstdint>
#include <vector>

#include "calibration/mount/resection.hpp"
#include "tests/calibration/lens/simulated_boards.hpp"

/// Points in front of a lens whose pose is known. Fusion's camera model projects them; it shares no code with the
/// calibration.
namespace hueline::calibration::test {

struct SimulatedPoints {
  int count = 20;
  double noise_px = 1, noise_m = 0.005;   ///< standard deviation of each coordinate
  double nearest_m = 2, farthest_m = 60;  ///< near points determine the centre, far points the rotation
  /// If set: this many points are between nearest_m and twice that, the others beyond half of farthest_m. Otherwise
  /// distances are spread over the whole range.
  int near = -1;
  double innermost = 0;  ///< share of the image's half width and half height within which there is no point
  std::uint32_t seed = 1;
};
/// Twenty points as calibration.md advises: eight near, the others far, all along the image's borders.
inline SimulatedPoints good_points(std::uint32_t seed) {
  return {.count = 20,
          .noise_px = 1,
          .noise_m = 0.005,
          .nearest_m = 2,
          .farthest_m = 100,
          .near = 8,
          .innermost = 0.85,
          .seed = seed};
}
struct Shot {
  Transform<Scanner, Lens> T_scanner_lens;
  std::vector<Correspondence> points;
};
Shot simulate_points(const fusion::CameraIntrinsics& lens, const SimulatedPoints& what);

/// Returns the rotation about the lens's axes (rad) and the shift of the centre (m) from the true pose to the one
/// found.
Eigen::Matrix<double, 6, 1> pose_error(const Transform<Scanner, Lens>& found, const Transform<Scanner, Lens>& truth);

}  // namespace hueline::calibration::test
