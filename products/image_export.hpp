#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/packet.hpp"
#include "core/stamped.hpp"
#include "fusion/rig_geometry.hpp"
#include "fusion/trajectory.hpp"
#include "fusion/worker_pool.hpp"
#include "products/image_tables.hpp"
#include "products/lens_picture.hpp"
#include "products/point_sample.hpp"
#include "products/seen_points.hpp"

namespace hueline::products {

/// Writes the lens images of a drive's exposures with tables of their poses, for reconstruction from images. Give it
/// exposures with their images as they come, then the same exposures once their poses are settled. Images are held in
/// between, at most `most_waiting_bytes`. The files do not depend on the number of threads.
/// Thread safety: none; one thread calls all functions.
class ImageExport {
 public:
  struct Config {
    LensPixels pixels = LensPixels::Recorded;
    bool is_png = false;                ///< PNG instead of JPEG
    int quality = 95;                   ///< of JPEG, 1 to 100
    std::size_t most_points = 200'000;  ///< of the sample of the cloud
    int threads = 2;
    std::string software;                                   ///< for the pictures' EXIF data
    std::size_t most_waiting_bytes = std::size_t{2} << 30;  ///< of images
  };
  struct Counts {
    std::uint64_t exposures = 0;     ///< that were given
    std::uint64_t pictures = 0;      ///< written
    std::uint64_t copied = 0;        ///< of them, JPEGs as received
    std::uint64_t without_time = 0;  ///< exposures that nothing stamped
    std::uint64_t incomplete = 0;    ///< exposures whose image lacks parts
    std::uint64_t without_pose = 0;  ///< exposures at whose time the trajectory has no pose
    std::uint64_t lost_lenses = 0;   ///< lens images of complete exposures in which a part could not be decoded
    std::uint64_t early = 0;         ///< exposures whose pose did not come before the memory was full
  };

  /// `folder` exists. `head` must outlive the object.
  ImageExport(const std::filesystem::path& folder, const fusion::CameraHeadGeometry& head,
              const storage::MapConfig& map, const Config& config);

  /// Takes a packet before the pipeline gets it. JPEGs of a camera with one lens are written as they were received, so
  /// they are held until their exposure comes; where that is impossible, the decoded image is compressed again.
  void add(const Packet& packet);
  /// Sets the origin of the local level of the drive. Call it before the first settled exposure.
  void set_origin(const Geodetic& origin) { origin_ = origin; }
  /// Takes an exposure with its image. Its index is its number in the names of files.
  void add(const Exposure& exposure);
  /// Takes points of the cloud: for the sample, and because they hide others.
  void add(const CloudBlock& block) {
    sample_.add(block);
    if (config_.most_points > 0) seen_points_.add(block);
  }
  /// Writes the pictures of an exposure that was added. Errors: those of the tables; Io. After an error nothing more is
  /// written.
  Status settle(const Exposure& exposure, const fusion::Trajectory& trajectory);
  /// Writes the ends of the tables. Errors: Io; an earlier error.
  Status finish();

  const Counts& counts() const { return counts_; }
  /// Returns why a table could not be written for this rig; the others were.
  const std::vector<std::string>& missing_tables() const { return missing_tables_; }

 private:
  struct Waiting {
    Exposure exposure;
    Buffer jpeg;  // the packet that holds it; empty: none
  };
  struct HeldPacket {
    SensorId sensor{};
    std::uint64_t sequence = 0;
    Buffer bytes;
  };
  bool copies_jpeg(SensorId camera) const;
  Status open_tables(GpsTime first);
  Status write(const Exposure& exposure, const Buffer& jpeg, const fusion::Pose& middle,
               const fusion::Trajectory& trajectory);

  std::filesystem::path folder_;
  const fusion::CameraHeadGeometry& head_;
  storage::MapConfig map_;
  Config config_;
  fusion::WorkerPool pool_;
  std::vector<LensPicture> pictures_;  // of the lenses of the head
  std::vector<PictureLens> lenses_;    // the same in the tables
  std::vector<std::unique_ptr<ImageTable>> tables_;
  std::vector<std::string> missing_tables_;
  std::optional<Geodetic> origin_;
  std::deque<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::deque<HeldPacket> packets_;
  std::size_t packet_bytes_ = 0;
  PointSample sample_;
  SeenPoints seen_points_;
  std::vector<TakenPicture> taken_;  // as given to the tables
  Counts counts_;
  Status status_;
};

}  // namespace hueline::products
