#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "fusion/head_projector.hpp"
#include "fusion/rig_geometry.hpp"
#include "runtime/products.hpp"
#include "survey/some_moments.hpp"

namespace hueline::survey {

/// Finds how many outlines of near things, as a laser sees them, have no edge of the image beside them. With a wrong
/// mounting or a wrong time of the images, the share comes near to that of arbitrary places. It needs no truth. Give it
/// to a runtime::Pipeline as sink, process the drive, then call finish(). Its memory does not grow with the drive.
/// Thread safety: none; the thread of the pipeline calls it.
///
/// A depth edge is the nearer one of two neighbouring returns of a channel whose ranges differ by more than 0.5 m and
/// 10 % of the nearer, if at least five neighbouring returns on its side belong to one smooth thing. Edges within 60 ms
/// of an exposure are projected into its image. An image edge is a gradient of 5 grey levels a pixel. Arbitrary places
/// are the same pixels, shifted by four times the radius in each of four directions.
class DepthEdges : public runtime::ProductSink {
 public:
  struct Config {
    int every = 2;                    ///< one of so many moments is examined
    double radius_px = 3.0;           ///< an image edge within this distance belongs to a depth edge
    nanoseconds together{5'000'000};  ///< exposures nearer than this are one moment
  };
  struct Counts {
    std::uint64_t exposures = 0;                 ///< examined exposures with a pose
    std::uint64_t edges = 0, missed = 0;         ///< depth edges in an image, and those without an image edge
    std::uint64_t places = 0, missed_there = 0;  ///< the same of arbitrary places
  };
  /// `rig.validate()` must be empty.
  DepthEdges(const fusion::RigGeometry& rig, const Config& config);

  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return true; }
  void on_exposure(const Exposure& exposure) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// Returns the counts. Call it once, after the flush of the pipeline.
  Counts finish();

 private:
  struct Edge {
    GpsTime time;
    Eigen::Vector3d p_enu;
  };
  struct Waiting {
    std::uint32_t exposure = 0;
    GpsTime mid{};
    SensorId camera{};
    Image image;
    bool is_settled = false;
    std::optional<Transform<CameraHead, Enu>> T_head_enu;
  };
  struct Place {
    GpsTime time{};
    Eigen::Vector3f p_scanner = Eigen::Vector3f::Zero();
    float range_m = 0;  // 0: there is none
  };
  struct Channel {
    Place last;
    int smooth = 0;              // returns of a smooth thing so far, with `last`
    std::optional<Place> begin;  // the first of them, if a depth edge is before it that is not used yet
  };
  void decide(const Waiting& exposure);

  fusion::RigGeometry rig_;
  Config config_;
  fusion::HeadProjector projector_;
  SomeMoments some_;
  std::map<SensorId, std::vector<Channel>> channels_;
  std::deque<Edge> edges_;
  std::deque<Waiting> waiting_;
  Counts counts_;
};

}  // namespace hueline::survey
