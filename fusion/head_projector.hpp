#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "fusion/direction_grid.hpp"
#include "fusion/panorama.hpp"
#include "fusion/pixel_mask.hpp"
#include "fusion/pixel_sampler.hpp"
#include "fusion/rig_geometry.hpp"

/// Finds the pixel that shows a point of the head's frame, in single precision and at high speed. The lens models use
/// only additions, multiplications, divisions and square roots, so the result has the same bits with every mathematics
/// library.
namespace hueline::fusion {

/// A pixel nearer to the border of a lens's image than this is none of those that sample_pixel() may be asked for, px.
constexpr float kLeastBorder_px = kPixelReach - 0.5f;

/// How often the row of a rolling shutter is corrected. Each step leaves a twentieth of the error or less at 50 km/h.
constexpr int kRowSteps = 3;

/// How a point's pixel is found.
enum class ColourMethod : std::uint8_t {
  /// Projects the point into the lens that sees it best, with the lens's distortion (docs/methods, equations 11 to 16).
  Lens,
  /// Projects the point onto the panoramic sphere, and from there to the lens pixel that a stitcher put there
  /// (docs/methods, equations 4 to 6).
  Panorama,
};

/// The pixel that shows a point.
struct Sight {
  std::uint8_t lens = 0;
  float x = 0, y = 0;   ///< lens pixel to sample
  float border_px = 0;  ///< distance of that pixel from the border of the lens image
  float distance = 0;   ///< of the point from the lens, m
};

/// The pixels that show places; one element for each place.
struct Sights {
  std::vector<std::uint8_t> lens;  ///< kNoLens: no pixel is known
  std::vector<float> x, y, border_px;
  void resize(std::size_t size) {
    lens.resize(size);
    x.resize(size);
    y.resize(size);
    border_px.resize(size);
  }
  void set(std::size_t index, const Sight& sight) {
    lens[index] = sight.lens;
    x[index] = sight.x;
    y[index] = sight.y;
    border_px[index] = sight.border_px;
  }
  /// Returns the sight of a place that has a pixel, without its distance.
  Sight at(std::size_t index) const { return {lens[index], x[index], y[index], border_px[index], 0}; }
};

/// How the head moves around the middle of an exposure, in its own axes. Rows of a rolling shutter, and lenses, that
/// are exposed earlier or later see the world from elsewhere.
struct HeadMotion {
  std::array<float, 3> velocity{};            ///< m/s
  std::array<float, 3> rate{};                ///< of the turning of standing places, rad/s
  std::array<float, kMostLenses> lateness{};  ///< of the middle of each lens's exposure, s
  /// Returns where the head sees a standing point after `dt` s, to the first order (docs/methods, equation 33).
  std::array<float, 3> place_after(float x, float y, float z, float dt) const {
    return {x + dt * (rate[1] * z - rate[2] * y - velocity[0]), y + dt * (rate[2] * x - rate[0] * z - velocity[1]),
            z + dt * (rate[0] * y - rate[1] * x - velocity[2])};
  }
};

/// The pixels at which one lens shows places; one element for each place. Beyond the field of view `border_px` is -1,
/// and the others mean nothing.
struct LensSights {
  std::vector<float> x, y, border_px;  ///< as in Sight
  std::vector<float> cosine;           ///< of the angle between the lens's axis and the line from the lens to the place
  void resize(std::size_t size) {
    for (auto* each : {&x, &y, &border_px, &cosine}) each->resize(size);
  }
};

/// One lens, prepared for calculation in single precision.
struct FloatLens {
  explicit FloatLens(const LensMount& mount);
  /// Finds the pixel of a point of the head's frame. Returns false beyond the field of view, and where the nearest
  /// pixel is nearer to the border than kPixelReach.
  bool project(float x, float y, float z, Sight& sight) const;
  /// The same for a head that moves: the pixel is where the lens sees the point when it is exposed, and a rolling
  /// shutter's pixel is the one whose row sees it.
  bool project(float x, float y, float z, const HeadMotion& motion, Sight& sight) const;
  /// Finds the pixels of many points of the head's frame. Uses the widest vector instructions that the processor has;
  /// the results have the bits of project(). Returns whether one of the points may lie in the field of view.
  bool project_each(std::span<const float> places_x, std::span<const float> places_y, std::span<const float> places_z,
                    LensSights& out) const;
  /// Returns how often a pixel has to be corrected for when it was exposed, for a lens that is late by `late` s.
  int steps_in_time(float late) const { return row_time != 0.0f ? kRowSteps : late != 0.0f ? 1 : 0; }
  /// Whether sample() would read masked pixels, or pixels beyond the lens's image, for this place. There the nearest
  /// pixel alone gives the colour (sample_pixel()), and it reads neither.
  bool is_at_margin(float x, float y) const {
    const float border = std::min(std::min(x, last_x - x), std::min(y, last_y - y));
    return border < static_cast<float>(kSampleReach) ||
           margin.covers(static_cast<std::uint32_t>(x + 0.5f), static_cast<std::uint32_t>(y + 0.5f));
  }
  /// Returns the square of a pixel's distance from the principal point; 1 at the farthest corner.
  float off_axis(float x, float y) const {
    const float dx = (x - centre_x) / focal_x, dy = (y - centre_y) / focal_y;
    return (dx * dx + dy * dy) * per_corner;
  }

