#include "fusion/head_projector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {
using std::numbers::pi;

constexpr int kSeriesTerms = 32;

/// Converts coefficients of Chebyshev polynomials of t to coefficients of powers of t.
std::vector<double> powers_from_chebyshev(const std::vector<double>& chebyshev) {
  std::vector<double> result(chebyshev.size(), 0.0), previous{1.0}, current{0.0, 1.0};
  for (std::size_t n = 0; n < chebyshev.size(); ++n) {
    const std::vector<double>& polynomial = n == 0 ? previous : current;
    for (std::size_t i = 0; i < polynomial.size(); ++i) result[i] += chebyshev[n] * polynomial[i];
    if (n >= 1) {
      std::vector<double> next(current.size() + 1, 0.0);
      for (std::size_t i = 0; i < current.size(); ++i) next[i + 1] += 2.0 * current[i];
      for (std::size_t i = 0; i < previous.size(); ++i) next[i] -= previous[i];
      previous = std::move(current);
      current = std::move(next);
    }
  }
  return result;
}

/// Fits (distorted angle) / sin(angle) over t in [-1, 1], with t = (cosine - middle) / half. The function is smooth at
/// angle 0, where angle and sine vanish together. So a short polynomial replaces the arc cosine, the square root and
/// the distortion.
std::vector<float> fit_series(const CameraIntrinsics& k, double cosine_limit, double focal_px) {
  const double middle = 0.5 * (1.0 + cosine_limit), half = 0.5 * (1.0 - cosine_limit);
  const auto value = [&](double t) {
    const double angle = portable::acos(std::clamp(middle + half * t, -1.0, 1.0)), a2 = angle * angle;
    const double ratio = angle < 1e-7 ? 1.0 : angle / portable::sin(angle);
    return ratio *
           (1.0 + a2 * (k.distortion[0] + a2 * (k.distortion[1] + a2 * (k.distortion[2] + a2 * k.distortion[3]))));
  };
  std::vector<double> chebyshev(kSeriesTerms, 0.0);
  for (int j = 0; j < kSeriesTerms; ++j) {
    const double phase = pi * (j + 0.5) / kSeriesTerms, f = value(portable::cos(phase));
    for (int n = 0; n < kSeriesTerms; ++n)
      chebyshev[static_cast<std::size_t>(n)] += (n == 0 ? 1.0 : 2.0) / kSeriesTerms * f * portable::cos(n * phase);
  }
  while (chebyshev.size() > 2 && std::abs(chebyshev.back()) * focal_px < 2e-5) chebyshev.pop_back();
  const std::vector<double> powers = powers_from_chebyshev(chebyshev);
  return {powers.begin(), powers.end()};
}

}  // namespace

FloatLens::FloatLens(const LensMount& mount)
    : mask(mount.masks, mount.intrinsics.width, mount.intrinsics.height, kPixelReach),
      margin(mount.masks, mount.intrinsics.width, mount.intrinsics.height, kSampleReach) {
  const CameraIntrinsics& k = mount.intrinsics;
  const CameraModel model(k);
  const Transform<Lens, CameraHead> T_lens_head = mount.T_head_lens.inverse();
  const Eigen::Matrix3d R = T_lens_head.rotation.toRotationMatrix();
  for (int i = 0; i < 9; ++i) R_lens_head[static_cast<std::size_t>(i)] = static_cast<float>(R(i / 3, i % 3));
  for (int i = 0; i < 3; ++i) {
    t_lens_head[static_cast<std::size_t>(i)] = static_cast<float>(T_lens_head.translation[i]);
    axis[static_cast<std::size_t>(i)] = static_cast<float>(R(2, i));
  }
  focal_x = static_cast<float>(k.focal_px.x());
  focal_y = static_cast<float>(k.focal_px.y());
  centre_x = static_cast<float>(k.principal_point_px.x());
  centre_y = static_cast<float>(k.principal_point_px.y());
  cosine_limit = static_cast<float>(portable::cos(model.max_angle()));
  last_x = static_cast<float>(k.width - 1u);
  last_y = static_cast<float>(k.height - 1u);
  const float wide = std::max(centre_x, last_x - centre_x) / focal_x,
              high = std::max(centre_y, last_y - centre_y) / focal_y;
  per_corner = 1 / (wide * wide + high * high);
  row_time = static_cast<float>(to_seconds(mount.row_time));
  middle_row = 0.5f * last_y;
  is_plane = k.model == LensModel::Brown;
  for (std::size_t i = 0; i < 5; ++i) distortion[i] = static_cast<float>(k.distortion[i]);
  x_offset = mount.x_offset;
  y_offset = mount.y_offset;
  width = k.width;
  height = k.height;
  if (!is_plane) {
    series = fit_series(k, cosine_limit, k.focal_px.maxCoeff());
    series_scale = static_cast<float>(2.0 / (1.0 - cosine_limit));
    series_shift = static_cast<float>(-(1.0 + cosine_limit) / (1.0 - cosine_limit));
  }
}

