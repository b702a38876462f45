#pragma once

#include <cstdint>
#include <vector>

#include "calibration/mount/resection.hpp"
#include "tests/calibration/lens/simulated_boards.hpp"

/// Points before a lens whose place is known. Projected by fusion's camera model, which shares no code with the
/// calibration.
namespace hueline::calibration::test {

struct SimulatedPoints {
  int count = 20;
  double noise_px = 1, noise_m = 0.005;   ///< standard deviation of each coordinate
  double nearest_m = 2, farthest_m = 60;  ///< near ones fix the centre, far ones the turn
  /// Instead of all distances alike: so many between nearest_m and twice that, the others from half of farthest_m on.
  int near = -1;
  double innermost = 0;  ///< share of the image's half width and half height within which no point lies
  std::uint32_t seed = 1;
};
/// Twenty as calibration.md advises: eight near, the others far, all along the image's borders.
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

LensValues lens_values(const fusion::CameraIntrinsics& lens);

/// Turn about the lens's axes (rad) and centre (m) that lead from the truth to what was found.
Eigen::Matrix<double, 6, 1> pose_error(const Transform<Scanner, Lens>& found, const Transform<Scanner, Lens>& truth);

}  // namespace hueline::calibration::test
