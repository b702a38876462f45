#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/rig_geometry.hpp"

/// The panoramic sphere (docs/methods, equations 4 to 6). It relates a direction from the head's centre, the panorama
/// pixel, and the lens pixel that a stitcher would have put there. All classes are immutable and thread-safe.
namespace hueline::fusion {

/// Converts between directions and pixels of the equirectangular panorama. PanoramaShape says which column has azimuth
/// zero and which way the columns run. The polar angle is counted from the head's +z at the upper edge. Columns wrap to
/// [-0.5, width - 0.5).
class Panorama {
 public:
  /// `shape.validate()` must be empty.
  explicit Panorama(const PanoramaShape& shape) : shape_(shape) {}

  /// Returns the pixel of a direction of any length. Empty for a vector that is zero or not finite.
  std::optional<Eigen::Vector2d> pixel_of(const Vector<CameraHead>& direction) const;
  /// Returns the unit direction of a pixel. Rows beyond the poles are limited to them.
  Vector<CameraHead> direction_of(const Eigen::Vector2d& pixel) const;
  const PanoramaShape& shape() const { return shape_; }

 private:
  PanoramaShape shape_;
};

/// A pixel of one lens; `lens` is its index in CameraHeadGeometry::lenses.
struct LensPixel {
  int lens = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Converts between panorama pixels and lens pixels through the stitching sphere around the head's centre, for
/// measuring in the panorama.
class StitchedPanorama {
 public:
  /// `head.validate()` must be empty.
  explicit StitchedPanorama(const CameraHeadGeometry& head);

  /// Returns the lens pixel that a stitcher puts at this panorama pixel; the lens is the one with the nearest axis
  /// whose image contains the direction. Empty in the hole.
  std::optional<LensPixel> lens_pixel(const Eigen::Vector2d& panorama_pixel) const;
  /// Returns the pixel of a point of the head's frame in the lens that sees it best. Empty if no lens sees it.
  std::optional<LensPixel> lens_pixel_of_point(const Point<CameraHead>& p_head) const;
  /// Returns the pixel of a point of the head's frame in one lens. Empty if that lens's image does not contain it.
  std::optional<Eigen::Vector2d> project(int lens, const Point<CameraHead>& p_head) const;
  /// Returns where a stitcher puts this lens pixel. Empty beyond the lens's field of view.
  std::optional<Eigen::Vector2d> panorama_pixel(const LensPixel& pixel) const;
  const Panorama& panorama() const { return panorama_; }

 private:
  CameraHeadGeometry head_;
  Panorama panorama_;
  std::vector<CameraModel> models_;
};

}  // namespace hueline::fusion
