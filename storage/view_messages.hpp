#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/coloured_point.hpp"
#include "core/frames.hpp"
#include "core/geodesy.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"

namespace google::protobuf {
class Message;
}

namespace hueline::storage {

/// A lens as the view shows it. Its model and numbers are those of fusion::CameraIntrinsics, in pixels of the lens
/// image, whose first pixel is at (x_offset, y_offset) of the camera's image.
struct ViewLens {
  std::string name, camera;  ///< the rig's names
  Transform<CameraHead, Lens> T_head_lens;
  bool is_fisheye = false;  ///< OpenCV's fisheye (k1 k2 k3 k4); otherwise its projectPoints (k1 k2 p1 p2 k3)
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero(), principal_point_px = Eigen::Vector2d::Zero();
  std::vector<double> distortion;
  std::uint32_t x_offset = 0, y_offset = 0;
};

/// What a vehicle carries, for the frames of the view.
struct ViewRig {
  std::vector<std::pair<std::string, Transform<Body, Scanner>>> scanners;  ///< by the rig's names
  Transform<Body, CameraHead> T_body_head;
  std::vector<ViewLens> lenses;
};

/// A topic of the view and the schema of its messages.
struct ViewChannel {
  std::string topic;
  std::string schema_name;  ///< such as "foxglove.Log"
  std::string schema;       ///< the serialized FileDescriptorSet
};

/// A message of the view: protobuf, as the schema of its channel says.
struct ViewMessage {
  std::size_t channel = 0;  ///< index in ViewMessages::channels()
  GpsTime time{};
  std::string bytes;
};

/// Makes the messages that people look at, in Foxglove's public schemas: those of view.mcap and those of the live
/// feed. Reads no clock: the same calls give the same messages. Time stamps are UTC, as Foxglove expects.
///
/// | topic | message | frame |
/// |---|---|---|
/// | /cloud | foxglove.PointCloud: the fields of core/point_fields.hpp that have a name for the view | enu |
/// | /pose | foxglove.PoseInFrame: Body in Enu | enu |
/// | /tf | foxglove.FrameTransform: what moves | enu to body, enu to antenna |
/// | /tf_static | foxglove.FrameTransforms: what is mounted, once | body to scanner/NAME and head, head to lens/NAME |
/// | /fix | foxglove.LocationFix: height above the ellipsoid | antenna |
/// | /image/NAME | foxglove.CompressedImage: a reduced JPEG of the camera NAME | lens/NAME if it has one lens, or head
/// | | /camera/NAME | foxglove.CameraCalibration: the lens NAME in the reduced image of its camera | lens/NAME | | /log
/// | foxglove.Log: faults, clocks and the operator's marks | | | /health | foxglove.Log: what is wrong with which
/// sensor, or is no longer | |
///
/// Every frame has a way to enu. The rig does not say where the antenna is: its frame is where the fix is, with the
/// axes of enu.
///
/// Thread safety: none; one thread calls all functions.
class ViewMessages {
 public:
  struct Config {
    std::uint32_t keep_every = 10;                                ///< every n-th point is shown, 1 or more
    nanoseconds cloud_interval = std::chrono::milliseconds(500);  ///< time that one message of points spans
    nanoseconds pose_interval = std::chrono::milliseconds(100);   ///< shortest time between two poses
    nanoseconds image_interval = std::chrono::seconds(1);         ///< shortest time between two images of one camera
    int image_longest_px = 2048;                                  ///< 16 ... 16384
    int jpeg_quality = 85;                                        ///< 1 ... 100
    std::string validate() const;
  };
  enum class Level { Debug = 1, Info, Warning, Error };  ///< the numbers of foxglove.Log.Level

  /// `origin` is the origin of the frame enu. `config.validate()` must be empty.
  ViewMessages(const Geodetic& origin, ViewRig rig, const Config& config);

  /// The channels of all messages so far. A message may be the first of a new channel, which then is the last.
  const std::vector<ViewChannel>& channels() const { return channels_; }

  // Each function returns the messages that the product gives, which may be none.

  /// A message of points comes when its points span Config::cloud_interval.
  std::vector<ViewMessage> make(const CloudBlock& block);
  /// Returns the points that wait for a message.
  std::vector<ViewMessage> make_rest_of_cloud();
  std::vector<ViewMessage> make(const InsSolution& solution);
  std::vector<ViewMessage> make(const GnssFix& fix);
  /// Returns true if an image of this camera and time would be shown: it is complete, and the last one is old enough.
  bool wants(const Exposure& exposure, const std::string& camera) const;
  /// `camera` is the rig's name for the camera. Error: Invalid if the image's bytes do not fit its size.
  Result<std::vector<ViewMessage>> make(const Exposure& exposure, const std::string& camera);
  /// Makes a line of the log. `who` is the name of its sensor.
  std::vector<ViewMessage> make_log(GpsTime time, Level level, const std::string& who, const std::string& text);
  /// Makes a change of the health of a sensor or of the drive.
  std::vector<ViewMessage> make_health(GpsTime time, Level level, const std::string& who, const std::string& text);

 private:
  enum Channel : std::size_t { kCloud = 0, kPose, kTransform, kStatic, kFix, kLog, kHealth };
  ViewMessage message(std::size_t channel, GpsTime time, const google::protobuf::Message& message) const;
  ViewMessage static_frames(GpsTime time) const;
  ViewMessage calibration(const ViewLens& lens, GpsTime time, const Image& image, int width, int height);
  std::size_t channel(const std::string& topic, const google::protobuf::Message& type);
  std::vector<ViewMessage> line(Channel channel, GpsTime time, Level level, const std::string& who,
                                const std::string& text) const;

  const Geodetic origin_;
  const Transform<Enu, Ecef> T_enu_ecef_;
  const ViewRig rig_;
  const Config config_;
  std::vector<ViewChannel> channels_;
  std::map<std::string, std::size_t> by_topic_;
  std::string points_;  // packed points that wait for a message
  GpsTime cloud_start_{};
  std::uint64_t points_seen_ = 0;
  std::optional<GpsTime> last_pose_;
  bool has_static_ = false;
  std::map<std::string, GpsTime> last_images_;
};

}  // namespace hueline::storage
