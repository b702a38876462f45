#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "calibration/mask/vehicle_mask.hpp"
#include "fusion/colouring.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/rig_geometry.hpp"
#include "runtime/products.hpp"
#include "survey/some_moments.hpp"

namespace hueline::survey {

/// What the image of one lens showed, and what the cloud, coloured without this image, predicted for it.
struct PredictedView {
  std::uint32_t exposure = 0;
  std::uint8_t lens = 0;
  Eigen::Vector3d head_enu{0, 0, 0};  ///< place of the head at the exposure, m
  /// Those that the cloud has a point for, at most one for each pixel of the image.
  std::vector<calibration::PredictedPixel> pixels;
};

/// Judges the colouring without truth: it colours the drive once more without some of the exposures, projects the
/// coloured points into the images that were left out, and pairs the colours. Give it to a runtime::Pipeline as sink,
/// process the drive, then call finish(). Its memory does not grow with the drive. Its results depend on the products
/// alone, not on the number of threads. Thread safety: none; the thread of the pipeline calls it.
///
/// A point takes part if it was fired within Config::reach of the image's exposure. Which points the lens sees is
/// decided by two depth buffers. In a coarse one each point, coloured or not, covers a disc as wide as the gap between
/// two rings of a scanner; a point that lies farther behind it than 0.2 m and 5 % is hidden. Of the points that are
/// left, the nearest one of each pixel predicts the pixel.
class HeldOutViews : public runtime::ProductSink {
 public:
  struct Config {
    int every = 5;  ///< the images of one of so many moments are left out
    nanoseconds reach{1'000'000'000};
    double disc_deg = 1.0;  ///< radius of a point's disc in the coarse buffer
    int threads = 1;        ///< of the second colouring, the caller's included
    /// Whether a point predicts the pixels of all lenses whose images contain it, masks and hole aside. Otherwise only
    /// that of the lens which sees it best.
    bool every_lens = false;
  };
  using Sink = std::function<void(const PredictedView&)>;
  /// `colouring.validate()` and `rig.validate()` must be empty. `sink` gets the views, in order of time.
  HeldOutViews(const fusion::Colouring::Config& colouring, const fusion::RigGeometry& rig, const Config& config,
               Sink sink);

  void on_solution(const InsSolution& solution) override { colouring_.add(solution); }
  void on_exposure(const Exposure& exposure) override;
  void on_laser(const StampedLaserBatch& batch) override { colouring_.add(batch); }
  void on_watermark(GpsTime watermark) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;

  /// Ends the stream. Call it once, after the flush of the pipeline.
  void finish();

 private:
  struct Held {
    GpsTime time;
    double east, north, up;
    std::array<std::uint8_t, 3> colour;
    bool is_coloured;
  };
  struct Waiting {
    std::uint32_t exposure = 0;
    GpsTime mid{};
    SensorId camera{};
    Image image;
    bool is_settled = false;
    std::optional<Transform<CameraHead, Enu>> T_head_enu;
  };
  struct Projected {
    float x, y, distance;
    const Held* point;
  };
  void decide_ready(bool everything);
  void decide(const Waiting& exposure);
  void predict(const Waiting& exposure, const Eigen::Vector3d& head_enu, std::uint8_t lens,
               const std::vector<Projected>& points);

  Config config_;
  fusion::RigGeometry rig_;
  Sink sink_;
  fusion::HeadProjector projector_;
  SomeMoments some_;
  std::deque<Held> points_;
  std::deque<Waiting> waiting_;
  std::vector<float> nearest_;             // of each cell of the coarse buffer
  std::vector<const Projected*> winners_;  // of each pixel
  fusion::Colouring colouring_;            // gives its points to `points_`
};

}  // namespace hueline::survey
