#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/coloured_point.hpp"
#include "fusion/camera_model.hpp"
#include "fusion/pixel_sampler.hpp"

/// Colours the laser points of one moment from one image, without a drive: for `hueline colour` and to look at a
/// calibration. All functions are thread-safe.
namespace hueline::fusion {

/// Limits of the visibility test.
struct SingleShotConfig {
  bool test_visibility = true;  ///< points behind nearer ones get no colour
  /// Size of a cell in the image. A point is compared with the nearest points of its own cell and of the eight cells
  /// around it.
  double visibility_cell_px = 6.0;
  /// A point is hidden if it is farther than those by this share of their distance plus depth_margin_m. The share is so
  /// large because a road seen at a flat angle must not hide itself.
  double depth_share = 0.2;
  double depth_margin_m = 0.5;  ///< see depth_share
  std::string validate() const;
};

/// What the image shows of one point. The results are in the order of the points.
struct ShotPoint {
  float u = 0, v = 0;    ///< lens pixel, centres at whole numbers; valid if `is_in_image`
  float distance_m = 0;  ///< from the lens
  bool is_in_image = false;
  bool is_hidden = false;                    ///< it lies behind something nearer
  ColourState state = ColourState::Outside;  ///< Direct if it has a colour
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// Colours the points from the image. `image` contains the lens image from its first pixel on, with the size of
/// `model`. The result is empty only if there are no points.
std::vector<ShotPoint> colour_single_shot(std::span<const Point<Scanner>> points,
                                          const Transform<Lens, Scanner>& T_lens_scanner, const CameraModel& model,
                                          const RawView& image, const SingleShotConfig& config);

/// An image with three bytes for each pixel and no gaps between rows.
struct RgbRaster {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// How draw_points() draws.
struct PointDrawing {
  int size_px = 3;                    ///< side of the square that is drawn for a point; odd
  double near_m = 2.0, far_m = 80.0;  ///< range of the colours from red to violet, over the logarithm of the distance
  bool draw_hidden = false;
};

/// Draws the image in dimmed grey levels, and the points over it, coloured by their distance, the nearest on top.
RgbRaster draw_points(std::span<const ShotPoint> points, const RawView& image, const PointDrawing& drawing);

}  // namespace hueline::fusion
