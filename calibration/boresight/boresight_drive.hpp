#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "core/frames.hpp"

/// What a scanner's boresight is found from: laser returns with the poses that the POS had for them.
namespace hueline::calibration {

/// A return as the scanner measured it and the body's pose at its firing as the POS says it.
struct BoresightReturn {
  Eigen::Vector3d body_enu = Eigen::Vector3d::Zero();  ///< Body's origin in the local level, m
  Eigen::Quaternionf q_enu_body = Eigen::Quaternionf::Identity();
  Eigen::Vector3f p_scanner = Eigen::Vector3f::Zero();  ///< m
  float time_s = 0;                                     ///< firing, from the drive's first return
  std::uint32_t stretch = 0;                            ///< into BoresightDrive::stretches
  std::uint16_t scanner = 0;                            ///< into BoresightDrive::scanners
  std::uint8_t rank = 0;         ///< among those kept of its cell and stretch: the lower, the later it is given up
  std::uint8_t block_level = 0;  ///< likewise of its block of space: the higher, the later
};

/// A piece of the vehicle's way, short enough that all of it looks at a place from one side.
struct WayStretch {
  double way_m = 0;    ///< from the drive's begin to the stretch's
  double heading = 0;  ///< rad, clockwise from north, at its begin
};

/// One sigma of the pose as the POS states it.
struct PosSigma {
  double time_s = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< east, north, up, m
  Eigen::Vector3d attitude = Eigen::Vector3d::Zero();  ///< roll, pitch, heading, rad
};

/// A scanner as the rig has it: measured with a tape, or calibrated before.
struct BoresightScanner {
  std::string name;
  Transform<Body, Scanner> T_body_scanner;
  double sigma_range_m = 0.02;
};

struct BoresightDrive {
  std::vector<BoresightScanner> scanners;
  std::vector<BoresightReturn> returns;  ///< by stretch
  std::vector<WayStretch> stretches;
  std::vector<PosSigma> sigmas;  ///< in order of time, a second or more apart
};

}  // namespace hueline::calibration
