#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/coloured_point.hpp"
#include "fusion/camera_model.hpp"
#include "fusion/pixel_sampler.hpp"

/// One image and the laser points of the same moment, without a drive: for `hueline colour` and for looking at a
/// calibration. Pure functions; reentrant.
namespace hueline::fusion {

struct SingleShotConfig {
  bool test_visibility = true;      ///< points behind nearer ones get no colour
  double visibility_cell_px = 6.0;  ///< a point is compared with the nearest ones of its own and the eight cells around
  double depth_share =
      0.2;  ///< hidden if farther than those by this share of their distance: a road seen flat is no obstacle
  double depth_margin_m = 0.5;  ///< and by this much
  std::string validate() const;
};

/// What the image says of one point; in the order of the points given.
struct ShotPoint {
  float u = 0, v = 0;    ///< lens pixel, centres at whole numbers; meaningful if `is_in_image`
  float distance_m = 0;  ///< from the lens
  bool is_in_image = false;
  bool is_hidden = false;                    ///< behind something nearer
  ColourState state = ColourState::Outside;  ///< Direct if coloured
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// `image` holds the lens image from its first pixel on; its size is `model`'s. Empty result only for no points.
std::vector<ShotPoint> colour_single_shot(std::span<const Point<Scanner>> points,
                                          const Transform<Lens, Scanner>& T_lens_scanner, const CameraModel& model,
                                          const RawView& image, const SingleShotConfig& config);

/// Three bytes a pixel, rows without gaps.
struct RgbRaster {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

struct PointDrawing {
  int size_px = 3;                    ///< edge of the square drawn for a point; odd
  double near_m = 2.0, far_m = 80.0;  ///< red to violet over the logarithm of the distance
  bool draw_hidden = false;
};

/// The image (as dimmed grey levels) with the points over it, coloured by distance, the nearest on top.
RgbRaster draw_points(std::span<const ShotPoint> points, const RawView& image, const PointDrawing& drawing);

}  // namespace hueline::fusion
