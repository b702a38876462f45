#include "fusion/panorama.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/portable_math.hpp"

namespace hueline::fusion {
using std::numbers::pi;

std::optional<Eigen::Vector2d> Panorama::pixel_of(const Vector<CameraHead>& direction) const {
  const Eigen::Vector3d& d = direction.xyz;
  const double length = d.norm();
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  const double azimuth = portable::atan2(d.y(), d.x());  // anticlockwise from forward, seen from above
  const double polar = portable::atan2(portable::hypot(d.x(), d.y()), d.z());
  const double width = shape_.width;
  double u = shape_.forward() + (shape_.is_clockwise ? -azimuth : azimuth) * width / (2.0 * pi);
  u -= width * std::floor((u + 0.5) / width);
  if (u >= width - 0.5) u -= width;  // rounding of a tiny negative number
  return Eigen::Vector2d(u, polar * shape_.height / pi - 0.5);
}

Vector<CameraHead> Panorama::direction_of(const Eigen::Vector2d& pixel) const {
  const double turned = (pixel.x() - shape_.forward()) * 2.0 * pi / shape_.width;
  const double azimuth = shape_.is_clockwise ? -turned : turned;
  const double polar = std::clamp((pixel.y() + 0.5) * pi / shape_.height, 0.0, pi);
  return {{portable::sin(polar) * portable::cos(azimuth), portable::sin(polar) * portable::sin(azimuth),
           portable::cos(polar)}};
}

StitchedPanorama::StitchedPanorama(const CameraHeadGeometry& head) : head_(head), panorama_(head.panorama) {
  for (const LensMount& lens : head_.lenses) models_.emplace_back(lens.intrinsics);
}

std::optional<Eigen::Vector2d> StitchedPanorama::project(int lens, const Point<CameraHead>& p_head) const {
  const auto index = static_cast<std::size_t>(lens);
  const auto pixel = models_[index].project(head_.lenses[index].T_head_lens.inverse() * p_head);
  if (!pixel || !models_[index].in_image(*pixel)) return std::nullopt;
  return pixel;
}

std::optional<LensPixel> StitchedPanorama::lens_pixel_of_point(const Point<CameraHead>& p_head) const {
  std::optional<LensPixel> best;
  double best_cosine = -2.0;
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const double cosine =
        (head_.lenses[i].T_head_lens.rotation * Eigen::Vector3d::UnitZ()).dot(p_head.xyz) / p_head.xyz.norm();
    if (!(cosine > best_cosine)) continue;
    if (const auto pixel = project(static_cast<int>(i), p_head)) {
      best = LensPixel{static_cast<int>(i), *pixel};
      best_cosine = cosine;
    }
  }
  return best;
}

std::optional<LensPixel> StitchedPanorama::lens_pixel(const Eigen::Vector2d& panorama_pixel) const {
  const Vector<CameraHead> direction = panorama_.direction_of(panorama_pixel);
  return lens_pixel_of_point({direction.xyz * head_.panorama.stitching_radius_m});
}

std::optional<Eigen::Vector2d> StitchedPanorama::panorama_pixel(const LensPixel& pixel) const {
  if (pixel.lens < 0 || static_cast<std::size_t>(pixel.lens) >= models_.size()) return std::nullopt;
  const auto index = static_cast<std::size_t>(pixel.lens);
  const auto ray_lens = models_[index].unproject(pixel.pixel);
  if (!ray_lens) return std::nullopt;
  const Eigen::Vector3d ray = (head_.lenses[index].T_head_lens * *ray_lens).xyz;
  const Eigen::Vector3d& centre = head_.lenses[index].T_head_lens.translation;
  // centre + s ray| = radius, outward. The lens lies inside the sphere (validate() checks it), so one root is positive.
  const double along = centre.dot(ray), radius = head_.panorama.stitching_radius_m;
  const double s = -along + std::sqrt(along * along + radius * radius - centre.squaredNorm());
  return panorama_.pixel_of({centre + s * ray});
}

}  // namespace hueline::fusion
