#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/import/bag_survey.hpp"
#include "apps/inspect/capture_devices.hpp"
#include "core/buffer.hpp"
#include "rosbag/scanner_files.hpp"

namespace hueline::apps {

/// How long after its exposure an image counts as received: less than `latency_max_ms` of the rig that is made.
constexpr nanoseconds kImportedImageLatency = std::chrono::milliseconds(20);

/// A sensor of the rig that is made, and the topic that it is read from.
struct ImportedSensor {
  std::string name, topic, yaml;
  enum class Kind : std::uint8_t { Pose, Packets, Camera, Cloud } kind{};
  Buffer description{};  ///< of an Ouster: the packet of its metadata
  /// Of clouds and images: added to header.stamp, so that it is on the clock of the other topics.
  nanoseconds stamp_shift{0};
  drivers::RosTimeRule times{};  ///< of clouds
  unsigned raised_bits = 0;      ///< of images: ImageStamp::raised_bits
};

/// Makes the rig of a recording of ROS, and says what has to be entered by hand.
/// Thread safety: none.
class ImportRig {
 public:
  ImportRig(const BagSurvey& survey, PoseChoice pose) : survey_(&survey), pose_(std::move(pose)) {}

  void add_pose();
  void add_scanner(const rosbag::TopicCount& topic, const CaptureDevice& device, const std::string& metadata,
                   Buffer description);
  /// Adds the point clouds of the topics `wanted`; if there are none, the best of each frame whose scanner is not there
  /// yet. Call it after all add_scanner().
  void add_clouds(const std::vector<std::string>& wanted);
  /// Adds the cameras of the topics `wanted`; if there are none, those of choose_cameras(). `offset` is GPS time minus
  /// the time of the stamps. Errors: those of choose_cameras().
  Status add_cameras(const std::vector<std::string>& wanted, std::chrono::seconds offset);

  std::string text() const;
  const std::vector<ImportedSensor>& sensors() const { return sensors_; }
  /// Returns what a topic became, or why it could not be used, by its name.
  const std::map<std::string, std::string>& became() const { return became_; }
  const std::vector<std::string>& to_do() const { return to_do_; }
  /// How many sensors and lenses got their mountings from the tree of frames.
  int mounted() const { return mounted_; }

 private:
  void add_cloud(const std::string& topic, const BagSurvey::Cloud& cloud);
  std::string why_not_used(const std::string& topic, const BagSurvey::Cloud& cloud,
                           const std::vector<std::string>& wanted) const;
  void add_camera(const std::string& topic, const CameraTopic& camera, const ImportedLens& lens,
                  std::chrono::seconds offset);
  std::string lens_text(const std::string& name, const std::string& frame, const ImportedLens& lens);
  nanoseconds shift_of(const std::string& name, const std::string& what, std::optional<nanoseconds> delay);
  std::string base() const;
  std::optional<Eigen::Isometry3d> place_of(const std::string& frame) const;
  std::string where_from(const std::string& key, const std::string& sensor, const std::string& frame, bool is_known);
  std::string scanner_mounting(const std::string& name, const std::string& frame, const Eigen::Isometry3d& axes);
  std::string free_name(std::string name) const;
  void tell_not_known(std::string what);

  const BagSurvey* survey_;
  PoseChoice pose_;
  std::vector<ImportedSensor> sensors_;
  std::map<std::string, std::string> became_;
  std::vector<std::string> to_do_, not_known_;
  std::map<std::string, std::string> packets_in_;  // topics of packets, by their frame
  std::string lenses_;
  int mounted_ = 0;
};

}  // namespace hueline::apps
