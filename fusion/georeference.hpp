#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/stamped.hpp"
#include "fusion/rig_geometry.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::fusion {

/// Returns of one batch in the local level, one array a component. Returns that cannot be placed are counted and left
/// out.
struct GeoreferencedBatch {
  std::vector<double> east, north, up;  ///< m from the trajectory's origin
  std::vector<float> sigma_m;           ///< one sigma, all axes together
  std::vector<std::uint32_t> source;    ///< index into StampedLaserBatch::returns
  std::array<std::uint64_t, kNoPoseReasons> no_pose{};
  std::uint64_t empty = 0;  ///< returns without a range, or not finite
  std::size_t size() const { return source.size(); }
};

/// Places each return with the pose of its own firing: exact poses at most `pose_step` apart, between them the placed
/// point moves on a straight line (at 0.5 ms, 1 rad/s of turn and 100 m of range that bends by 3 micrometres).
void georeference(const StampedLaserBatch& batch, const LaserMount& mount, const Trajectory& trajectory,
                  nanoseconds pose_step, GeoreferencedBatch& out);

}  // namespace hueline::fusion
