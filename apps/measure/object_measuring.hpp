#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "apps/measure/object_picks.hpp"
#include "config/rig.hpp"
#include "fusion/object_measurement.hpp"
#include "fusion/panorama.hpp"
#include "runtime/products.hpp"

namespace hueline::apps {

/// What became of a pick.
struct PickOutcome {
  ObjectPick pick;
  std::string lens;  ///< whose pixel it is; of a panorama, what it leads to
  Eigen::Vector2d lens_pixel = Eigen::Vector2d::Zero();
  std::optional<GpsTime> exposed;                   ///< middle of the exposure; empty: there is no such exposure
  Result<fusion::MeasuredObject> object = Error{};  ///< in the local level of the drive, or why there is none
};

/// Measures picked objects by the points that leave the pipeline: a ProductSink. A point is held for as long as an
/// exposure that may look at it can still come, so memory does not grow with the drive. Thread-bound (the pipeline's).
class ObjectMeasuring : public runtime::ProductSink {
 public:
  struct Config {
    nanoseconds around{2'000'000'000};  ///< points fired so long before or after the exposure are used
    double pick_sigma_px = 0.5;         ///< of the picked pixel, each coordinate
    double turn_sigma_deg = 0.02;       ///< of a lens against the scanner: its calibration record says it
    fusion::ObjectMeasurementConfig surface;
    std::string validate() const;
  };
  /// `config.validate()` must be empty. `rig` must outlive it.
  ObjectMeasuring(const config::Rig& rig, const std::vector<ObjectPick>& picks, const Config& config);

  void on_origin(const Geodetic& origin) override { origin_ = origin; }
  void on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// After the pipeline's flush: every pick in its order.
  std::vector<PickOutcome> finish();
  /// Of the local level; empty where nothing was placed.
  const std::optional<Geodetic>& origin() const { return origin_; }

 private:
  struct Looking {
    PickOutcome outcome;
    std::string why_not;  ///< empty so far as it can be measured
    int lens = -1;
    Eigen::Vector3d direction_lens = Eigen::Vector3d::UnitZ();
    fusion::PickedRay ray;
    std::vector<fusion::SurfacePoint> points;
  };
  /// All picks of one exposure.
  struct Shot {
    std::optional<GpsTime> exposed;    ///< once its pose is settled
    std::vector<std::size_t> looking;  ///< into looking_
  };
  struct Held {
    GpsTime time;
    Eigen::Vector3d p_enu, from_enu;  // the point; the scanner that fired
    float sigma_m;
  };
  void aim(Looking& looking) const;
  void look(const Shot& shot, const Held& point);

  const config::Rig& rig_;
  Config config_;
  fusion::StitchedPanorama panorama_;
  std::vector<Looking> looking_;
  std::map<std::uint32_t, Shot> shots_;  // by exposure
  std::deque<Held> held_;
  std::optional<Geodetic> origin_;
};

}  // namespace hueline::apps
