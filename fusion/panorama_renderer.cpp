#include "fusion/panorama_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {

using std::numbers::pi;
constexpr std::uint32_t kRowsOfPiece = 16;
constexpr std::size_t kMostSeers = 8;
/// Lenses mix where the cosines of the angles between their axes and the direction differ by less than this: details,
/// and coarse differences of brightness. Between two lenses 72 degrees apart the bands are 3 and 19 degrees wide.
constexpr float kNarrow = 0.03f, kWide = 0.2f;
/// A lens fades out over this angle towards the border of its image and towards its masks, rad.
constexpr double kRamp = 0.05;
constexpr double kLowCell = 0.015;  // width of a cell of a low image, rad
constexpr int kLowBlur = 2;         // cells to each side, twice
/// Levels of a low image that are neither too dark to measure nor saturated.
constexpr float kDarkest = 6, kBrightest = 240;
constexpr std::size_t kFewestCommon = 30;  // places for a ratio between two lenses

/// Returns the distance of each pixel to the nearest masked one, in pixels up to 255; empty without a mask.
std::vector<std::uint8_t> clearance_of(const FloatLens& lens) {
  if (lens.mask.is_empty()) return {};
  const auto w = static_cast<int>(lens.width), h = static_cast<int>(lens.height);
  // The chamfer distance: 3 for a step, 4 for a diagonal one.
  std::vector<std::uint16_t> thirds(static_cast<std::size_t>(w) * h, 3 * 255);
  const auto at = [&](int x, int y) -> std::uint16_t& { return thirds[static_cast<std::size_t>(y) * w + x]; };
  const auto step = [&](int x, int y, int dx, int dy, int cost) {
    if (x + dx < 0 || x + dx >= w || y + dy < 0 || y + dy >= h) return;
    at(x, y) = std::min(at(x, y), static_cast<std::uint16_t>(at(x + dx, y + dy) + cost));
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      if (lens.mask.covers(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y))) at(x, y) = 0;
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
  std::uint32_t red_x = 0, red_y = 0;
  if (format == PixelFormat::BayerGR8 || format == PixelFormat::BayerBG8) red_x = 1;
  if (format == PixelFormat::BayerGB8 || format == PixelFormat::BayerBG8) red_y = 1;
  const bool is_red_column = (x & 1u) == red_x, is_red_row = (y & 1u) == red_y;
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
  std::span<const RawView> images;
  const DepthPanorama* depth;
  std::vector<std::size_t> lenses;  // those that have an image
  std::vector<LowImage> low;        // by lens; empty without an image
  std::vector<std::array<float, 3>> gains;
  Eigen::Matrix3f R_head_view;
  float sphere_nearness;

  /// Returns the unit direction in the view of a place in pixels, and how near things are there.
  std::pair<Eigen::Vector3f, float> at(float u, float v) const {
    const auto width = static_cast<float>(view.shape.width), height = static_cast<float>(view.shape.height);
    float turn = (u - static_cast<float>(view.shape.forward())) / width;  // clockwise from forward, of a whole turn
    if (!view.shape.is_clockwise) turn = -turn;
    const float down = (v + 0.5f) / height;
    const auto azimuth = turn * static_cast<float>(2 * pi), polar = down * static_cast<float>(pi);
    const float sine = std::sin(polar);
    const Eigen::Vector3f direction(sine * std::cos(azimuth), -sine * std::sin(azimuth), std::cos(polar));
    const float across = turn + 0.5f;
    return {direction, depth ? depth->nearness(across - std::floor(across), down) : sphere_nearness};
  }
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
      hole_cosine_(config.hide_vehicle && head.nadir_half_angle > 0
                       ? static_cast<float>(std::cos(head.nadir_half_angle))
                       : 2.0f) {
  for (std::size_t i = 0; i < head_.lenses.size(); ++i) {
    clearance_.push_back(config.hide_vehicle ? clearance_of(projector_.lenses()[i]) : std::vector<std::uint8_t>{});
    ramp_px_.push_back(static_cast<float>(kRamp * head_.lenses[i].intrinsics.focal_px.minCoeff()));
  }
}

std::uint32_t PanoramaRenderer::natural_width() const {
  double focal = 0;
  for (const LensMount& lens : head_.lenses) focal = std::max(focal, lens.intrinsics.focal_px.maxCoeff());
  return 2 * static_cast<std::uint32_t>(std::lround(pi * focal));
}

/// Returns how well inside the usable part of its image a lens sees a place, from 0 (not) to 1.
float PanoramaRenderer::ramp(std::size_t lens, const Sight& sight) const {
  float inside = sight.border_px - static_cast<float>(kSampleReach);
  if (const auto& clearance = clearance_[lens]; !clearance.empty()) {
    const auto x = static_cast<std::size_t>(sight.x + 0.5f), y = static_cast<std::size_t>(sight.y + 0.5f);
    inside = std::min(inside, static_cast<float>(clearance[y * projector_.lenses()[lens].width + x]));
  }
  return std::clamp(inside / ramp_px_[lens], 0.0f, 1.0f);
}

PanoramaRenderer::LowImage PanoramaRenderer::low_image(const FloatLens& lens, const RawView& image) const {
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

/// Finds the lenses that see a place and may take part in its colour, in the order of their axes; only the first unless
/// `all`.
std::size_t PanoramaRenderer::seers(const Scene& scene, const Eigen::Vector3f& direction, float nearness, bool all,
                                    std::span<Seer> out) const {
  const Eigen::Vector3f d = scene.R_head_view * direction;
  if (-d.z() >= hole_cosine_) return 0;
  std::array<std::pair<float, std::size_t>, 32> order;
  std::size_t candidates = 0;
  for (const std::size_t i : scene.lenses) {
    const FloatLens& lens = projector_.lenses()[i];
    const float cosine = lens.axis[0] * d.x() + lens.axis[1] * d.y() + lens.axis[2] * d.z();
    if (cosine < lens.cosine_limit - 0.3f || candidates == order.size()) continue;
    std::size_t at = candidates++;
    for (; at > 0 && order[at - 1].first < cosine; --at) order[at] = order[at - 1];
    order[at] = {cosine, i};
  }
  const Eigen::Vector3f p = d / std::max(nearness, 1e-4f);
  std::size_t found = 0;
  float full = -2;  // cosine of the best lens that sees the place well inside its image
  for (std::size_t i = 0; i < candidates && found < out.size(); ++i) {
    if (order[i].first < full - kWide) break;
    Seer& seer = out[found];
    seer.lens = order[i].second;
    seer.cosine = order[i].first;
    if (!projector_.lenses()[seer.lens].project(p.x(), p.y(), p.z(), seer.sight)) continue;
    seer.ramp = ramp(seer.lens, seer.sight);
    if (!(seer.ramp > 0)) continue;
    ++found;
    if (!all) break;
    if (seer.ramp >= 1) full = std::max(full, seer.cosine);
  }
  return found;
}

Rgb PanoramaRenderer::colour(const Scene& scene, std::span<const Seer> seen) const {
  const auto sampled = [&](const Seer& seer) {
    const FloatLens& lens = projector_.lenses()[seer.lens];
    const float left = std::floor(seer.sight.x), top = std::floor(seer.sight.y);
    Rgb c = sample(scene.images[lens.camera], static_cast<int>(left) + static_cast<int>(lens.x_offset),
                   static_cast<int>(top) + static_cast<int>(lens.y_offset), seer.sight.x - left, seer.sight.y - top);
    const auto& gain = scene.gains[seer.lens];
    return Rgb{c.red * gain[0], c.green * gain[1], c.blue * gain[2]};
  };
  if (seen.size() == 1) return sampled(seen[0]);
  // A lens that fades out loses more than any difference of cosines.
  float best = -10;
  for (const Seer& seer : seen) best = std::max(best, seer.cosine - 2 * (1 - seer.ramp));
  float narrow_sum = 0, wide_sum = 0;
  std::array<float, kMostSeers> narrow, wide;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float worse = best - (seen[i].cosine - 2 * (1 - seen[i].ramp));
    narrow_sum += narrow[i] = std::max(0.0f, kNarrow - worse);
    wide_sum += wide[i] = std::max(0.0f, kWide - worse);
  }
  Rgb out;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float detail = narrow[i] / narrow_sum, coarse = wide[i] / wide_sum - detail;
    if (detail > 0) {
      const Rgb c = sampled(seen[i]);
      out.red += detail * c.red, out.green += detail * c.green, out.blue += detail * c.blue;
    }
    if (coarse != 0) {
      const Rgb c = scene.low[seen[i].lens].at(seen[i].sight.x, seen[i].sight.y);
      const auto& gain = scene.gains[seen[i].lens];
      out.red += coarse * gain[0] * c.red, out.green += coarse * gain[1] * c.green,
          out.blue += coarse * gain[2] * c.blue;
    }
  }
  return out;
}

