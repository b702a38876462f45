#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/rig_geometry.hpp"

/// The panoramic sphere (docs/methods equations 4 to 6): direction from the head's centre <-> panorama pixel <-> the
/// lens pixel that a stitcher would have put there. Everything immutable and thread-safe.
namespace hueline::fusion {

/// Direction <-> pixel of the equirectangular panorama. Zero azimuth and turning direction come from PanoramaShape; the
/// polar angle is counted from the head's +z at the upper edge. Columns wrap to [-0.5, width - 0.5).
class Panorama {
 public:
  /// `shape.validate()` must be empty.
  explicit Panorama(const PanoramaShape& shape) : shape_(shape) {}

  /// Any length but zero; empty for a zero or non-finite vector.
  std::optional<Eigen::Vector2d> pixel_of(const Vector<CameraHead>& direction) const;
  /// Unit direction; rows beyond the poles are clamped to them.
  Vector<CameraHead> direction_of(const Eigen::Vector2d& pixel) const;
  const PanoramaShape& shape() const { return shape_; }

 private:
  PanoramaShape shape_;
};

/// A pixel of one lens, by its index in CameraHeadGeometry::lenses.
struct LensPixel {
  int lens = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Measuring in the panorama: panorama pixel <-> lens pixel through the stitching sphere around the head's centre.
class StitchedPanorama {
 public:
  /// `head.validate()` must be empty.
  explicit StitchedPanorama(const CameraHeadGeometry& head);

  /// The lens (nearest axis whose image holds it) and pixel that show what a stitcher puts at this panorama pixel;
  /// empty in the hole.
  std::optional<LensPixel> lens_pixel(const Eigen::Vector2d& panorama_pixel) const;
  /// The pixel of a point of the head's frame in the lens that sees it best; empty if none does.
  std::optional<LensPixel> lens_pixel_of_point(const Point<CameraHead>& p_head) const;
  /// The pixel of a point of the head's frame in one lens; empty if that lens does not hold it.
  std::optional<Eigen::Vector2d> project(int lens, const Point<CameraHead>& p_head) const;
  /// Where a stitcher puts this lens pixel; empty beyond the lens's field of view.
  std::optional<Eigen::Vector2d> panorama_pixel(const LensPixel& pixel) const;
  const Panorama& panorama() const { return panorama_; }

 private:
  CameraHeadGeometry head_;
  Panorama panorama_;
  std::vector<CameraModel> models_;
};

}  // namespace hueline::fusion
