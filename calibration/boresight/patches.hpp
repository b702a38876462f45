#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"

namespace hueline::calibration {

/// A piece of a plane that the drive passed at least twice.
struct Patch {
  std::vector<std::uint32_t> returns;  ///< indices into BoresightDrive::returns of the returns near the plane
  std::vector<std::uint8_t> pass;      ///< pass of each return: 0, 1, ... in the order of the passes
  Eigen::Vector3d normal_enu = Eigen::Vector3d::UnitZ();
  /// Axis of Body to which the normal is nearest at the patch's first return: 0 across the path, 1 along it, 2 up.
  int facing = 2;
};

/// Settings of find_patches() and passes_of().
struct PatchConfig {
  double voxel_m = 1;
  double gate_m = 0.05;             ///< allowed thickness of a plane: noise, and the remaining error of the mounting
  double flatness = 0.05;           ///< limit of the variance across the plane over the smaller variance in the plane
  double least_share = 0.6;         ///< least share of a voxel's returns that must lie near the plane
  int fewest_of_pass = 6;           ///< least number of returns of a pass
  double pass_gap_m = 60;           ///< A new pass begins after this length of path without a return from the place.
  double pass_turn_deg = 60;        ///< A new pass also begins when the vehicle has turned by this angle.
  std::size_t most_patches = 4500;  ///< each facing keeps a third of them while it has that many
  std::size_t most_returns = 120;   ///< most returns of a patch
};

/// The result of find_patches().
struct PatchesFound {
  std::vector<Patch> patches;
  /// Number of voxels with enough returns, flat or not, that were seen in one pass and in several.
  std::size_t seen_once = 0, seen_twice = 0;
};

/// Returns the number of the pass, from 0, to which each of `stretches` belongs. `stretches` are the stretches from
/// which one place was seen, in increasing order.
std::vector<std::uint8_t> passes_of(const std::vector<std::uint32_t>& stretches, const std::vector<DriveStretch>& drive,
                                    const PatchConfig& config);

/// Cuts space into voxels and returns those in which the returns of at least two passes lie near one plane. The method
/// follows Liu and Zhang, BALM, RA-L 2021, section III, but all voxels have the size of `config` instead of an
/// octree's. `placed` has the place of every return in Enu with the present mounting.
PatchesFound find_patches(const BoresightDrive& drive, const std::vector<Eigen::Vector3d>& placed,
                          const PatchConfig& config);

}  // namespace hueline::calibration