std::vector<std::array<float, 3>> PanoramaRenderer::solve_gains(const Scene& scene, WorkerPool& pool) const {
  // The brightness of places that two lenses see, from the low images, which small errors of distance do not change.
  constexpr std::uint32_t kRows = 128, kColumns = 2 * kRows;
  const std::size_t n = projector_.lenses().size();
  struct Pair {
    std::size_t a, b;
    std::array<float, 3> ratio;  // logarithm of a divided by b
  };
  std::vector<std::vector<Pair>> rows(kRows);
  const float u_step = static_cast<float>(scene.view.shape.width) / kColumns,
              v_step = static_cast<float>(scene.view.shape.height) / kRows;
  pool.run(kRows, [&](std::size_t row) {
    std::array<Seer, kMostSeers> seen;
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const auto [direction, nearness] = scene.at((static_cast<float>(column) + 0.5f) * u_step - 0.5f,
                                                  (static_cast<float>(row) + 0.5f) * v_step - 0.5f);
      const std::size_t count = seers(scene, direction, nearness, true, seen);
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t j = i + 1; j < count; ++j) {
          Seer a = seen[i], b = seen[j];
          if (a.lens > b.lens) std::swap(a, b);
          const Rgb x = scene.low[a.lens].at(a.sight.x, a.sight.y), y = scene.low[b.lens].at(b.sight.x, b.sight.y);
          const std::array<float, 3> xs{x.red, x.green, x.blue}, ys{y.red, y.green, y.blue};
          const auto [low, high] = std::minmax({xs[0], xs[1], xs[2], ys[0], ys[1], ys[2]});
          if (low < kDarkest || high > kBrightest) continue;
          rows[row].push_back({a.lens, b.lens, {}});
          for (std::size_t c = 0; c < 3; ++c) rows[row].back().ratio[c] = std::log(xs[c] / ys[c]);
        }
    }
  });
  std::vector<std::array<std::vector<float>, 3>> ratios(n * n);
  for (const auto& row : rows)
    for (const Pair& pair : row)
      for (std::size_t c = 0; c < 3; ++c) ratios[pair.a * n + pair.b][c].push_back(pair.ratio[c]);
  std::vector<std::array<float, 3>> gains(n, {1.0f, 1.0f, 1.0f});
  for (std::size_t c = 0; c < 3; ++c) {
    // Least squares over the medians. The weak wish for a factor of 1 keeps the mean of the logarithms at 0, and a lens
    // that shares nothing as it is.
    Eigen::MatrixXd N = Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n)) * 1e-3;
    Eigen::VectorXd y = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
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
    for (std::size_t i = 0; i < n; ++i)
      gains[i][c] = static_cast<float>(std::exp(logarithms(static_cast<Eigen::Index>(i))));
  }
  return gains;
}

