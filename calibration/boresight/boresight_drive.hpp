#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "core/frames.hpp"

/// The input of a boresight calibration: laser returns with the poses that the POS gave for them.
namespace hueline::calibration {

/// One return as the scanner measured it, with the pose of the body at its firing as the POS states it.
struct BoresightReturn {
  Eigen::Vector3d body_enu = Eigen::Vector3d::Zero();  ///< origin of Body in Enu, m
  Eigen::Quaternionf q_enu_body = Eigen::Quaternionf::Identity();
  Eigen::Vector3f p_scanner = Eigen::Vector3f::Zero();  ///< place in the scanner's frame, m
  float time_s = 0;                                     ///< time of the firing, counted from the drive's first return
  std::uint32_t stretch = 0;                            ///< index into BoresightDrive::stretches
  std::uint16_t scanner = 0;                            ///< index into BoresightDrive::scanners
  /// Order among the kept returns of the same cell and stretch. Returns with a high rank are dropped first.
  std::uint8_t rank = 0;
  std::uint8_t block_level = 0;  ///< Level of the return's block of space. Blocks with a low level are dropped first.
};

/// A piece of the vehicle's path that is so short that all of it sees a place from one side.
struct DriveStretch {
  double path_m = 0;   ///< path length from the beginning of the drive to the beginning of the stretch
  double heading = 0;  ///< heading at its beginning, rad, clockwise from north
};

/// One sigma of the pose as the POS states it.
struct PosSigma {
  double time_s = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< east, north, up, m
  Eigen::Vector3d attitude = Eigen::Vector3d::Zero();  ///< roll, pitch, heading, rad
};

/// A scanner as the rig describes it: its mounting was measured with a tape or calibrated before.
struct BoresightScanner {
  std::string name;
  Transform<Body, Scanner> T_body_scanner;
  /// one sigma of a range
  double sigma_range_m = 0.02;
};

/// A drive with everything that the calibration needs.
struct BoresightDrive {
  std::vector<BoresightScanner> scanners;
  std::vector<BoresightReturn> returns;  ///< in the order of their stretches
  std::vector<DriveStretch> stretches;
  std::vector<PosSigma> sigmas;  ///< in the order of time, one second or more apart
};

}  // namespace hueline::calibration
