#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "fusion/georeference.hpp"
#include "fusion/object_measurement.hpp"
#include "fusion/panorama.hpp"
#include "runtime/products.hpp"
#include "survey/object_picks.hpp"
#include "survey/panorama_table.hpp"

namespace hueline::survey {

/// The result of one pick.
struct PickOutcome {
  ObjectPick pick;
  std::string lens;  ///< name of the lens; for a pick in the panorama, the lens that its pixel comes from
  Eigen::Vector2d lens_pixel = Eigen::Vector2d::Zero();  ///< the pick in the image of that lens; no lens: as picked
  std::optional<GpsTime> exposed;                   ///< middle of the exposure; empty: the drive has no such exposure
  Result<fusion::MeasuredObject> object = Error{};  ///< in the Enu frame of the drive, or why there is none
};

/// Measures objects that were picked in images, with the returns that a runtime::Pipeline stamps. Give it to the
/// pipeline as sink, process the drive, then call finish(). It keeps a point as long as an exposure that sees the point
/// can still come, so its memory does not grow with the drive. Thread safety: none; the thread of the pipeline calls
/// it.
class ObjectMeasuring : public runtime::ProductSink {
 public:
  struct Config {
    nanoseconds around{2'000'000'000};  ///< points fired so long before or after the exposure are used
    double pick_sigma_px = 0.5;         ///< sigma of each coordinate of a picked pixel
    double turn_sigma_deg = 0.02;  ///< sigma of the turn of a lens against the scanner, from its calibration record
    fusion::ObjectMeasurementConfig surface;
    /// Returns which value is outside which range; empty: none.
    std::string validate() const;
  };
  /// `config.validate()` must be empty. `rig` must outlive the object. Picks without a lens are pixels of the panorama
  /// of their exposure in `panoramas`, which shows what the centre of the head sees; they are not measured if it is not
  /// there, or if it is of another time than the drive's exposure. Without any panoramas they are pixels of the rig's
  /// panorama, which come from the lenses through the stitching sphere.
  ObjectMeasuring(const config::Rig& rig, const std::vector<ObjectPick>& picks, const Config& config,
                  const std::map<std::uint32_t, ListedPanorama>& panoramas = {});

  void on_origin(const Geodetic& origin) override { origin_ = origin; }
  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override;
  bool wants_settled_laser() const override { return true; }
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// Returns the results in the order of the picks. Call it once, after the flush of the pipeline.
  std::vector<PickOutcome> finish();
  /// Returns the origin of the Enu frame; empty: the drive has no pose, so no point could be placed.
  const std::optional<Geodetic>& origin() const { return origin_; }

 private:
  struct Looking {
    PickOutcome outcome;
    std::string why_not;                                        ///< empty so far as it can be measured
    int lens = -1;                                              ///< -1: the ray begins at the centre of the head
    Eigen::Vector3d direction_lens = Eigen::Vector3d::UnitZ();  ///< in the lens, or in the head
    std::optional<GpsTime> drawn;  ///< of a pick in a listed panorama: the time of that panorama
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
  void aim(Looking& looking, const std::map<std::uint32_t, ListedPanorama>& panoramas) const;
  void look(const Shot& shot, const Held& point);

  const config::Rig& rig_;
  Config config_;
  fusion::StitchedPanorama panorama_;
  std::vector<Looking> looking_;
  std::map<std::uint32_t, Shot> shots_;  // by exposure
  std::deque<Held> held_;
  fusion::GeoreferencedBatch placed_;
  std::optional<Geodetic> origin_;
};

}  // namespace hueline::survey
