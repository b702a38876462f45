#include "fusion/panorama_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "core/portable_math.hpp"
#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {

using std::numbers::pi;
constexpr std::uint32_t kRowsAtATime = 16;
constexpr std::size_t kMostSeers = 12;
/// Lenses mix where the cosines of the angles between their axes and the direction differ by less than this: details,
/// and coarse differences of brightness. Between two lenses 72 degrees apart the bands are 3 and 19 degrees wide.
constexpr float kNarrow = 0.03f, kWide = 0.2f;
/// A lens fades out over this angle towards the border of its image and towards its masks, rad.
constexpr double kRamp = 0.05;
constexpr double kLowCell = 0.015;  // width of a cell of a low image, rad
constexpr int kLowBlur = 2;         // cells to each side, twice
/// Levels of a low image that are neither too dark to measure nor saturated.
constexpr float kDarkest = 6, kBrightest = 240;
/// Of so many samples of a row, only the first is calculated in full where the lenses see them evenly.
constexpr std::size_t kRun = 8;
/// Samples count as even if the distances within a run move them by less than this from a straight line, px.
constexpr float kUneven_px = 0.2f;
constexpr std::size_t kFewestCommon = 30;  // places for a ratio between two lenses

/// Returns the distance of each pixel to the nearest whose sample has much of a masked one, in pixels up to 255; empty
/// without a mask.
std::vector<std::uint8_t> clearance_of(const LensMount& lens) {
  if (lens.masks.empty()) return {};
  const PixelMask mask(lens.masks, lens.intrinsics.width, lens.intrinsics.height, kMixedReach);
  const auto w = static_cast<int>(lens.intrinsics.width), h = static_cast<int>(lens.intrinsics.height);
  // The chamfer distance: 3 for a step, 4 for a diagonal one.
  std::vector<std::uint16_t> thirds(static_cast<std::size_t>(w) * h, 3 * 255);
  const auto at = [&](int x, int y) -> std::uint16_t& { return thirds[static_cast<std::size_t>(y) * w + x]; };
  const auto step = [&](int x, int y, int dx, int dy, int cost) {
    if (x + dx < 0 || x + dx >= w || y + dy < 0 || y + dy >= h) return;
    at(x, y) = std::min(at(x, y), static_cast<std::uint16_t>(at(x + dx, y + dy) + cost));
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      if (mask.covers(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y))) at(x, y) = 0;
      step(x, y, -1, 0, 3);
      step(x, y, -1, -1, 4);
      step(x, y, 0, -1, 3);
      step(x, y, 1, -1, 4);
    }
  for (int y = h - 1; y >= 0; --y)
    for (int x = w - 1; x >= 0; --x) {
      step(x, y, 1, 0, 3);
      step(x, y, 1, 1, 4);
      step(x, y, 0, 1, 3);
      step(x, y, -1, 1, 4);
    }
  std::vector<std::uint8_t> out(thirds.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint8_t>(std::min(255, thirds[i] / 3));
  return out;
}

/// Which channel a pixel of a raw image holds: 0 red, 1 green, 2 blue.
int channel_of(PixelFormat format, std::uint32_t x, std::uint32_t y) {
  const RedParity red = red_parity(format).value_or(RedParity{0, 0});
  const bool is_red_column = static_cast<int>(x & 1u) == red.x, is_red_row = static_cast<int>(y & 1u) == red.y;
  return is_red_column == is_red_row ? (is_red_row ? 0 : 2) : 1;
}

/// Averages over `kLowBlur` cells to each side along one direction, twice. Values are sums and their weights.
void blur(std::vector<std::array<float, 4>>& cells, int count, int length, int step, int next) {
  std::vector<std::array<float, 4>> line(static_cast<std::size_t>(length));
  for (int i = 0; i < count; ++i)
    for (int pass = 0; pass < 2; ++pass) {
      for (int k = 0; k < length; ++k)
        line[static_cast<std::size_t>(k)] = cells[static_cast<std::size_t>(i * next + k * step)];
      for (int k = 0; k < length; ++k) {
        std::array<float, 4> sum{};
        for (int j = std::max(0, k - kLowBlur); j <= std::min(length - 1, k + kLowBlur); ++j)
          for (std::size_t c = 0; c < 4; ++c) sum[c] += line[static_cast<std::size_t>(j)][c];
        cells[static_cast<std::size_t>(i * next + k * step)] = sum;
      }
    }
}

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