  std::array<float, 3> axis;         ///< optical axis in the head's frame
  std::array<float, 9> R_lens_head;  ///< row by row
  std::array<float, 3> t_lens_head;
  float focal_x, focal_y, centre_x, centre_y, cosine_limit, last_x, last_y;
  float row_time = 0, middle_row = 0;  ///< s from one row to the next; the row to which the exposure's time belongs
  float per_corner = 0;                ///< 1 / (square of the farthest corner's distance from the principal point)
  bool is_plane;                       ///< the model is Brown
  std::array<float, 5> distortion;
  /// For KannalaBrandt: (distorted angle) / sin(angle) as a polynomial in the cosine of the angle, mapped to [-1, 1].
  std::vector<float> series;
  float series_scale = 0, series_shift = 0;
  std::uint8_t index = 0;
  std::size_t camera = 0;  ///< index in HeadProjector::cameras()
  std::uint32_t x_offset, y_offset, width, height;
  PixelMask mask;    ///< pixels that give no colour: masked ones, and those whose sample_pixel() reads a masked one
  PixelMask margin;  ///< these, and pixels whose sample() reads a masked one
  /// Returns the largest difference between project() and CameraModel over a grid of directions, px.
  double largest_error_px(const CameraModel& model) const;
};

/// All lenses of a head. Immutable and thread-safe.
class HeadProjector {
 public:
  /// `head.validate()` must be empty.
  HeadProjector(const CameraHeadGeometry& head, ColourMethod method);

  /// Finds the lens that sees a point of the head's frame best, outside the hole and the masks. A lens sees nothing if
  /// its camera's image is missing (`has_image[camera]` is 0) or its bit in `blind` is set. Returns false if no lens
  /// sees the point.
  bool see(float x, float y, float z, const std::uint8_t* has_image, std::uint32_t blind, Sight& sight,
           const HeadMotion& motion = {}) const;
  /// Finds what see() finds for many places at once, where the lens whose axis is nearest shows a place. Other places,
  /// and all places with ColourMethod::Panorama, get kNoLens: see() has to be asked. Uses the widest vector
  /// instructions that the processor has; the results have the same bits with each of them.
  void see_each(const RelativeHead& head, const HeadMotion& motion, const RelativePlaces& places,
                const std::uint8_t* has_image, std::uint32_t blind, Sights& out) const;
  /// Whether a lens has a rolling shutter. If not, and no lens is late, motion has no effect.
  bool is_rolling() const;
  /// Returns one bit for each lens, set if the lens's pixels lie in a lost part of this camera's image.
  std::uint32_t blind_lenses(SensorId camera, const std::vector<PixelRegion>& lost) const;
  /// Calculates the panorama pixel of a point of the head's frame.
  void panorama_pixel(float x, float y, float z, float& u, float& v) const;

  const std::vector<FloatLens>& lenses() const { return lenses_; }
  /// Returns where each lens looks from; nothing with ColourMethod::Panorama, whose pixels are those of several lenses.
  std::span<const LensEye> eyes() const { return eyes_; }
  /// Returns the cameras that deliver the lens images, each once, in the order of the lenses.
  const std::vector<SensorId>& cameras() const { return cameras_; }
  ColourMethod method() const { return method_; }

 private:
  bool is_in_hole(float x, float y, float z) const;

  ColourMethod method_;
  PanoramaShape panorama_;
  float stitching_radius_, hole_cosine_;
  PixelMask panorama_mask_;
  std::vector<FloatLens> lenses_;
  std::vector<LensEye> eyes_;
  std::vector<SensorId> cameras_;
};

}  // namespace hueline::fusion
