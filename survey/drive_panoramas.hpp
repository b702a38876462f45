#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/rig.hpp"
#include "core/exposure_choice.hpp"
#include "core/geodesy.hpp"
#include "fusion/depth_panorama.hpp"
#include "fusion/georeference.hpp"
#include "fusion/panorama_renderer.hpp"
#include "fusion/worker_pool.hpp"
#include "runtime/products.hpp"

namespace hueline::survey {

/// How a panorama lies in the world.
enum class PanoramaOrientation : std::uint8_t {
  Heading,  ///< level, the direction of the head's x axis in the middle
  North,    ///< level, north in the middle
  Head,     ///< the head's own axes and the rig's panorama: pixels as in a stitched panorama of the rig's head
};

/// A panorama of one moment of a drive.
struct DrivePanorama {
  std::uint32_t exposure = 0;  ///< the lowest number of the moment's exposures
  GpsTime time{};              ///< middle of the exposure
  nanoseconds sigma{0};
  Geodetic origin;        ///< of the local level of the drive
  Point<Enu> centre_enu;  ///< the head's centre in the local level of the drive
  Geodetic centre;        ///< the same on the earth
  double sigma_horizontal_m = 0, sigma_up_m = 0;
  /// Heading (0 to 2 pi), pitch and roll of the head's x axis, and of the middle of the picture, in the local level at
  /// the head, rad.
  double head_heading = 0, heading = 0, pitch = 0, roll = 0;
  bool is_level = true;    ///< the pixels are gravity-aligned: the middle row is the horizon
  std::size_t points = 0;  ///< laser points that the distances come from
  double known_share = 0;  ///< share of the directions in which one of them lies
  fusion::PanoramaView view;
  fusion::RenderedPanorama rendered;
};

/// Makes panoramas of chosen exposures of a drive. Give it to a runtime::Pipeline as sink, process the drive, then call
/// finish(). A panorama is made as soon as the laser points around its exposure have come; they and the images of the
/// exposures that wait are all that is held. Thread safety: none; the thread of the pipeline calls it.
class DrivePanoramas : public runtime::ProductSink {
 public:
  struct Config {
    ExposureChoice choice;
    std::uint32_t width = 0;  ///< px, even; 0: what the lenses resolve. The height is half of it
    PanoramaOrientation orientation = PanoramaOrientation::Heading;
    /// What the vehicle hides comes from exposures before and after, from places near by. Needs use_depth.
    bool fill_hole = true;
    bool use_depth = true;              ///< false: everything lies on the rig's stitching sphere
    nanoseconds around{4'000'000'000};  ///< points fired so long before or after the exposure give the distances
    /// Returns nearer to their scanner give no distances if no lens could have shown them beside its masks: they are
    /// the vehicle's own.
    double own_vehicle_m = 2.5;
    std::size_t most_waiting_bytes = std::size_t{2}
                                     << 30;  ///< of images; beyond it the oldest exposure is not waited for
    int threads = 2;
    fusion::PanoramaRenderer::Config rendering;
    fusion::DepthPanorama::Config depth;
  };
  /// What became of the moments of the drive.
  struct Counts {
    std::uint64_t moments = 0;       ///< of the drive
    std::uint64_t chosen = 0;        ///< of them
    std::uint64_t made = 0;          ///< given to the user
    std::uint64_t without_time = 0;  ///< exposures that nothing stamped, of all
    std::uint64_t incomplete = 0;    ///< exposures whose image lacks parts, of all
    std::uint64_t without_pose = 0;  ///< chosen moments
    std::uint64_t early = 0;         ///< made without waiting for all points, because most_waiting_bytes was reached
  };
  /// Receives the panoramas in order of time. Returning false ends the making of further ones.
  using Use = std::function<bool(DrivePanorama&&)>;

  /// `rig` must outlive the object and have a head with lenses.
  DrivePanoramas(const config::Rig& rig, const Config& config, Use use);

  void on_origin(const Geodetic& origin) override { origin_ = origin; }
  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return config_.use_depth; }
  void on_exposure(const Exposure& exposure) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// Makes what still waits. Call it once, after the flush of the pipeline.
  void finish();
  const Counts& counts() const { return counts_; }
  /// Returns the first of the chosen numbers that is no exposure of the drive; nothing if there is none.
  std::optional<std::uint32_t> missing_number() const;
  /// Returns false once `use` has ended the making.
  bool wants_more() const { return wants_more_; }
  std::uint32_t width() const { return width_; }

 private:
  /// The exposures of a head that belong together.
  struct Moment {
    std::uint32_t exposure = 0;
    GpsTime time{};
    nanoseconds sigma{0};
    bool is_chosen = false;
    std::vector<Image> images;  // by camera of the renderer; without a buffer: missing
    std::size_t bytes = 0;
    std::uint32_t blind = 0;
    bool is_settled = false, is_done = false;
    std::optional<fusion::Pose> pose;
    bool has_motion = false;
    fusion::HeadMotion motion;
    std::vector<fusion::LowImage> low;  // of the images, once a panorama has needed them
  };
  /// Points of one batch, relative to its first one.
  struct Placed {
    GpsTime time;
    Eigen::Vector3d base_enu;
    std::vector<Eigen::Vector3f> points;
  };
  bool fills() const { return config_.fill_hole && config_.use_depth; }
  void find_motions(const fusion::Trajectory& trajectory, GpsTime reached);
  void make_ready(GpsTime reached);
  void make(std::size_t index);
  std::vector<std::size_t> neighbours(std::size_t index) const;
  std::vector<fusion::RawView> views(const Moment& moment) const;
  fusion::HeadShot shot_of(Moment& moment, const std::vector<fusion::RawView>& images);
  std::size_t gather(const Moment& moment, const Transform<Enu, CameraHead>& T_enu_view);
  void forget_front();

  const config::Rig& rig_;
  Config config_;
  Use use_;
  fusion::PanoramaRenderer renderer_;
  fusion::WorkerPool pool_;
  fusion::DepthPanorama depth_;
  std::uint32_t width_;
  std::optional<Geodetic> origin_;
  std::deque<Moment> moments_;
  std::deque<Placed> placed_;
  fusion::GeoreferencedBatch georeferenced_;
  std::set<std::uint32_t> exposures_;  // of the drive
  std::size_t waiting_bytes_ = 0;
  bool wants_more_ = true;
  Counts counts_;
};

}  // namespace hueline::survey
