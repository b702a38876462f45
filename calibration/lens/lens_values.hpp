#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

/// A lens in the form that the adjustments use. The centre of the first pixel is (0, 0); the lens frame has x to the
/// right, y down and z along the optical axis (docs/conventions.md). The formulas are those of OpenCV's projectPoints
/// and of its fisheye module. This is an implementation of its own; a test compares fusion's camera model with it.
namespace hueline::calibration {

/// The projection model of a lens.
enum class LensModel : std::uint8_t {
  Brown,          ///< plane lens: k1 k2 p1 p2 k3 (Brown 1971; Zhang 2000)
  KannalaBrandt,  ///< equidistant fisheye: k1..k4 at odd powers of the angle (Kannala and Brandt 2006)
};
/// Returns the name of a model in a rig file: "brown" or "kannala_brandt".
const char* name(LensModel model);

/// Number of parameters: focal length x and y, principal point x and y, distortion. KannalaBrandt does not use the last
/// one, which is 0.
constexpr int kLensParameters = 9;

/// The size, the model and the parameters of a lens.
struct LensValues {
  LensModel model = LensModel::Brown;
  std::uint32_t width = 0, height = 0;  ///< px
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d principal_point_px = Eigen::Vector2d::Zero();
  std::array<double, 5> distortion{};

  /// Returns the parameters as one array: focal lengths, principal point, distortion.
  std::array<double, kLensParameters> parameters() const;
  /// Sets the parameters from an array in the order of parameters().
  void set_parameters(const std::array<double, kLensParameters>& values);
  /// Returns the pixel of a point of the lens frame, or nothing for a point behind a plane lens or at the lens itself.
  /// The field of view is not limited: far outside the range of the fit, the polynomial may map several directions to
  /// one pixel.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_lens) const;
  /// Returns the unit direction in the lens frame that falls on a pixel, or nothing if the distortion cannot be
  /// inverted there.
  std::optional<Eigen::Vector3d> direction(const Eigen::Vector2d& pixel) const;
};

/// Returns the names of the parameters with units, in the order of LensValues::parameters. A model has
/// parameter_count() of them (Brown 9, KannalaBrandt 8).
std::array<std::string, kLensParameters> parameter_names(LensModel model);
/// Returns the number of parameters of a model.
constexpr int parameter_count(LensModel model) { return model == LensModel::Brown ? 9 : 8; }

/// Computes LensValues::project for any scalar type (Ceres' Jet). Returns false if the point has no pixel.
template <class T>
bool project_with(LensModel model, const T* values, const T* p_lens, T* pixel) {
  using std::atan2;
  using std::sqrt;
  const T& x = p_lens[0];
  const T& y = p_lens[1];
  const T& z = p_lens[2];
  const T* k = values + 4;
  T dx, dy;
  if (model == LensModel::Brown) {
    if (!(z > 1e-9)) return false;
    const T a = x / z, b = y / z, r2 = a * a + b * b;
    const T radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    dx = a * radial + 2.0 * k[2] * a * b + k[3] * (r2 + 2.0 * a * a);
    dy = b * radial + k[2] * (r2 + 2.0 * b * b) + 2.0 * k[3] * a * b;
  } else {
    const T across2 = x * x + y * y;
    if (!(across2 > 1e-24 * (z * z))) {
      if (!(z > 0.0)) return false;
      dx = x / z;
      dy = y / z;
    } else {
      const T across = sqrt(across2), angle = atan2(across, z), a2 = angle * angle;
      const T scale = angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / across;
      dx = x * scale;
      dy = y * scale;
    }
  }
  pixel[0] = values[0] * dx + values[2];
  pixel[1] = values[1] * dy + values[3];
  return true;
}

}  // namespace hueline::calibration
