#include "fusion/panorama_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline::fusion {

using std::numbers::pi;

Rgb LowImage::at(float x, float y) const {
  const float cx = std::clamp((x + 0.5f) * scale - 0.5f, 0.0f, static_cast<float>(width - 1)),
              cy = std::clamp((y + 0.5f) * scale - 0.5f, 0.0f, static_cast<float>(height - 1));
  const int left = std::min(static_cast<int>(cx), width - 2), top = std::min(static_cast<int>(cy), height - 2);
  const float wx = cx - static_cast<float>(left), wy = cy - static_cast<float>(top);
  const float* a = &pixels[3 * (static_cast<std::size_t>(top) * width + left)];
  const float* b = a + 3 * static_cast<std::size_t>(width);
  const auto mixed = [&](std::size_t c) {
    const float upper = a[c] + wx * (a[c + 3] - a[c]), lower = b[c] + wx * (b[c + 3] - b[c]);
    return upper + wy * (lower - upper);
  };
  return {mixed(0), mixed(1), mixed(2)};
}

void PanoramaColumns::push_back(const PanoramaLine& line) {
  sine.push_back(line.sine);
  cosine.push_back(line.cosine);
  fraction.push_back(line.fraction);
}

PanoramaScene::PanoramaScene(const PanoramaView& the_view, const DepthPanorama* the_depth, int number_of_ranks,
                             float nearness, std::uint32_t natural_width)
    : view(the_view),
      depth(the_depth),
      ranks(number_of_ranks),
      sphere_nearness(nearness),
      R_head_view(the_view.R_head_view.toRotationMatrix().cast<float>()),
      // Where the panorama is coarser than the lenses, a pixel is the mean of several samples.
      samples(
          std::clamp(static_cast<int>(std::lround(static_cast<double>(natural_width) / the_view.shape.width)), 1, 16)) {
  for (std::uint32_t u = 0; u < view.shape.width; ++u)
    for (int i = 0; i < samples; ++i) {
      columns.push_back(column(u + (i + 0.5) / samples - 0.5));
      pixel_of_column.push_back(u);
    }
}

PanoramaLine PanoramaScene::column(double u) const {
  double turn = (u - view.shape.forward()) / view.shape.width;  // clockwise from forward, of a whole turn
  if (!view.shape.is_clockwise) turn = -turn;
  const double across = turn + 0.5;
  return {static_cast<float>(portable::sin(turn * 2 * pi)), static_cast<float>(portable::cos(turn * 2 * pi)),
          static_cast<float>(across - std::floor(across))};
}

PanoramaLine PanoramaScene::row(double v) const {
  const double down = (v + 0.5) / view.shape.height;
  return {static_cast<float>(portable::sin(down * pi)), static_cast<float>(portable::cos(down * pi)),
          static_cast<float>(down)};
}

void PanoramaPlaces::resize(std::size_t size) {
  for (auto* each : {&x, &y, &z, &rise}) each->resize(size);
}

void PanoramaPlaces::find(const PanoramaScene& scene, const PanoramaColumns& columns, std::size_t first,
                          std::size_t count, const PanoramaLine& row) {
  resize(count);
  nearness_.resize(count);
  if (scene.depth) {
    scene.depth->nearness_of_row(std::span(columns.fraction).subspan(first, count), row.fraction, nearness_.data());
  } else {
    std::fill(nearness_.begin(), nearness_.end(), scene.sphere_nearness);
  }
  // The direction of a column with angle a is (sine cos a, -sine sin a, cosine) in the view's axes.
  const Eigen::Vector3f ahead = scene.R_head_view.col(0) * row.sine, aside = scene.R_head_view.col(1) * -row.sine,
                        up = scene.R_head_view.col(2) * row.cosine;
  const float* cosine = &columns.cosine[first];
  const float* sine = &columns.sine[first];
  const auto along = [&](int axis, std::vector<float>& to) {
    const float a = ahead[axis], b = aside[axis], c = up[axis];
    for (std::size_t i = 0; i < count; ++i) to[i] = a * cosine[i] + b * sine[i] + c;
  };
  along(0, x);
  along(1, y);
  along(2, rise);
  for (std::size_t i = 0; i < count; ++i) {
    const float distance = 1 / std::max(nearness_[i], 1e-4f);
    x[i] *= distance;
    y[i] *= distance;
    z[i] = rise[i] * distance;
  }
}

void PanoramaPlaces::take(const PanoramaPlaces& from, std::span<const std::uint32_t> chosen) {
  resize(chosen.size());
  const auto take_of = [&](const std::vector<float>& source, std::vector<float>& into) {
    for (std::size_t i = 0; i < chosen.size(); ++i) into[i] = source[chosen[i]];
  };
  take_of(from.x, x);
  take_of(from.y, y);
  take_of(from.z, z);
  take_of(from.rise, rise);
}

/// Finds the pixels of the places, of a head that moves as FloatLens::project() does for one place: the pixel is where
/// the lens sees the place when the pixel's row is exposed.
bool PanoramaLook::project(const PanoramaEye& eye, const PanoramaPlaces& places) {
  const FloatLens& lens = eye.lens;
  if (!lens.project_each(places.x, places.y, places.z, sights)) return false;
  const float late = eye.motion.lateness[lens.index];
  const int steps = lens.steps_in_time(late);
  if (steps == 0) return true;
  const std::size_t count = places.size();
  for (auto* each : {&x_, &y_, &z_}) each->resize(count);
  least_border_ = sights.border_px;
  for (int step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_seen = least_border_[i] > kLeastBorder_px;
      const float dt = is_seen ? late + lens.row_time * (sights.y[i] - lens.middle_row) : 0;
      const auto [x, y, z] = eye.motion.place_after(places.x[i], places.y[i], places.z[i], dt);
      x_[i] = x, y_[i] = y, z_[i] = z;
    }
    if (!lens.project_each(x_, y_, z_, sights)) return false;
    for (std::size_t i = 0; i < count; ++i) least_border_[i] = std::min(least_border_[i], sights.border_px[i]);
  }
  for (std::size_t i = 0; i < count; ++i)
    if (!(least_border_[i] > kLeastBorder_px)) sights.border_px[i] = -1;
  return true;
}

bool PanoramaLook::look(const PanoramaEye& eye, const PanoramaPlaces& places) {
  const std::size_t count = places.size();
  if (!project(eye, places)) return false;
  ramp.resize(count);
  const float per_px = 1 / eye.ramp_px;
  const float* border = sights.border_px.data();
  float* to = ramp.data();
  for (std::size_t i = 0; i < count; ++i) {
    const float inside = (border[i] - static_cast<float>(kSampleReach)) * per_px, at_most = inside < 1 ? inside : 1;
    to[i] = at_most > 0 ? at_most : 0;
  }
  if (eye.clearance.empty()) return true;
  for (std::size_t i = 0; i < count; ++i) {
    if (ramp[i] <= 0) continue;
    const auto column = static_cast<std::uint32_t>(static_cast<std::int32_t>(sights.x[i] + 0.5f)),
               row = static_cast<std::uint32_t>(static_cast<std::int32_t>(sights.y[i] + 0.5f));
    ramp[i] = std::min(ramp[i], static_cast<float>(eye.clearance[row * eye.lens.width + column]) * per_px);
  }
  return true;
}

}  // namespace hueline::fusion
