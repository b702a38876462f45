#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"

namespace hueline::calibration {

/// A piece of a plane that was seen in two passes or more.
struct Patch {
  std::vector<std::uint32_t> returns;  ///< into BoresightDrive::returns, those near the plane
  std::vector<std::uint8_t> pass;      ///< of each: 0, 1, ... in the order in which the place was passed
  Eigen::Vector3d normal_enu = Eigen::Vector3d::UnitZ();
  int facing = 2;  ///< axis of Body that the normal is nearest to when first seen: 0 across the way, 1 along it, 2 up
};

struct PatchConfig {
  double voxel_m = 1;
  double gate_m = 0.05;             ///< how thick a plane may be: noise, and what the mounting still is off
  double flatness = 0.05;           ///< largest variance across the plane over its second largest in it
  double least_share = 0.6;         ///< of a voxel's returns near the plane
  int fewest_of_pass = 6;           ///< returns
  double pass_gap_m = 60;           ///< way without a look at the place, after which it is another pass ...
  double pass_turn_deg = 60;        ///< ... as is a look with the vehicle turned by so much
  std::size_t most_patches = 4500;  ///< a third of each facing, while there are so many
  std::size_t most_returns = 120;   ///< of a patch
};

struct PatchesFound {
  std::vector<Patch> patches;
  std::size_t seen_once = 0, seen_twice = 0;  ///< voxels with enough returns, flat or not
};

/// Where the vehicle's stretches (increasing) become another pass of one place: the pass of each.
std::vector<std::uint8_t> passes_of(const std::vector<std::uint32_t>& stretches, const std::vector<WayStretch>& way,
                                    const PatchConfig& config);

/// Cuts space into voxels and keeps those in which the returns of two passes or more lie near one plane (Liu and Zhang,
/// BALM, RA-L 2021, section III, without their octree: two sizes do). `placed`: every return in the local level by the
/// present mounting.
PatchesFound find_patches(const BoresightDrive& drive, const std::vector<Eigen::Vector3d>& placed,
                          const PatchConfig& config);

}  // namespace hueline::calibration
