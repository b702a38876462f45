#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "fusion/camera_model.hpp"

/// Lenses of models that hueline does not compute with: the nearest lens of a model that it does.
namespace hueline::apps {

/// What a lens makes of an angle from its axis.
struct LensRadius {
  double plain = 0;      ///< radius in the plane on which the tangential distortion acts
  double distorted = 0;  ///< radius after the radial distortion; not a number where the lens sees nothing
};

/// A lens that is symmetric about its axis but for a tangential distortion.
struct OtherLens {
  std::uint32_t width = 0, height = 0;  ///< of its image, px
  Eigen::Vector2d focal_px, principal_point_px;
  std::function<LensRadius(double angle)> radius;
  double p1 = 0, p2 = 0;  ///< tangential distortion, as OpenCV has it
};

/// A lens of hueline's, and how far it is from the other in its image at most.
struct NearestLens {
  fusion::CameraIntrinsics intrinsics;
  double worst_px = 0;
};

/// Fits both lens models to the angles that `lens` has in its image, and returns the nearer one. Nothing if it has no
/// image.
std::optional<NearestLens> nearest_lens(const OtherLens& lens);

}  // namespace hueline::apps