/// What render() knows while it draws one panorama.
struct PanoramaRenderer::Scene {
  const PanoramaView& view;
  const DepthPanorama* depth;
  std::vector<Eye> eyes;  // in order of their ranks
  int ranks = 1;
  Eigen::Matrix3f R_head_view;
  float sphere_nearness;
  float px_per_nearness;  // the farthest that a place moves in a lens image if its nearness changes by 1 / m

  Line column(double u) const {
    double turn = (u - view.shape.forward()) / view.shape.width;  // clockwise from forward, of a whole turn
    if (!view.shape.is_clockwise) turn = -turn;
    const double across = turn + 0.5;
    return {static_cast<float>(portable::sin(turn * 2 * pi)), static_cast<float>(portable::cos(turn * 2 * pi)),
            static_cast<float>(across - std::floor(across))};
  }
  Line row(double v) const {
    const double down = (v + 0.5) / view.shape.height;
    return {static_cast<float>(portable::sin(down * pi)), static_cast<float>(portable::cos(down * pi)),
            static_cast<float>(down)};
  }
  static Eigen::Vector3f direction(const Line& column, const Line& row) {
    return {row.sine * column.cosine, -row.sine * column.sine, row.cosine};
  }
  float nearness(const Line& column, const Line& row) const {
    return depth ? depth->nearness(column.fraction, row.fraction) : sphere_nearness;
  }
};

/// How much of a pixel each eye gives: details and coarse brightness.
struct PanoramaRenderer::Weights {
  std::array<float, kMostSeers> narrow{}, wide{};
};

