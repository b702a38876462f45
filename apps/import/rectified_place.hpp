#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "apps/import/camera_lens.hpp"

/// Where the camera of rectified images is.
namespace hueline::apps {

/// Returns the place of frame `of` in frame `in`, or nothing if they are not joined.
using PlaceInFrame = std::function<std::optional<Eigen::Isometry3d>(const std::string& of, const std::string& in)>;

/// The camera of rectified images in their frame: p_frame = T_frame_lens p_lens.
struct RectifiedPlace {
  Eigen::Isometry3d T_frame_lens = Eigen::Isometry3d::Identity();
  std::string how;  ///< what shows it
};

/// Rectified images are those of a camera that is turned by R, and of a stereo pair's second one P says how far it is
/// beside the first. Programs differ in which of them the frame of the images has. The two frames of a pair show it: if
/// they are one, it is that of the first camera; if they are parallel and as far apart as P says, they are those of the
/// rectified cameras; if they are turned against each other as the two R say, they are those of the cameras.
///
/// `own` is the CameraInfo of the images, `all` those of the recording, by their topics. Returns nothing if the images
/// are neither turned nor beside another camera, or if no pair shows which frame they have.
std::optional<RectifiedPlace> rectified_place(const CameraFacts& own, const std::map<std::string, CameraFacts>& all,
                                              const PlaceInFrame& place);

}  // namespace hueline::apps