bool FloatLens::project(float x, float y, float z, Sight& sight) const {
  const auto& R = R_lens_head;
  const float lx = R[0] * x + R[1] * y + R[2] * z + t_lens_head[0];
  const float ly = R[3] * x + R[4] * y + R[5] * z + t_lens_head[1];
  const float lz = R[6] * x + R[7] * y + R[8] * z + t_lens_head[2];
  const float distance = std::sqrt(lx * lx + ly * ly + lz * lz);
  if (!(lz >= cosine_limit * distance) || !(distance > 0.0f)) return false;
  float dx, dy;
  if (is_plane) {
    const float inverse = 1.0f / lz, px = lx * inverse, py = ly * inverse, r2 = px * px + py * py;
    const auto& [k1, k2, p1, p2, k3] = distortion;
    const float radial = 1.0f + r2 * (k1 + r2 * (k2 + r2 * k3)), cross = 2.0f * px * py;
    dx = px * radial + p1 * cross + p2 * (r2 + 2.0f * px * px);
    dy = py * radial + p2 * cross + p1 * (r2 + 2.0f * py * py);
  } else {
    const float inverse = 1.0f / distance, t = lz * inverse * series_scale + series_shift;
    float ratio = 0.0f;
    for (std::size_t i = series.size(); i-- > 0;) ratio = ratio * t + series[i];
    dx = lx * inverse * ratio;
    dy = ly * inverse * ratio;
  }
  sight.x = dx * focal_x + centre_x;
  sight.y = dy * focal_y + centre_y;
  sight.border_px = std::min(std::min(sight.x, last_x - sight.x), std::min(sight.y, last_y - sight.y));
  sight.lens = index;
  sight.distance = distance;
  return sight.border_px > kLeastBorder_px;
}

bool FloatLens::project(float x, float y, float z, const HeadMotion& motion, Sight& sight) const {
  if (!project(x, y, z, sight)) return false;
  const float late = motion.lateness[index];
  for (int step = steps_in_time(late); step > 0; --step) {
    const auto [mx, my, mz] = motion.place_after(x, y, z, late + row_time * (sight.y - middle_row));
    if (!project(mx, my, mz, sight)) return false;
  }
  return true;
}

double FloatLens::largest_error_px(const CameraModel& model) const {
  double largest = 0;
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> R(R_lens_head.data());
  const Eigen::Map<const Eigen::Vector3f> t(t_lens_head.data());
  for (int i = 1; i < 60; ++i) {
    for (int j = 0; j < 24; ++j) {
      const double angle = model.max_angle() * i / 60.0, turn = 2.0 * pi * j / 24.0;
      const Eigen::Vector3d p_lens(10.0 * portable::sin(angle) * portable::cos(turn),
                                   10.0 * portable::sin(angle) * portable::sin(turn), 10.0 * portable::cos(angle));
      const Eigen::Vector3f p_head = R.transpose() * (p_lens.cast<float>() - t);
      Sight sight;
      if (!project(p_head.x(), p_head.y(), p_head.z(), sight)) continue;
      const auto exact = model.project({p_lens});
      if (!exact) continue;
      largest = std::max(largest, portable::hypot(sight.x - exact->x(), sight.y - exact->y()));
    }
  }
  return largest;
}