Rgb PanoramaRenderer::LowImage::at(float x, float y) const {
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

PanoramaRenderer::PanoramaRenderer(const CameraHeadGeometry& head, const Config& config)
    : head_(head),
      config_(config),
      projector_(head, ColourMethod::Lens),
      all_images_(projector_.cameras().size(), 1),
      hole_cosine_(config.hide_vehicle && head.nadir_half_angle > 0
                       ? static_cast<float>(portable::cos(head.nadir_half_angle))
                       : 2.0f) {
  for (std::size_t i = 0; i < head_.lenses.size(); ++i) {
    clearance_.push_back(clearance_of(head_.lenses[i]));
    ramp_px_.push_back(static_cast<float>(kRamp * head_.lenses[i].intrinsics.focal_px.minCoeff()));
  }
}

std::uint32_t PanoramaRenderer::natural_width() const {
  double focal = 0;
  for (const LensMount& lens : head_.lenses) focal = std::max(focal, lens.intrinsics.focal_px.maxCoeff());
  return 2 * static_cast<std::uint32_t>(std::lround(pi * focal));
}

bool PanoramaRenderer::is_seen(const Point<CameraHead>& p_head) const {
  const Eigen::Vector3f p = p_head.xyz.cast<float>();
  Sight sight;
  return projector_.see(p.x(), p.y(), p.z(), all_images_.data(), 0, sight) &&
         !projector_.lenses()[sight.lens].is_at_margin(sight.x, sight.y);
}

PanoramaRenderer::Eye PanoramaRenderer::eye_of(const FloatLens& lens, const HeadShot& shot, int rank) const {
  Eye eye{lens, shot.images[lens.camera], rank, {}, {}};
  eye.lens.mask = eye.lens.margin = {};  // clearance_ knows more
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> R(lens.R_lens_head.data());
  const Eigen::Map<const Eigen::Vector3f> t(lens.t_lens_head.data());
  const Eigen::Matrix3f R_head = R * shot.T_shot_head.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t_head = R * shot.T_shot_head.translation.cast<float>() + t;
  const Eigen::Vector3f centre = -R_head.transpose() * t_head;
  for (int i = 0; i < 9; ++i) eye.lens.R_lens_head[static_cast<std::size_t>(i)] = R_head(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    eye.lens.t_lens_head[at] = t_head[i];
    eye.lens.axis[at] = R_head(2, i);
    eye.centre[at] = centre[i];
  }
  return eye;
}

/// Returns how well inside the usable part of its image a lens sees a place, from 0 (not) to 1.
float PanoramaRenderer::ramp(const Eye& eye, const Sight& sight) const {
  float inside = sight.border_px - static_cast<float>(kSampleReach);
  // The vehicle may be shown, but not where it was at another moment.
  const auto& clearance = clearance_[eye.lens.index];
  if (!clearance.empty() && (config_.hide_vehicle || eye.rank > 0)) {
    const auto x = static_cast<std::size_t>(sight.x + 0.5f), y = static_cast<std::size_t>(sight.y + 0.5f);
    inside = std::min(inside, static_cast<float>(clearance[y * eye.lens.width + x]));
  }
  return std::clamp(inside / ramp_px_[eye.lens.index], 0.0f, 1.0f);
}

PanoramaRenderer::LowImage PanoramaRenderer::low_image(const Eye& eye) const {
  const FloatLens& lens = eye.lens;
  const RawView& image = eye.image;
  const auto index = static_cast<std::size_t>(lens.index);
  const int cell = std::max(2, static_cast<int>(std::lround(kLowCell * lens.focal_x / 2)) * 2);
  LowImage out;
  out.width = std::max(2, static_cast<int>(lens.width) / cell);
  out.height = std::max(2, static_cast<int>(lens.height) / cell);
  out.scale = 1.0f / static_cast<float>(cell);
  std::vector<std::array<float, 4>> cells(static_cast<std::size_t>(out.width) * out.height);
  for (int cy = 0; cy < out.height; ++cy)
    for (int cx = 0; cx < out.width; ++cx) {
      std::array<std::uint32_t, 3> sum{}, count{};
      for (int j = 0; j < cell; ++j) {
        const auto y = static_cast<std::uint32_t>(cy * cell + j);
        if (y >= lens.height) break;
        const std::uint8_t* row = image.data + (y + lens.y_offset) * image.stride;
        for (int i = 0; i < cell; ++i) {
          const auto x = static_cast<std::uint32_t>(cx * cell + i);
          if (x >= lens.width) break;
          if (!clearance_[index].empty() && clearance_[index][std::size_t{y} * lens.width + x] == 0) continue;
          const std::uint32_t column = x + lens.x_offset;
          if (image.format == PixelFormat::Rgb8) {
            for (std::size_t c = 0; c < 3; ++c) sum[c] += row[3 * std::size_t{column} + c], ++count[c];
          } else if (image.format == PixelFormat::Mono8) {
            for (std::size_t c = 0; c < 3; ++c) sum[c] += row[column], ++count[c];
          } else {
            const auto c = static_cast<std::size_t>(channel_of(image.format, column, y + lens.y_offset));
            sum[c] += row[column];
            ++count[c];
          }
        }
      }
      if (count[0] == 0 || count[1] == 0 || count[2] == 0) continue;
      auto& to = cells[static_cast<std::size_t>(cy) * out.width + cx];
      for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(sum[c]) / static_cast<float>(count[c]);
      to[3] = 1;
    }
  blur(cells, out.height, out.width, 1, out.width);
  blur(cells, out.width, out.height, out.width, 1);
  out.pixels.resize(3 * cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) out.pixels[3 * i + c] = cells[i][3] > 0 ? cells[i][c] / cells[i][3] : 0.0f;
  return out;
}

/// Finds out whether an eye sees a place of the head's frame.
bool PanoramaRenderer::look(const Eye& eye, const Eigen::Vector3f& place, Seer& seer) const {
  seer.eye = &eye;
  if (!eye.lens.project(place.x(), place.y(), place.z(), seer.sight)) return false;
  seer.ramp = ramp(eye, seer.sight);
  return seer.ramp > 0;
}

/// Finds the eyes that may take part in the colour of a place, those of the panorama's moment first. Without a blend
/// only the first counts.
std::size_t PanoramaRenderer::seers(const Scene& scene, const Eigen::Vector3f& direction, float nearness,
                                    std::span<Seer> out) const {
  const Eigen::Vector3f d = scene.R_head_view * direction;
  const Eigen::Vector3f place = d / std::max(nearness, 1e-4f);
  const bool in_hole = -d.z() >= hole_cosine_;
  const bool blends = config_.blend == PanoramaBlend::Bands;
  std::size_t found = 0, next = 0;
  // The hole lies below the head. Above it, what no lens sees is mostly sky, of which other places know nothing.
  const int ranks = d.z() < 0 ? scene.ranks : 1;
  for (int rank = 0; rank < ranks && found < out.size(); ++rank) {
    std::array<std::pair<float, std::size_t>, 32> order;
    std::size_t candidates = 0;
    for (; next < scene.eyes.size() && scene.eyes[next].rank == rank; ++next) {
      if ((rank == 0 && in_hole) || candidates == order.size()) continue;
      const FloatLens& lens = scene.eyes[next].lens;
      float cosine = lens.axis[0] * d.x() + lens.axis[1] * d.y() + lens.axis[2] * d.z();
      if (rank > 0) {
        const auto& c = scene.eyes[next].centre;
        const Eigen::Vector3f sight = place - Eigen::Vector3f(c[0], c[1], c[2]);
        cosine = (lens.axis[0] * sight.x() + lens.axis[1] * sight.y() + lens.axis[2] * sight.z()) / sight.norm();
      }
      if (cosine < lens.cosine_limit - 0.3f) continue;
      std::size_t at = candidates++;
      for (; at > 0 && order[at - 1].first < cosine; --at) order[at] = order[at - 1];
      order[at] = {cosine, next};
    }
    float full = -2;  // cosine of the best lens that sees the place well inside its image
    for (std::size_t i = 0; i < candidates && found < out.size(); ++i) {
      if (order[i].first < full - kWide) break;
      if (!look(scene.eyes[order[i].second], place, out[found])) continue;
      out[found].cosine = order[i].first;
      if (out[found].ramp >= 1) full = std::max(full, out[found].cosine);
      ++found;
      if (!blends) return 1;
    }
    if (full > -2) break;
  }
  return found;
}

namespace {

/// Divides a pixel among the lenses of one moment: first among those whose cosine is within `band` of the best, each as
/// far as its ramp allows; what these leave goes to the others. Returns the sum, 0 to 1, of what is written to
/// `weights`.
template <class Seer>
float divide(std::span<const Seer> seen, float band, float* weights) {
  float best = -2, in_band = 0, first = 0, rest = 0;
  for (const Seer& seer : seen) best = std::max(best, seer.cosine);
  const auto nearly = [&](const Seer& seer) { return std::max(0.0f, 1 - (best - seer.cosine) / band); };
  for (const Seer& seer : seen) in_band += nearly(seer);
  for (const Seer& seer : seen) {
    first += nearly(seer) / in_band * seer.ramp;
    rest += (1 - nearly(seer)) * seer.ramp;
  }
  const float left = (1 - first) / std::max(1.0f, rest);
  float sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float b = nearly(seen[i]);
    weights[i] = seen[i].ramp * (b / in_band + left * (1 - b));
    sum += weights[i];
  }
  return sum;
}

}  // namespace

