#pragma once

#include <map>
#include <string>
#include <utility>

#include "core/coloured_point.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"
#include "storage/mcap_writer.hpp"

namespace google::protobuf {
class Message;
}

namespace hueline::storage {

/// Writes `view.mcap`, an MCAP file of Foxglove messages for people to look at. It opens in Foxglove Studio and in any
/// other reader of these public schemas. Reads no clock: the same calls give the same bytes. Time stamps are UTC, as
/// Foxglove expects.
///
/// | topic | message | frame |
/// |---|---|---|
/// | /cloud | foxglove.PointCloud: the fields of core/point_fields.hpp that have a name for the view | enu |
/// | /pose, /tf | foxglove.PoseInFrame, foxglove.FrameTransform: Body in Enu | enu, body |
/// | /fix | foxglove.LocationFix: height above the ellipsoid | antenna |
/// | /image/NAME | foxglove.CompressedImage: a reduced JPEG | NAME |
/// | /log | foxglove.Log: faults and clocks | |
/// | /health | foxglove.Log: what is wrong with which sensor, or is no longer | |
///
/// The first failed write is remembered and returned by all later calls.
/// Thread safety: none; one thread calls all functions.
class ViewWriter {
 public:
  struct Config {
    std::uint32_t keep_every = 10;                                ///< every n-th point is shown, 1 or more
    nanoseconds cloud_interval = std::chrono::milliseconds(500);  ///< time that one message of points spans
    nanoseconds pose_interval = std::chrono::milliseconds(100);   ///< shortest time between two poses
    nanoseconds image_interval = std::chrono::seconds(1);         ///< shortest time between two images of one camera
    int image_longest_px = 2048;                                  ///< 16 ... 16384
    int jpeg_quality = 85;                                        ///< 1 ... 100
    Compression compression = Compression::Zstd;
    IfExists if_exists = IfExists::Replace;
    std::string validate() const;
  };
  enum class Level { Debug = 1, Info, Warning, Error };  ///< the numbers of foxglove.Log.Level

  /// Creates the file. `origin` is the origin of the frame enu.
  static Result<ViewWriter> create(const std::filesystem::path& path, const Geodetic& origin, const Config& config);
  ViewWriter(ViewWriter&&) noexcept = default;
  ViewWriter& operator=(ViewWriter&&) = delete;

  /// Adds the points that are shown. A message is written when its points span Config::cloud_interval.
  Status append(const CloudBlock& block);
  Status append(const InsSolution& solution);
  Status append(const GnssFix& fix);
  /// `camera` is the rig's name for the camera. Incomplete images are left out.
  Status append(const Exposure& exposure, const std::string& camera);
  /// Adds a line of the log. `who` is the name of its sensor.
  Status append_log(GpsTime time, Level level, const std::string& who, const std::string& text);
  /// Adds a change of the health of a sensor or of the drive.
  Status append_health(GpsTime time, Level level, const std::string& who, const std::string& text);
  /// Writes what waits, with summary and indexes, and closes the file.
  Status close();

  std::uint64_t bytes_written() const { return mcap_.bytes_written(); }
  std::uint64_t messages_written() const { return mcap_.statistics().message_count; }

 private:
  enum Channel : std::uint16_t { kCloud = 1, kPose, kTransform, kFix, kLog, kHealth, kFirstImage };
  ViewWriter(McapWriter mcap, const Geodetic& origin, const Config& config);
  Status add_channels();
  Status write(std::uint16_t channel, GpsTime time, const google::protobuf::Message& message);
  Status write_log(Channel channel, GpsTime time, Level level, const std::string& who, const std::string& text);
  Status write_cloud();

  McapWriter mcap_;
  Geodetic origin_;
  Transform<Enu, Ecef> T_enu_ecef_;
  Config config_;
  std::string points_;  // packed points that wait to be written
  GpsTime cloud_start_{};
  std::uint64_t points_seen_ = 0;
  std::optional<GpsTime> last_pose_;
  std::uint16_t image_schema_ = 0;
  // channel, and time of the last image
  std::map<std::string, std::pair<std::uint16_t, std::optional<GpsTime>>> cameras_;
  std::map<std::uint16_t, std::uint32_t> sequences_;
};

}  // namespace hueline::storage
