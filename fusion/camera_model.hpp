#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/frames.hpp"
#include "core/keys.hpp"

/// Lens models with distortion. Pixel centres lie at whole numbers: (0, 0) is the centre of the first pixel, so the
/// image covers
/// [-0.5, width - 0.5) x [-0.5, height - 0.5). Angles in rad from the optical axis.
namespace hueline::fusion {

enum class LensModel : std::uint8_t {
  Brown,  ///< plane model, k1 k2 p1 p2 k3 (docs/methods equations 11, 13; order and formulas of OpenCV's projectPoints)
  KannalaBrandt,  ///< equidistant with k1..k4 in odd powers of the angle (docs/methods equations 12, 13; formulas of
                  ///< OpenCV's fisheye)
};

/// One lens image: size, model and its values. Calibration gives them.
struct CameraIntrinsics {
  LensModel model = LensModel::Brown;
  std::uint32_t width = 0, height = 0;  ///< px, of the lens image
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d principal_point_px = Eigen::Vector2d::Zero();  ///< pixel centres at whole numbers
  std::array<double, 5> distortion{};  ///< Brown k1 k2 p1 p2 k3; KannalaBrandt k1 k2 k3 k4, last unused
  /// rad; nothing farther from the axis is projected. Lowered to the range in which the model can be inverted.
  double max_angle = 1.9;

  void visit(Keys& keys);
  KeyError validate() const;
};

/// Direction or point of a lens <-> pixel, in double. Immutable, thread-safe. What lies behind the lens, beyond
/// `max_angle()` or beyond the range in which the distortion grows with the angle has no pixel: a polynomial would fold
/// it back into the image.
class CameraModel {
 public:
  /// `intrinsics.validate()` must be empty.
  explicit CameraModel(const CameraIntrinsics& intrinsics);

  /// The pixel of a point, also outside the image's rectangle (see in_image); empty beyond the field of view.
  std::optional<Eigen::Vector2d> project(const Point<Lens>& p_lens) const;
  /// The unit direction that falls on a pixel, by Newton's method to 1e-12 of the tangent or angle; empty beyond the
  /// field of view.
  std::optional<Vector<Lens>> unproject(const Eigen::Vector2d& pixel) const;
  /// True if `pixel` is at least `border_px` inside the outermost pixel centres.
  bool in_image(const Eigen::Vector2d& pixel, double border_px = 0.0) const;

  /// rad: CameraIntrinsics::max_angle or the end of the invertible range, whichever is smaller.
  double max_angle() const { return max_angle_; }
  const CameraIntrinsics& intrinsics() const { return intrinsics_; }

 private:
  struct Distorted {
    Eigen::Vector2d xy;
    Eigen::Matrix2d jacobian;
  };
  Distorted distort_brown(const Eigen::Vector2d& xy) const;
  double radial_limit_brown() const;
  double distort_angle(double angle) const;
  double distort_angle_slope(double angle) const;

  CameraIntrinsics intrinsics_;
  double max_angle_ = 0;
};

}  // namespace hueline::fusion