Rgb PanoramaRenderer::colour(std::span<const Seer> seen) const {
  const auto sampled = [&](const Seer& seer) {
    const FloatLens& lens = seer.eye->lens;
    const float left = std::floor(seer.sight.x), top = std::floor(seer.sight.y);
    const Rgb c =
        sample(seer.eye->image, static_cast<int>(left) + static_cast<int>(lens.x_offset),
               static_cast<int>(top) + static_cast<int>(lens.y_offset), seer.sight.x - left, seer.sight.y - top);
    const auto& gain = seer.eye->gain;
    return Rgb{c.red * gain[0], c.green * gain[1], c.blue * gain[2]};
  };
  if (seen.size() == 1) return sampled(seen[0]);
  Weights weights;
  float narrow_left = 1, wide_left = 1, narrow_sum = 0, wide_sum = 0;
  for (std::size_t from = 0, to = 0; from < seen.size(); from = to) {
    while (to < seen.size() && seen[to].eye->rank == seen[from].eye->rank) ++to;
    const float narrow = divide(seen.subspan(from, to - from), kNarrow, &weights.narrow[from]),
                wide = divide(seen.subspan(from, to - from), kWide, &weights.wide[from]);
    for (std::size_t i = from; i < to; ++i) weights.narrow[i] *= narrow_left, weights.wide[i] *= wide_left;
    narrow_sum += narrow_left * narrow, wide_sum += wide_left * wide;
    narrow_left *= 1 - narrow, wide_left *= 1 - wide;
  }
  Rgb out;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float detail = weights.narrow[i] / narrow_sum, coarse = weights.wide[i] / wide_sum - detail;
    if (detail > 0) {
      const Rgb c = sampled(seen[i]);
      out.red += detail * c.red, out.green += detail * c.green, out.blue += detail * c.blue;
    }
    if (std::abs(coarse) > 1e-4f) {
      const Rgb c = seen[i].eye->low.at(seen[i].sight.x, seen[i].sight.y);
      const auto& gain = seen[i].eye->gain;
      out.red += coarse * gain[0] * c.red, out.green += coarse * gain[1] * c.green,
          out.blue += coarse * gain[2] * c.blue;
    }
  }
  return out;
}