void PanoramaRenderer::render_rows(const Scene& scene, std::uint32_t from, std::uint32_t to, RgbRaster& out,
                                   std::uint64_t& seen_pixels) const {
  // Where the panorama is coarser than the lenses, a pixel is the mean of several samples.
  const int samples =
      std::clamp(static_cast<int>(std::lround(static_cast<double>(natural_width()) / out.width)), 1, 16);
  const float step = 1.0f / static_cast<float>(samples);
  std::array<Seer, kMostSeers> seen;
  for (std::uint32_t v = from; v < to; ++v) {
    std::uint8_t* pixel = &out.pixels[3 * std::size_t{v} * out.width];
    for (std::uint32_t u = 0; u < out.width; ++u, pixel += 3) {
      Rgb sum;
      int found = 0;
      for (int j = 0; j < samples; ++j)
        for (int i = 0; i < samples; ++i) {
          const auto [direction, nearness] =
              scene.at(static_cast<float>(u) + (static_cast<float>(i) + 0.5f) * step - 0.5f,
                       static_cast<float>(v) + (static_cast<float>(j) + 0.5f) * step - 0.5f);
          const std::size_t count = seers(scene, direction, nearness, config_.blend == PanoramaBlend::Bands, seen);
          if (count == 0) continue;
          const Rgb c = colour(scene, std::span(seen).first(count));
          sum.red += c.red, sum.green += c.green, sum.blue += c.blue;
          ++found;
        }
      if (found == 0) {
        std::copy(config_.fill.begin(), config_.fill.end(), pixel);
        continue;
      }
      ++seen_pixels;
      const float scale = 1.0f / static_cast<float>(found);
      const std::array<float, 3> mean{sum.red * scale, sum.green * scale, sum.blue * scale};
      for (std::size_t c = 0; c < 3; ++c)
        pixel[c] = static_cast<std::uint8_t>(std::clamp(mean[c] + 0.5f, 0.0f, 255.0f));
    }
  }
}

