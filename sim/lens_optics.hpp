#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/keys.hpp"
#include "sim/vec3.hpp"

/// True optics of each lens of the simulated head. Head frame: x forward (lens 0), y left, z up. Lens frame: x along
/// the image's columns, y along its rows, z along the optical axis. Pixel centres at whole numbers: the first pixel
/// covers -0.5 .. 0.5.
namespace hueline::sim {

/// Both as OpenCV writes them. KannalaBrandt: theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
/// Brown: x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), y' likewise; coefficients k1 k2 p1 p2
/// k3.
enum class LensModel { KannalaBrandt, Brown };

/// One lens as a factory calibration states it: R_head_lens = Rz(rot_z) Ry(rot_y) Rx(rot_x), rad. With a Ladybug5's
/// values lens 0 looks along head +x, 1 to 4 follow clockwise seen from above (72 deg each), 5 looks up; each sensor
/// lies on its side: the image's x axis points down in the world. focal_px and centre: of the 2448 x 2048 rectified
/// image.
struct LensConfig {
  double rot_x = 0, rot_y = 0, rot_z = 0;
  double trans_x_m = 0, trans_y_m = 0, trans_z_m = 0;
  double focal_px = 450, centre_x_px = 1223.5, centre_y_px = 1023.5;

  void visit(Keys& keys);
};
/// Mounting and pinhole values of a real Ladybug5 (LD5-U3-51S5C-44), as its factory calibration states them.
std::vector<LensConfig> ladybug5_lenses();
constexpr double kRectifiedWidth = 2448, kRectifiedHeight = 2048;

struct TruePixel {
  double u = 0, v = 0;
};

/// One lens at the simulated resolution.
struct TrueLens {
  LensModel model = LensModel::KannalaBrandt;
  int width = 0, height = 0;
  double focal_x = 0, focal_y = 0, centre_x = 0, centre_y = 0;  ///< px
  std::array<double, 5> distortion{};                           ///< KannalaBrandt: k1..k4; Brown: k1 k2 p1 p2 k3
  double theta_max = 0;  ///< rad: the largest angle off the axis that this lens images
  Pose T_head_lens;

  /// Direction in the lens frame that falls on (u, v): unit length. Newton to the last bits; empty outside the model's
  /// range.
  std::optional<Vec3> ray(double u, double v) const;
  /// Pixel of a direction in the lens frame; empty beyond theta_max. May lie outside the image: see contains().
  std::optional<TruePixel> project(Vec3 direction_lens) const;
  bool contains(TruePixel p) const { return p.u >= -0.5 && p.v >= -0.5 && p.u < width - 0.5 && p.v < height - 0.5; }
};

/// The lens of a scenario, its values scaled from the rectified image to lens_width x lens_height. The fisheye's own
/// focal length is 2.79 x the rectified one (real lens: 4.4 mm on 3.45 um pixels), its distortion about -3 % at the
/// corner; the alternative Brown lens has 1.9 x and about -7 %. Each lens's coefficients differ a little, as real ones
/// do.
TrueLens true_lens(const LensConfig& config, std::size_t index, LensModel model, int width, int height);

}  // namespace hueline::sim
