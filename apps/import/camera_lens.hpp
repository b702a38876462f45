#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "drivers/ros/ros_message.hpp"
#include "fusion/camera_model.hpp"

/// The lens that a recording of ROS states for the images of a topic.
namespace hueline::apps {

/// What a sensor_msgs/CameraInfo says. Its matrices are those of a whole image of `width` x `height` px; what was sent
/// may be a part of it, of which pixels were joined.
struct CameraFacts {
  std::string frame;
  std::uint32_t width = 0, height = 0;  ///< px; 0: not given
  std::string model;
  std::vector<double> distortion;
  std::array<double, 9> K{};   ///< of the image as the camera gave it, row by row
  std::array<double, 9> R{};   ///< rows of the rectified camera's axes from those of the camera; 0: not given
  std::array<double, 12> P{};  ///< of the rectified image; 0: not given
  std::uint32_t binning_x = 1, binning_y = 1;
  std::uint32_t part_x = 0, part_y = 0, part_width = 0, part_height = 0;  ///< px of the whole; width 0: all of it
  std::string why;                                                        ///< why it cannot be used; empty: it can
};
/// Reads a sensor_msgs/CameraInfo.
CameraFacts take_camera_info(drivers::RosReader message);

/// Returns whether the images of a topic are rectified, by the words of its name: image_rect, image_rect_color.
bool is_rectified(const std::string& topic);

/// The topic of the CameraInfo that belongs to some images.
struct FoundFacts {
  std::string topic;         ///< empty: there is none
  bool is_of_frame = false;  ///< it names the frame of the images, or one of the two names none
};
/// Chooses among the CameraInfos, by their topics, that of the images of `topic` with `frame`: of those with the same
/// frame the one whose topic has the longest part in common; then one without a frame, or that which ROS's convention
/// has beside the images (camera_info). `is_only_camera`: a sole CameraInfo without a frame belongs to it.
FoundFacts find_facts(const std::map<std::string, CameraFacts>& facts, const std::string& topic,
                      const std::string& frame, bool is_only_camera);

/// The lens of some images.
struct ImportedLens {
  std::string facts;  ///< topic of its CameraInfo; empty: there is none
  fusion::CameraIntrinsics lens;
  std::string remark;  ///< what was done with the numbers of the CameraInfo; empty: nothing
  /// From the lens to the frame of the images; of rectified images it may not be the identity (rectified_place()).
  Eigen::Isometry3d T_frame_lens = Eigen::Isometry3d::Identity();
  std::string doubt;  ///< of rectified images: how their lens differs from that of their frame; empty: it does not
  std::string why;    ///< why `lens` is not known; empty: it is. A lens that is not known is a guess.
};
/// Makes the lens of images of `width` x `height` px. Matrices are cut and scaled to this size; rectified images have
/// the matrix P and no distortion. `facts`: null if there is no CameraInfo.
ImportedLens lens_of(const CameraFacts* facts, bool is_rectified, std::uint32_t width, std::uint32_t height);

}  // namespace hueline::apps