void PanoramaRenderer::solve_gains(Scene& scene, WorkerPool& pool) const {
  // The brightness of places that two lenses see, from the low images, which small errors of distance do not change.
  constexpr std::uint32_t kRows = 128, kColumns = 2 * kRows;
  const std::size_t n = scene.eyes.size();
  struct Pair {
    std::size_t a, b;
    std::array<float, 3> ratio;  // logarithm of a divided by b
  };
  std::vector<std::vector<Pair>> rows(kRows);
  pool.run(kRows, [&](std::size_t index) {
    const Line row = scene.row((static_cast<double>(index) + 0.5) * scene.view.shape.height / kRows - 0.5);
    std::vector<std::pair<std::size_t, Rgb>> seen;
    for (std::uint32_t c = 0; c < kColumns; ++c) {
      const Line column = scene.column((c + 0.5) * scene.view.shape.width / kColumns - 0.5);
      const Eigen::Vector3f d = scene.R_head_view * Scene::direction(column, row);
      const Eigen::Vector3f place = d / std::max(scene.nearness(column, row), 1e-4f);
      seen.clear();
      for (std::size_t i = 0; i < n; ++i) {
        Seer seer;
        if (!look(scene.eyes[i], place, seer)) continue;
        const Rgb light = scene.eyes[i].low.at(seer.sight.x, seer.sight.y);
        const auto [low, high] = std::minmax({light.red, light.green, light.blue});
        if (low >= kDarkest && high <= kBrightest) seen.emplace_back(i, light);
      }
      for (std::size_t i = 0; i < seen.size(); ++i)
        for (std::size_t j = i + 1; j < seen.size(); ++j) {
          const Rgb &x = seen[i].second, &y = seen[j].second;
          const auto ratio = [](float a, float b) { return static_cast<float>(portable::log(a / b)); };
          rows[index].push_back(
              {seen[i].first, seen[j].first, {ratio(x.red, y.red), ratio(x.green, y.green), ratio(x.blue, y.blue)}});
        }
    }
  });
  std::vector<std::array<std::vector<float>, 3>> ratios(n * n);
  for (const auto& row : rows)
    for (const Pair& pair : row)
      for (std::size_t c = 0; c < 3; ++c) ratios[pair.a * n + pair.b][c].push_back(pair.ratio[c]);
  for (std::size_t c = 0; c < 3; ++c) {
    // Least squares over the medians. The weak wish for a factor of 1 leaves a lens that shares nothing as it is.
    const auto size = static_cast<Eigen::Index>(n);
    Eigen::MatrixXd N = Eigen::MatrixXd::Identity(size, size) * 1e-3;
    Eigen::VectorXd y = Eigen::VectorXd::Zero(size);
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = a + 1; b < n; ++b) {
        auto& common = ratios[a * n + b][c];
        if (common.size() < kFewestCommon) continue;
        const double ratio = median(common), weight = std::sqrt(static_cast<double>(common.size()));
        const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
        N(i, i) += weight, N(j, j) += weight, N(i, j) -= weight, N(j, i) -= weight;
        y(i) -= weight * ratio, y(j) += weight * ratio;
      }
    const Eigen::VectorXd logarithms = N.ldlt().solve(y);
    // The mean of the moment's own lenses stays.
    double mean = 0, own = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (scene.eyes[i].rank == 0) mean += logarithms(static_cast<Eigen::Index>(i)), own += 1;
    for (std::size_t i = 0; i < n; ++i)
      scene.eyes[i].gain[c] =
          static_cast<float>(portable::exp(logarithms(static_cast<Eigen::Index>(i)) - mean / std::max(1.0, own)));
  }
}

