#include "products/lens_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/portable_math.hpp"
#include "fusion/camera_model.hpp"

namespace hueline::products {
namespace {

using fusion::kSampleReach;

constexpr double kLeastCosine = 0.05;  // of the angle from the axis at which a picture shows points
/// Beyond this angle from the axis a pinhole's pixels show little and take much room, rad.
constexpr double kWidest = 70 * (std::numbers::pi / 180);

/// Returns the tangents of the angles up to which the lens fills a rectangle: left, top, right, bottom.
std::array<double, 4> filled_rectangle(const fusion::CameraIntrinsics& lens) {
  const fusion::CameraModel model(lens);
  const auto is_filled = [&](double x, double y) {
    const auto pixel = model.project(Point<Lens>{{x, y, 1}});
    return pixel && model.in_image(*pixel, kSampleReach + 0.1);
  };
  const auto reach = [&](double x, double y) {  // along one half axis
    double inside = 0, outside = portable::tan(kWidest);
    if (is_filled(x * outside, y * outside)) return outside;
    for (int i = 0; i < 40; ++i) {
      const double middle = (inside + outside) / 2;
      (is_filled(x * middle, y * middle) ? inside : outside) = middle;
    }
    return inside;
  };
  const std::array<double, 4> most{reach(-1, 0), reach(0, -1), reach(1, 0), reach(0, 1)};
  // All sides shrink by the same share until the border is filled.
  constexpr int kSteps = 64;
  const auto fills = [&](double share) {
    const double left = -share * most[0], top = -share * most[1], right = share * most[2], bottom = share * most[3];
    for (int i = 0; i <= kSteps; ++i) {
      const double t = static_cast<double>(i) / kSteps;
      const double x = left + t * (right - left), y = top + t * (bottom - top);
      if (!is_filled(x, top) || !is_filled(x, bottom) || !is_filled(left, y) || !is_filled(right, y)) return false;
    }
    return true;
  };
  double inside = 0, outside = 1;
  if (fills(1)) inside = 1;
  for (int i = 0; inside < 1 && i < 30; ++i) {
    const double middle = (inside + outside) / 2;
    (fills(middle) ? inside : outside) = middle;
  }
  return {inside * most[0], inside * most[1], inside * most[2], inside * most[3]};
}

fusion::CameraIntrinsics pinhole_of(const fusion::CameraIntrinsics& lens) {
  const auto [left, top, right, bottom] = filled_rectangle(lens);
  const double fx = lens.focal_px.x(), fy = lens.focal_px.y();
  fusion::CameraIntrinsics out;
  out.model = fusion::LensModel::Brown;
  out.focal_px = lens.focal_px;
  // Whole pixels inside the rectangle, so that no border pixel lacks a source.
  const double columns_left = std::floor(left * fx), rows_above = std::floor(top * fy);
  out.width = static_cast<std::uint32_t>(columns_left + std::floor(right * fx)) + 1;
  out.height = static_cast<std::uint32_t>(rows_above + std::floor(bottom * fy)) + 1;
  out.principal_point_px = {columns_left, rows_above};
  out.max_angle = std::numbers::pi / 2 * 0.98;
  return out;
}

std::uint8_t level(float value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

void put(const fusion::Rgb& colour, std::uint8_t* to) {
  to[0] = level(colour.red);
  to[1] = level(colour.green);
  to[2] = level(colour.blue);
}

}  // namespace

LensPicture::LensPicture(const fusion::LensMount& mount, LensPixels pixels)
    : mount_(mount),
      intrinsics_(pixels == LensPixels::Pinhole ? pinhole_of(mount.intrinsics) : mount.intrinsics),
      recorded_(mount.intrinsics),
      shown_(intrinsics_),
      mask_(mount.masks, mount.intrinsics.width, mount.intrinsics.height, fusion::kMixedReach) {
  if (pixels == LensPixels::Recorded) return;
  fusion::LensMount own = mount;
  own.T_head_lens = {};
  own.masks.clear();
  own.row_time = nanoseconds(0);
  source_.emplace(own);
}

std::optional<Eigen::Vector2d> LensPicture::pixel(const Point<Lens>& p_lens) const {
  if (p_lens.xyz.z() < kLeastCosine * p_lens.xyz.norm()) return std::nullopt;
  const auto source = recorded_.project(p_lens);
  if (!source || !recorded_.in_image(*source, kSampleReach) ||
      mask_.covers(static_cast<std::uint32_t>(source->x() + 0.5), static_cast<std::uint32_t>(source->y() + 0.5)))
    return std::nullopt;
  const auto shown = shown_.project(p_lens);
  return shown && shown_.in_image(*shown) ? shown : std::nullopt;
}

std::vector<std::uint8_t> LensPicture::render(const fusion::RawView& image) const {
  const std::uint32_t wide = mount_.intrinsics.width, high = mount_.intrinsics.height;
  if (!image.data || image.width < mount_.x_offset + wide || image.height < mount_.y_offset + high) return {};
  std::vector<std::uint8_t> out(std::size_t{3} * intrinsics_.width * intrinsics_.height);
  std::uint8_t* to = out.data();
  if (source_) {
    const auto fx = static_cast<float>(intrinsics_.focal_px.x()), fy = static_cast<float>(intrinsics_.focal_px.y());
    const auto cx = static_cast<float>(intrinsics_.principal_point_px.x()),
               cy = static_cast<float>(intrinsics_.principal_point_px.y());
    for (std::uint32_t v = 0; v < intrinsics_.height; ++v)
      for (std::uint32_t u = 0; u < intrinsics_.width; ++u, to += 3) {
        fusion::Sight sight;
        const float x = (static_cast<float>(u) - cx) / fx, y = (static_cast<float>(v) - cy) / fy;
        if (!source_->project(x, y, 1, sight) || source_->is_at_margin(sight.x, sight.y)) continue;
        const int column = static_cast<int>(sight.x), row = static_cast<int>(sight.y);
        put(fusion::sample(image, static_cast<int>(mount_.x_offset) + column, static_cast<int>(mount_.y_offset) + row,
                           sight.x - static_cast<float>(column), sight.y - static_cast<float>(row)),
            to);
      }
    return out;
  }
  if (image.format == PixelFormat::Rgb8 || image.format == PixelFormat::Mono8) {
    const std::size_t step = image.format == PixelFormat::Rgb8 ? 3 : 1;
    for (std::uint32_t v = 0; v < high; ++v) {
      const std::uint8_t* from = image.data + (mount_.y_offset + v) * image.stride + mount_.x_offset * step;
      for (std::uint32_t u = 0; u < wide; ++u, from += step, to += 3) {
        to[0] = from[0];
        to[1] = from[step == 3 ? 1 : 0];
        to[2] = from[step == 3 ? 2 : 0];
      }
    }
    return out;
  }
  // What the mosaic lacks at the border, and across it in the image of the neighbouring lens, comes from inside.
  const auto inside = [](std::uint32_t at, std::uint32_t size) {
    const int most = static_cast<int>(size) - 1 - kSampleReach;
    return std::clamp(static_cast<int>(at), std::min(kSampleReach, most), most);
  };
  for (std::uint32_t v = 0; v < high; ++v)
    for (std::uint32_t u = 0; u < wide; ++u, to += 3)
      put(fusion::sample(image, static_cast<int>(mount_.x_offset) + inside(u, wide),
                         static_cast<int>(mount_.y_offset) + inside(v, high), 0, 0),
          to);
  return out;
}

ColmapCamera colmap_camera(const fusion::CameraIntrinsics& lens) {
  ColmapCamera out{
      "PINHOLE",
      {lens.focal_px.x(), lens.focal_px.y(), lens.principal_point_px.x() + 0.5, lens.principal_point_px.y() + 0.5}};
  const auto& k = lens.distortion;
  if (lens.model == fusion::LensModel::KannalaBrandt) {
    out.model = "OPENCV_FISHEYE";
    out.parameters.insert(out.parameters.end(), k.begin(), k.begin() + 4);
  } else if (k[4] != 0) {
    out.model = "FULL_OPENCV";
    out.parameters.insert(out.parameters.end(), k.begin(), k.end());
    out.parameters.insert(out.parameters.end(), 3, 0.0);  // k4 k5 k6
  } else if (std::any_of(k.begin(), k.end(), [](double one) { return one != 0; })) {
    out.model = "OPENCV";
    out.parameters.insert(out.parameters.end(), k.begin(), k.begin() + 4);
  }
  return out;
}

}  // namespace hueline::products