RenderedPanorama PanoramaRenderer::render(const PanoramaView& view, std::span<const RawView> images,
                                          std::uint32_t blind, const DepthPanorama* depth, WorkerPool& pool) const {
  Scene scene{view,
              images,
              depth,
              {},
              {},
              {},
              view.R_head_view.toRotationMatrix().cast<float>(),
              static_cast<float>(1 / head_.panorama.stitching_radius_m)};
  const auto& lenses = projector_.lenses();
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    const RawView& image = images[lenses[i].camera];
    const bool fits = image.data && lenses[i].x_offset + lenses[i].width <= image.width &&
                      lenses[i].y_offset + lenses[i].height <= image.height;
    if (fits && (blind >> i & 1u) == 0) scene.lenses.push_back(i);
  }
  scene.low.resize(lenses.size());
  scene.gains.assign(lenses.size(), {1.0f, 1.0f, 1.0f});
  if (config_.blend == PanoramaBlend::Bands || config_.even_gains) {
    pool.run(scene.lenses.size(), [&](std::size_t i) {
      const FloatLens& lens = lenses[scene.lenses[i]];
      scene.low[scene.lenses[i]] = low_image(lens, images[lens.camera]);
    });
    if (config_.even_gains) scene.gains = solve_gains(scene, pool);
  }
  RenderedPanorama out;
  out.picture.width = view.shape.width;
  out.picture.height = view.shape.height;
  out.picture.pixels.resize(3 * std::size_t{view.shape.width} * view.shape.height);
  std::vector<std::uint64_t> seen((view.shape.height + kRowsOfPiece - 1) / kRowsOfPiece);
  pool.run(seen.size(), [&](std::size_t piece) {
    const auto from = static_cast<std::uint32_t>(piece) * kRowsOfPiece;
    render_rows(scene, from, std::min(view.shape.height, from + kRowsOfPiece), out.picture, seen[piece]);
  });
  std::uint64_t total = 0;
  for (const std::uint64_t one : seen) total += one;
  out.seen_share = static_cast<double>(total) / (static_cast<double>(view.shape.width) * view.shape.height);
  out.gains = scene.gains;
  return out;
}

}  // namespace hueline::fusion