/// Returns whether the same lenses see a run of samples well inside their images, at places that lie on straight lines.
/// `first` and `last` are what the ends of the run see.
bool PanoramaRenderer::is_even(const Scene& scene, const Line& row, std::span<const Line> run,
                               std::span<const Seer> first, std::span<const Seer> last) {
  if (first.empty() || first.size() != last.size()) return false;
  for (std::size_t i = 0; i < first.size(); ++i)
    if (first[i].eye != last[i].eye || first[i].eye->rank != 0 || first[i].ramp < 1 || last[i].ramp < 1 ||
        std::abs(first[i].sight.x - last[i].sight.x) + std::abs(first[i].sight.y - last[i].sight.y) > 4.0f * kRun)
      return false;
  if (!scene.depth) return true;
  const float from = scene.nearness(run.front(), row), to = scene.nearness(run.back(), row);
  for (std::size_t i = 1; i + 1 < run.size(); ++i) {
    const float straight = from + (to - from) * static_cast<float>(i) / static_cast<float>(run.size() - 1);
    if (std::abs(scene.nearness(run[i], row) - straight) * scene.px_per_nearness > kUneven_px) return false;
  }
  return true;
}

void PanoramaRenderer::render_rows(const Scene& scene, std::uint32_t from, std::uint32_t to, RgbRaster& out,
                                   std::uint64_t& seen_pixels, std::uint64_t& filled_pixels) const {
  // Where the panorama is coarser than the lenses, a pixel is the mean of several samples.
  const int samples =
      std::clamp(static_cast<int>(std::lround(static_cast<double>(natural_width()) / out.width)), 1, 16);
  const double step = 1.0 / samples;
  std::vector<Line> columns;
  for (std::uint32_t u = 0; u < out.width; ++u)
    for (int i = 0; i < samples; ++i) columns.push_back(scene.column(u + (i + 0.5) * step - 0.5));
  std::array<Seer, kMostSeers> seen;
  std::vector<Rgb> sums(out.width);
  std::vector<std::array<int, 2>> found(out.width);  // samples, and those that the moment itself shows
  std::array<Seer, kMostSeers> next, between;
  for (std::uint32_t v = from; v < to; ++v) {
    std::fill(sums.begin(), sums.end(), Rgb{});
    std::fill(found.begin(), found.end(), std::array<int, 2>{});
    for (int j = 0; j < samples; ++j) {
      const Line row = scene.row(v + (j + 0.5) * step - 0.5);
      const auto look_at = [&](std::size_t i, std::span<Seer> into) {
        return seers(scene, Scene::direction(columns[i], row), scene.nearness(columns[i], row), into);
      };
      const auto add = [&](std::size_t i, std::span<const Seer> sees) {
        if (sees.empty()) return;
        const Rgb c = colour(sees);
        const std::size_t u = i / static_cast<std::size_t>(samples);
        sums[u].red += c.red, sums[u].green += c.green, sums[u].blue += c.blue;
        ++found[u][0];
        found[u][1] += sees[0].eye->rank == 0;
      };
      std::size_t count = look_at(0, seen);
      for (std::size_t i = 0;;) {
        add(i, std::span(seen).first(count));
        const std::size_t end = std::min(i + kRun, columns.size() - 1);
        if (end == i) break;
        const std::size_t next_count = look_at(end, next);
        const bool even = is_even(scene, row, std::span(columns).subspan(i, end - i + 1), std::span(seen).first(count),
                                  std::span(next).first(next_count));
        for (std::size_t k = i + 1; k < end; ++k) {
          if (!even) {
            add(k, std::span(between).first(look_at(k, between)));
            continue;
          }
          const float share = static_cast<float>(k - i) / static_cast<float>(end - i);
          for (std::size_t s = 0; s < count; ++s) {
            between[s] = seen[s];
            between[s].sight.x += share * (next[s].sight.x - seen[s].sight.x);
            between[s].sight.y += share * (next[s].sight.y - seen[s].sight.y);
            between[s].cosine += share * (next[s].cosine - seen[s].cosine);
          }
          add(k, std::span(between).first(count));
        }
        std::swap(seen, next);
        count = next_count;
        i = end;
      }
    }
    std::uint8_t* pixel = &out.pixels[3 * std::size_t{v} * out.width];
    for (std::uint32_t u = 0; u < out.width; ++u, pixel += 3) {
      if (found[u][0] == 0) {
        std::copy(config_.fill.begin(), config_.fill.end(), pixel);
        continue;
      }
      ++(found[u][1] > 0 ? seen_pixels : filled_pixels);
      const float scale = 1.0f / static_cast<float>(found[u][0]);
      const std::array<float, 3> mean{sums[u].red * scale, sums[u].green * scale, sums[u].blue * scale};
      for (std::size_t c = 0; c < 3; ++c)
        pixel[c] = static_cast<std::uint8_t>(std::clamp(mean[c] + 0.5f, 0.0f, 255.0f));
    }
  }
}

