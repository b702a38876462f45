#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/stamped.hpp"
#include "fusion/direction_grid.hpp"
#include "fusion/rig_geometry.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::fusion {

/// The returns of one batch in the local level, with one array for each component. Returns that cannot be placed are
/// counted and left out.
struct GeoreferencedBatch {
  std::vector<double> east, north, up;  ///< m from the trajectory's origin
  RelativePlaces places;                ///< the same, from `scanner_enu`
  std::vector<float> sigma_m;           ///< one sigma, all axes together
  std::vector<std::uint32_t> source;    ///< index in StampedLaserBatch::returns
  /// Place of the scanner at the first firing that has a pose, m from the trajectory's origin.
  Eigen::Vector3d scanner_enu = Eigen::Vector3d::Zero();
  Leap leapt;  ///< Pose::leapt at that firing
  std::array<std::uint64_t, kNoPoseReasons> no_pose{};
  std::uint64_t empty = 0;  ///< returns without a range, or with values that are not finite
  std::size_t size() const { return source.size(); }
};

/// Places each return with the pose at its own firing. Exact poses are at most `pose_step` apart; between them the
/// placed point moves on a straight line. With 0.5 ms, a turn of 1 rad/s and a range of 100 m, the true path deviates
/// from that line by 3 micrometres.
void georeference(const StampedLaserBatch& batch, const LaserMount& mount, const Trajectory& trajectory,
                  nanoseconds pose_step, GeoreferencedBatch& out);

}  // namespace hueline::fusion
