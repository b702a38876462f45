#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/keys.hpp"
#include "sim/vec3.hpp"

/// True optics of each lens of the simulated head. Head frame: x forward (lens 0), y left, z up. Lens frame: x along
/// the image's columns, y along its rows, z along the optical axis. Pixel centres are whole numbers: the first pixel
/// covers -0.5 .. 0.5.
namespace hueline::sim {

/// The distortion models, as OpenCV writes them.
/// KannalaBrandt: theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
/// Brown: x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and y' likewise; the coefficients are k1
/// k2 p1 p2 k3.
enum class LensModel { KannalaBrandt, Brown };

/// One lens as a factory calibration states it: R_head_lens = Rz(rot_z) Ry(rot_y) Rx(rot_x), rad. With the values of a
/// Ladybug5, lens 0 looks along the head's +x axis, lenses 1 to 4 follow clockwise seen from above (72 deg each), and
/// lens 5 looks up. Each sensor lies on its side: the image's x axis points down in the world. Focal length and centre
/// are those of the rectified image of 2448 x 2048 pixels.
struct LensConfig {
  double rot_x = 0, rot_y = 0, rot_z = 0;
  double trans_x_m = 0, trans_y_m = 0, trans_z_m = 0;
  double focal_px = 450, centre_x_px = 1223.5, centre_y_px = 1023.5;

  void visit(Keys& keys);
};
/// Returns mounting and pinhole values of a real Ladybug5 (LD5-U3-51S5C-44), as its factory calibration states them.
std::vector<LensConfig> ladybug5_lenses();
constexpr double kRectifiedWidth = 2448, kRectifiedHeight = 2048;

/// A pixel's coordinates: u to the right, v down.
struct TruePixel {
  double u = 0, v = 0;
};

/// One lens at the simulated resolution.
struct TrueLens {
  LensModel model = LensModel::KannalaBrandt;
  int width = 0, height = 0;
  double focal_x = 0, focal_y = 0, centre_x = 0, centre_y = 0;  ///< pixels
  std::array<double, 5> distortion{};                           ///< KannalaBrandt: k1 .. k4; Brown: k1 k2 p1 p2 k3
  double theta_max = 0;  ///< largest angle off the axis that this lens images, rad
  Pose T_head_lens;

  /// Returns the direction (unit length) in the lens frame that falls on (u, v). Newton's method iterates to the last
  /// bits. Empty outside the range of the model.
  std::optional<Vec3> ray(double u, double v) const;
  /// Returns the pixel of a direction in the lens frame; empty beyond theta_max. The pixel may lie outside the image,
  /// see `contains()`.
  std::optional<TruePixel> project(Vec3 direction_lens) const;
  bool contains(TruePixel p) const { return p.u >= -0.5 && p.v >= -0.5 && p.u < width - 0.5 && p.v < height - 0.5; }
};

/// Returns a lens of a scenario, its values scaled from the rectified image to width x height. The fisheye's own focal
/// length is 2.79 times the rectified one (the real lens has 4.4 mm on pixels of 3.45 um), and its distortion is about
/// -3 % at the corner. The alternative Brown lens has 1.9 times and about -7 %. The coefficients differ a little from
/// lens to lens, as those of real lenses do.
TrueLens true_lens(const LensConfig& config, std::size_t index, LensModel model, int width, int height);

}  // namespace hueline::sim
