#include "sim/lens_optics.hpp"

#include <algorithm>

namespace hueline::sim {
namespace {

double kannala_brandt(double theta, const std::array<double, 5>& k) {
  const double t = theta * theta;
  return theta * (1 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
}
double kannala_brandt_slope(double theta, const std::array<double, 5>& k) {
  const double t = theta * theta;
  return 1 + t * (3 * k[0] + t * (5 * k[1] + t * (7 * k[2] + t * 9 * k[3])));
}

void brown(double x, double y, const std::array<double, 5>& d, double& out_x, double& out_y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  out_x = x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x);
  out_y = y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y;
}

constexpr double kFisheyeRatio = 2.79, kBrownRatio = 1.9;
constexpr double kFisheyeLimit = 1.45;  // rad; beyond the corner of every lens of the head
constexpr double kBrownLimit = 1.20;    // rad; the radial polynomial is monotone up to the tangent of it

}  // namespace

std::optional<Vec3> TrueLens::ray(double u, double v) const {
  const double xd = (u - centre_x) / focal_x, yd = (v - centre_y) / focal_y;
  if (model == LensModel::KannalaBrandt) {
    const double rd = std::hypot(xd, yd);
    if (rd < 1e-14) return Vec3{0, 0, 1};
    double theta = rd;
    for (int i = 0; i < 12; ++i) {
      const double step = (kannala_brandt(theta, distortion) - rd) / kannala_brandt_slope(theta, distortion);
      theta -= step;
      if (std::abs(step) < 1e-15) break;
    }
    if (!(theta >= 0 && theta <= theta_max)) return std::nullopt;
    const double s = std::sin(theta) / rd;
    return Vec3{xd * s, yd * s, std::cos(theta)};
  }
  double x = xd, y = yd;
  for (int i = 0; i < 25; ++i) {
    // Newton's method with the Jacobian of the model.
    const double r2 = x * x + y * y;
    const auto& d = distortion;
    const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double slope = 2 * (d[0] + r2 * (2 * d[1] + 3 * r2 * d[4]));  // 2 d radial / d(r^2)
    const double jxx = radial + x * x * slope + 2 * d[2] * y + 6 * d[3] * x;
    const double jxy = x * y * slope + 2 * d[2] * x + 2 * d[3] * y;
    const double jyy = radial + y * y * slope + 6 * d[2] * y + 2 * d[3] * x;
    double fx, fy;
    brown(x, y, d, fx, fy);
    fx -= xd;
    fy -= yd;
    const double det = jxx * jyy - jxy * jxy;
    const double dx = (jyy * fx - jxy * fy) / det, dy = (jxx * fy - jxy * fx) / det;
    x -= dx;
    y -= dy;
    if (std::abs(dx) + std::abs(dy) < 1e-15) break;
  }
  if (!(std::hypot(x, y) <= std::tan(theta_max))) return std::nullopt;
  return normalised({x, y, 1});
}

std::optional<TruePixel> TrueLens::project(Vec3 d) const {
  const double rho = std::hypot(d.x, d.y);
  const double theta = std::atan2(rho, d.z);
  if (!(theta <= theta_max)) return std::nullopt;
  double x, y;
  if (model == LensModel::KannalaBrandt) {
    const double scale = rho > 0 ? kannala_brandt(theta, distortion) / rho : 0.0;
    x = d.x * scale;
    y = d.y * scale;
  } else {
    brown(d.x / d.z, d.y / d.z, distortion, x, y);
  }
  return TruePixel{focal_x * x + centre_x, focal_y * y + centre_y};
}

TrueLens true_lens(const LensConfig& c, std::size_t index, LensModel model, int width, int height) {
  TrueLens lens;
  lens.model = model;
  lens.width = width;
  lens.height = height;
  const double sx = width / kRectifiedWidth, sy = height / kRectifiedHeight;
  const double ratio = model == LensModel::KannalaBrandt ? kFisheyeRatio : kBrownRatio;
  lens.focal_x = c.focal_px * ratio * sx;
  lens.focal_y = c.focal_px * ratio * sy;
  // Pixel x of the full image covers x - 0.5 .. x + 0.5. The edges of pixels scale; their centres follow from the
  // edges.
  lens.centre_x = (c.centre_x_px + 0.5) * sx - 0.5;
  lens.centre_y = (c.centre_y_px + 0.5) * sy - 0.5;
  const double own = 0.1 * (static_cast<double>(index % 6) - 2.5);
  if (model == LensModel::KannalaBrandt) {
    lens.distortion = {-0.0120 * (1 + own), -0.0026 * (1 - own), 0.0011 * (1 + own), -0.0002, 0};
    lens.theta_max = kFisheyeLimit;
  } else {
    lens.distortion = {-0.0300 * (1 + own), 0.0030 * (1 + own), 0.0004 * own, -0.0003, -0.0001};
    lens.theta_max = kBrownLimit;
  }
  lens.T_head_lens = {rotation_zyx(c.rot_x, c.rot_y, c.rot_z), {c.trans_x_m, c.trans_y_m, c.trans_z_m}};
  return lens;
}

std::vector<LensConfig> ladybug5_lenses() {
  return {
      {-2.151942, 1.566552, -2.151938, 0.061564, -0.000836, -0.000023, 457.004880, 1234.792624, 1016.188640},
      {-2.806324, 1.564830, 2.220612, 0.017904, -0.058481, -0.000240, 455.749056, 1261.008256, 1059.090144},
      {-1.815490, 1.566224, 1.958800, -0.050197, -0.035245, -0.000097, 449.293680, 1256.716912, 1041.352416},
      {2.320270, 1.569067, -1.446774, -0.048999, 0.036651, 0.000180, 455.332896, 1248.714400, 1029.461728},
      {-1.787905, 1.563776, -0.526615, 0.019728, 0.057911, 0.000180, 443.506608, 1264.146592, 1051.066080},
      {0.000197, 0.001386, -3.137179, 0.000320, -0.000344, 0.076026, 450.588672, 1266.315520, 1048.755936},
  };
}

}  // namespace hueline::sim