RenderedPanorama PanoramaRenderer::render(const PanoramaView& view, const HeadShot& shot,
                                          std::span<const HeadShot> others, const DepthPanorama* depth,
                                          WorkerPool& pool) const {
  Scene scene{view,
              depth,
              {},
              1 + static_cast<int>(others.size()),
              view.R_head_view.toRotationMatrix().cast<float>(),
              static_cast<float>(1 / head_.panorama.stitching_radius_m),
              0};
  for (const LensMount& lens : head_.lenses)
    scene.px_per_nearness = std::max(scene.px_per_nearness, static_cast<float>(lens.T_head_lens.translation.norm() *
                                                                               lens.intrinsics.focal_px.maxCoeff()));
  for (int rank = 0; rank < scene.ranks; ++rank) {
    const HeadShot& from = rank == 0 ? shot : others[static_cast<std::size_t>(rank - 1)];
    for (const FloatLens& lens : projector_.lenses()) {
      const RawView& image = from.images[lens.camera];
      const bool fits =
          image.data && lens.x_offset + lens.width <= image.width && lens.y_offset + lens.height <= image.height;
      if (fits && (from.blind >> lens.index & 1u) == 0) scene.eyes.push_back(eye_of(lens, from, rank));
    }
  }
  if (config_.blend == PanoramaBlend::Bands || config_.even_gains)
    pool.run(scene.eyes.size(), [&](std::size_t i) { scene.eyes[i].low = low_image(scene.eyes[i]); });
  if (config_.even_gains) solve_gains(scene, pool);
  RenderedPanorama out;
  out.picture.width = view.shape.width;
  out.picture.height = view.shape.height;
  out.picture.pixels.resize(3 * std::size_t{view.shape.width} * view.shape.height);
  std::vector<std::array<std::uint64_t, 2>> seen((view.shape.height + kRowsAtATime - 1) / kRowsAtATime);
  pool.run(seen.size(), [&](std::size_t piece) {
    const auto from = static_cast<std::uint32_t>(piece) * kRowsAtATime;
    render_rows(scene, from, std::min(view.shape.height, from + kRowsAtATime), out.picture, seen[piece][0],
                seen[piece][1]);
  });
  const double pixels = static_cast<double>(view.shape.width) * view.shape.height;
  for (const auto& [own, filled] : seen) {
    out.seen_share += static_cast<double>(own) / pixels;
    out.filled_share += static_cast<double>(filled) / pixels;
  }
  out.gains.assign(projector_.lenses().size(), {1.0f, 1.0f, 1.0f});
  for (const Eye& eye : scene.eyes)
    if (eye.rank == 0) out.gains[eye.lens.index] = eye.gain;
  return out;
}

}  // namespace hueline::fusion
