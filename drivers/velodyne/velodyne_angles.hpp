#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/beam_angles.hpp"
#include "drivers/velodyne/velodyne_model.hpp"

/// Calibration files of Velodyne scanners as ROS's velodyne_pointcloud has them: YAML with a list `lasers`, in which
/// each laser has its place in the packet and its corrections. The maker's tool writes the same as XML ("db.xml").
///
///   key                                        meaning
///   laser_id                                   place in the packet, from 0
///   vert_correction                            elevation, rad
///   rot_correction                             azimuth against the block's, counter-clockwise seen from above, rad
///   vert_offset_correction                     height of the beam's origin, m
///   horiz_offset_correction, dist_correction,  where the beam's origin lies aside, and corrections of the distance;
///   dist_correction_x, _y                      those of an HDL-64E. The models here have none of them
///
/// What says how to read the packets (distance_resolution, num_lasers) is known by the model, and intensities and
/// focuses change no point.
namespace hueline::drivers {

/// What a file says of one scanner.
struct VelodyneCalibration {
  BeamAngles angles;                       ///< by the order in the packet, in the senses of VelodyneLaser
  std::vector<double> vertical_offset_mm;  ///< likewise
  bool moves_points = false;               ///< it has corrections of distances, or origins that lie aside
};

/// Reads a calibration file. Errors: Unsupported (the file is no such YAML), Malformed (with what is wrong), Io.
Result<VelodyneCalibration> read_velodyne_calibration(const std::string& path);

/// Returns, for people, why these are not the directions of a scanner of this model, and of which model they may be.
/// Empty: they can be its own.
std::string why_not_of(const VelodyneTable& table, const BeamAngles& angles);

/// Returns, for people, why a scanner of this model cannot be decoded by a file. Empty: it can be.
std::string why_not_of(const VelodyneTable& table, const VelodyneCalibration& calibration);

}  // namespace hueline::drivers
