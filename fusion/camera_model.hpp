#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/frames.hpp"
#include "core/keys.hpp"

/// Lens models with distortion.
///
/// Pixel centres have whole numbers: (0, 0) is the centre of the first pixel, so an image covers
/// [-0.5, width - 0.5) x [-0.5, height - 0.5). Angles are in rad from the optical axis.
namespace hueline::fusion {

/// The formulas of a lens.
enum class LensModel : std::uint8_t {
  /// A plane model with k1 k2 p1 p2 k3 (docs/methods, equations 11 and 13). Order and formulas are those of OpenCV's
  /// projectPoints.
  Brown,
  /// An equidistant model with k1..k4 at odd powers of the angle (docs/methods, equations 12 and 13). The formulas are
  /// those of OpenCV's fisheye.
  KannalaBrandt,
};

/// The size, model and parameters of one lens image. They come from calibration.
struct CameraIntrinsics {
  LensModel model = LensModel::Brown;
  std::uint32_t width = 0, height = 0;  ///< size of the lens image, px
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d principal_point_px = Eigen::Vector2d::Zero();  ///< pixel centres have whole numbers
  /// Brown: k1 k2 p1 p2 k3. KannalaBrandt: k1 k2 k3 k4; the last is not used.
  std::array<double, 5> distortion{};
  /// Largest angle that is projected, rad. CameraModel lowers it to the range in which the model can be inverted.
  double max_angle = 1.9;

  void visit(Keys& keys);
  KeyError validate() const;
};

/// Converts between directions or points of a lens and pixels, in double precision. Immutable and thread-safe. A
/// direction has no pixel behind the lens, beyond max_angle(), and beyond the range in which the distorted radius grows
/// with the angle; there a polynomial would fold it back into the image.
class CameraModel {
 public:
  /// `intrinsics.validate()` must be empty.
  explicit CameraModel(const CameraIntrinsics& intrinsics);

  /// Returns the pixel of a point, which may lie outside the image (see in_image()). Empty beyond the field of view.
  std::optional<Eigen::Vector2d> project(const Point<Lens>& p_lens) const;
  /// Returns the unit direction that a pixel shows, by Newton's method to 1e-12 of the tangent or angle. Empty beyond
  /// the field of view.
  std::optional<Vector<Lens>> unproject(const Eigen::Vector2d& pixel) const;
  /// Returns true if `pixel` lies at least `border_px` inside the outermost pixel centres.
  bool in_image(const Eigen::Vector2d& pixel, double border_px = 0.0) const;

  /// Returns the smaller of CameraIntrinsics::max_angle and the end of the invertible range, rad.
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
