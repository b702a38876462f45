#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "fusion/depth_panorama.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/pixel_sampler.hpp"
#include "fusion/single_shot.hpp"

/// Joins the lens images of one moment to an equirectangular panorama.
namespace hueline::fusion {

class WorkerPool;
struct PanoramaEye;
struct PanoramaScene;

/// Which panorama is drawn.
struct PanoramaView {
  PanoramaShape shape;  ///< its stitching radius is not used
  /// Turns directions of the view into directions of the head. The view's axes are x forward, y left, z up.
  Eigen::Quaterniond R_head_view = Eigen::Quaterniond::Identity();
};

/// How the lens images meet.
enum class PanoramaBlend : std::uint8_t {
  /// Each pixel comes from the lens whose axis is nearest.
  None,
  /// Coarse differences of brightness fade over a wide band, details change over within a narrow one.
  Bands,
};

/// A lens image of few pixels: means of cells, without the vehicle, blurred.
struct LowImage {
  int width = 0, height = 0;
  float scale = 0;  ///< cells per pixel
  std::vector<float> pixels;
  /// Returns the colour at a pixel of the lens.
  Rgb at(float x, float y) const;
};

/// The images of one moment of the head.
struct HeadShot {
  std::span<const RawView> images;  ///< of PanoramaRenderer::cameras(); one without data is missing
  std::uint32_t blind = 0;          ///< one bit for each lens that must not be used
  /// From the head at the moment of the panorama to the head at the moment of these images.
  Transform<CameraHead, CameraHead> T_shot_head{};
  /// What PanoramaRenderer::low_images() made of `images`; empty: render() makes them.
  std::span<const LowImage> low{};
  /// How the head moves at the moment of these images, and how late each lens is against it: rows of a rolling shutter
  /// are sampled where they saw the place.
  HeadMotion motion{};
};

/// A panorama, and what is known about it.
struct RenderedPanorama {
  RgbRaster picture;
  std::vector<std::array<float, 3>> gains;  ///< by lens: the factor on each channel
  double seen_share = 0;                    ///< share of the pixels that a lens of the moment saw
  double filled_share = 0;                  ///< share of those that only a lens of another moment saw
};

/// Renders panoramas. It places each pixel's direction at the distance that a DepthPanorama gives, and samples each
/// lens where that lens sees this place. So lenses that do not share one centre show the same thing at the same pixel.
/// With one distance for all directions it is the stitcher of docs/methods, equations 4 to 6.
///
/// The result depends on neither the number of threads nor earlier calls. Thread safety: const functions may be called
/// by several threads, each with its own pool.
class PanoramaRenderer {
 public:
  struct Config {
    PanoramaBlend blend = PanoramaBlend::Bands;
    bool even_gains = true;  ///< lenses get factors that make them equally bright where they overlap
    /// Parts of the vehicle (masks and hole) are left out; other lenses may see behind them.
    bool hide_vehicle = true;
    std::array<std::uint8_t, 3> fill{64, 64, 64};  ///< colour of pixels that no lens sees
  };

  /// `head.validate()` must be empty.
  PanoramaRenderer(const CameraHeadGeometry& head, const Config& config);

  /// Returns the width of a panorama whose pixels are as wide as those in the middle of the finest lens.
  std::uint32_t natural_width() const;
  /// Returns the cameras whose images render() takes, in its order.
  const std::vector<SensorId>& cameras() const { return projector_.cameras(); }
  /// Returns one bit for each lens, set if its part of this camera's image is lost.
  std::uint32_t blind_lenses(SensorId camera, const std::vector<PixelRegion>& lost) const {
    return projector_.blind_lenses(camera, lost);
  }

  /// Returns whether a lens would show a place, outside the hole and the masks.
  bool is_seen(const Point<CameraHead>& p_head) const;

  /// Makes the small images that blending and the gains need, one for each lens; empty ones where the image is missing
  /// or nothing needs them. Whoever renders several panoramas from the same images keeps them.
  std::vector<LowImage> low_images(std::span<const RawView> images, WorkerPool& pool) const;

  /// Renders one panorama of the moment `shot`. What no lens sees below the head, because the vehicle hides it or it
  /// lies in the hole, comes from `others`, the first of them that sees it. `depth` holds the distances in the axes of
  /// `view`; null: everything lies on the stitching sphere of the head.
  RenderedPanorama render(const PanoramaView& view, const HeadShot& shot, std::span<const HeadShot> others,
                          const DepthPanorama* depth, WorkerPool& pool) const;

 private:
  PanoramaEye eye_of(const FloatLens& lens, const HeadShot& shot, int rank) const;
  static bool fits(const FloatLens& lens, const RawView& image);
  LowImage low_image(const FloatLens& lens, const RawView& image) const;
  void solve_gains(PanoramaScene& scene, WorkerPool& pool) const;

  CameraHeadGeometry head_;
  Config config_;
  HeadProjector projector_;
  std::vector<std::uint8_t> all_images_;              // one for each camera: its image is there
  std::vector<std::vector<std::uint8_t>> clearance_;  // by lens: pixels to the nearest masked one; empty: no mask
  std::vector<float> ramp_px_;                        // by lens
  float hole_cosine_;
};

}  // namespace hueline::fusion