HeadProjector::HeadProjector(const CameraHeadGeometry& head, ColourMethod method)
    : method_(method),
      panorama_(head.panorama),
      stitching_radius_(static_cast<float>(head.panorama.stitching_radius_m)),
      hole_cosine_(head.nadir_half_angle > 0 ? static_cast<float>(portable::cos(head.nadir_half_angle)) : 2.0f) {
  if (method == ColourMethod::Panorama) {
    panorama_mask_ = PixelMask(head.panorama_masks, panorama_.width, panorama_.height, 0);
  }
  for (const LensMount& mount : head.lenses) {
    FloatLens lens(mount);
    lens.index = static_cast<std::uint8_t>(lenses_.size());
    const auto known = std::find(cameras_.begin(), cameras_.end(), mount.camera);
    lens.camera = static_cast<std::size_t>(known - cameras_.begin());
    if (known == cameras_.end()) cameras_.push_back(mount.camera);
    if (method == ColourMethod::Lens) {
      const Eigen::Vector3f centre = mount.T_head_lens.translation.cast<float>();
      eyes_.push_back({lens.axis, {centre.x(), centre.y(), centre.z()}});
    }
    lenses_.push_back(std::move(lens));
  }
}

bool HeadProjector::is_in_hole(float x, float y, float z) const {
  return -z >= hole_cosine_ * std::sqrt(x * x + y * y + z * z);
}

void HeadProjector::panorama_pixel(float x, float y, float z, float& u, float& v) const {
  const float width = static_cast<float>(panorama_.width);
  const auto azimuth = static_cast<float>(portable::atan2(y, x)),
             polar = static_cast<float>(portable::atan2(std::sqrt(x * x + y * y), z));
  u = static_cast<float>(panorama_.forward()) +
      (panorama_.is_clockwise ? -azimuth : azimuth) * (width / static_cast<float>(2.0 * pi));
  if (u < -0.5f) u += width;
  if (u >= width - 0.5f) u -= width;
  v = polar * (static_cast<float>(panorama_.height) / static_cast<float>(pi)) - 0.5f;
}

bool HeadProjector::see(float x, float y, float z, const std::uint8_t* has_image, std::uint32_t blind, Sight& sight,
                        const HeadMotion& motion) const {
  if (is_in_hole(x, y, z)) return false;
  if (method_ == ColourMethod::Panorama) {
    if (!panorama_mask_.is_empty()) {
      float u, v;
      panorama_pixel(x, y, z, u, v);
      const auto column = static_cast<std::uint32_t>(std::max(0.0f, u + 0.5f));
      const auto row = static_cast<std::uint32_t>(std::max(0.0f, v + 0.5f));
      if (panorama_mask_.covers(std::min(column, panorama_.width - 1), std::min(row, panorama_.height - 1)))
        return false;
    }
    const float onto_sphere = stitching_radius_ / std::sqrt(x * x + y * y + z * z);
    x *= onto_sphere;
    y *= onto_sphere;
    z *= onto_sphere;
  }
  // Tries the lenses in the order of the angle between their axis and the point, the nearest first. At most three
  // lenses overlap.
  std::uint32_t tried = blind;
  for (int attempt = 0; attempt < 3; ++attempt) {
    float best = -1e30f;
    const FloatLens* chosen = nullptr;
    for (const FloatLens& lens : lenses_) {
      const float along = lens.axis[0] * x + lens.axis[1] * y + lens.axis[2] * z;
      if (along > best && (tried >> lens.index & 1u) == 0) {
        best = along;
        chosen = &lens;
      }
    }
    if (chosen == nullptr) return false;
    tried |= 1u << chosen->index;
    if (has_image[chosen->camera] == 0 || !chosen->project(x, y, z, motion, sight)) continue;
    if (!chosen->mask.covers(static_cast<std::uint32_t>(sight.x + 0.5f), static_cast<std::uint32_t>(sight.y + 0.5f)))
      return true;
  }
  return false;
}

bool HeadProjector::is_rolling() const {
  return std::any_of(lenses_.begin(), lenses_.end(), [](const FloatLens& lens) { return lens.row_time != 0.0f; });
}

std::uint32_t HeadProjector::blind_lenses(SensorId camera, const std::vector<PixelRegion>& lost) const {
  std::uint32_t blind = 0;
  for (const FloatLens& lens : lenses_) {
    if (cameras_[lens.camera] != camera) continue;
    for (const PixelRegion& region : lost) {
      const bool is_beside = region.x >= lens.x_offset + lens.width || lens.x_offset >= region.x + region.width ||
                             region.y >= lens.y_offset + lens.height || lens.y_offset >= region.y + region.height;
      if (!is_beside) blind |= 1u << lens.index;
    }
  }
  return blind;
}

}  // namespace hueline::fusion
