#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geodesy.hpp"
#include "core/result.hpp"
#include "rosbag/scanner_files.hpp"

namespace hueline::apps {

/// The entry of a recording's header that says of which file it was made (JournalHeader::about).
inline constexpr const char* kImportedFrom = "imported_from";

/// What import_bag() reads.
struct ImportOptions {
  std::string bag{};                 ///< rosbag::open_bag()
  std::filesystem::path out{};       ///< folder of the drive
  std::optional<Geodetic> origin{};  ///< of the local coordinates of nav_msgs/Odometry
  std::string map{};  ///< whose coordinates these are, "EPSG:32632"; with an origin they count from there
  std::vector<std::string> clouds{};  ///< topics of the point clouds that are taken; empty: the best of each frame
  std::vector<std::string> images{};  ///< topics of the images that are taken; empty: the best (choose_cameras())
  std::vector<std::string> poses{};   ///< topics that the pose is taken from; empty: the best (choose_pose())
};

/// What import_bag() made.
struct ImportedBag {
  std::vector<rosbag::TopicCount> topics;
  std::map<std::string, std::string> became;  ///< what a topic became, or why it could not be used, by its name
  std::vector<std::string> to_do;             ///< what the user has to enter into the rig before a replay
  std::uint64_t packets = 0;
  std::uint64_t damages = 0;
  std::string first_damage;
  Status end;   ///< why the recording could not be read to its end
  Status made;  ///< Unsupported: why no drive was made; the topics say what each lacks
};

/// Makes a drive of a recording of ROS: `out`/drive.mcap, whose packets are those of the devices that hueline knows,
/// and `out`/rig.yaml, which describes them.
/// - Datagrams of scanners are taken as they are (drivers/ros/ros_datagrams.hpp).
/// - Point clouds, of scanners whose packets are not there, are taken as they are (drivers/ros/ros_cloud_decoder.hpp).
///   Those in one frame are taken for the same points, unless ImportOptions::clouds names them.
/// - Images become packets of a V4L2 camera (apps/import/image_message.hpp), of one topic for each camera
/// (choose_cameras()).
/// - The best pose (choose_pose()) becomes logs of a NovAtel receiver (drivers/ros/ros_pose.hpp).
/// - Mountings are those of /tf_static and of what stays the same in /tf, lenses those of sensor_msgs/CameraInfo.
/// A packet counts as received at the stamp that the driver of ROS gave it, which is on one clock for all topics; the
/// recorder's time stands in where there is none. Images and clouds whose stamps are of another clock are moved to that
/// of the poses. Messages that are not in the order of their times are sorted (rosbag::in_order()). Stamps of a
/// simulator are counted from kSimulatorBegin. A cloud counts as received at its last point. Errors: those of
/// rosbag::open_bag(); Invalid if `clouds` names a topic that has none, or `images` or `poses` one that cannot be used,
/// or `map` one without the place of the poses; Io.
Result<ImportedBag> import_bag(const ImportOptions& options);

}  // namespace hueline::apps
