#pragma once

#include <optional>
#include <string>

#include "apps/colour/shot_calibration.hpp"

namespace YAML {
class Node;
}  // namespace YAML

/// Reads calibrations in the forms in which others publish them beside images and clouds.
namespace hueline::apps {

/// What one file of a calibration holds. A pose may come in two parts: KITTI's raw data have one file from the laser to
/// the first camera, and one from there to the lens.
struct CalibrationParts {
  ShotCalibration shot;
  std::optional<Transform<Lens, Scanner>> T_first_scanner;  ///< the pose of the laser in the frame of the first camera
  std::optional<Transform<Lens, Lens>> T_lens_first;        ///< from that frame to the lens's
};

/// Reads JSON: SensorsCalibration; calib.json of direct_visual_lidar_calibration; or K, D and T. Throws
/// config::ConfigError.
void read_published_json(const std::string& path, CalibrationParts& out);

/// Reads text: lines "NAME: numbers" with K, D and T, or of KITTI; or matrices of numbers alone. Throws
/// config::ConfigError.
void read_published_text(const std::string& path, CalibrationParts& out);

/// Reads YAML: of ROS's camera_calibration and CameraInfo, of OpenCV's FileStorage as Autoware writes it, of Kalibr, of
/// camodocal, of FAST-LIVO; or a pose between named frames. Returns false if it has none of their keys. Throws
/// config::ConfigError if it has, but something else is wrong.
bool read_published_yaml(const std::string& path, CalibrationParts& out);

/// Reads the pose of one frame in another whose names say which is the laser and which the camera: ROS's
/// TransformStamped, as Apollo publishes it; or a member PARENT-CHILD with q and t, as RELLIS-3D has it. Returns false
/// if there is none. Throws config::ConfigError, also if the names do not say it, and YAML::Exception.
bool read_framed_pose(const std::string& path, const YAML::Node& root, ShotCalibration& out);

}  // namespace hueline::apps
