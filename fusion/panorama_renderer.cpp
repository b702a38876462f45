#include "fusion/panorama_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "core/portable_math.hpp"
#include "fusion/head_motion.hpp"
#include "fusion/panorama_scene.hpp"
#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {

using std::numbers::pi;
constexpr std::uint32_t kRowsAtATime = 32;
/// A lens fades out over this angle towards the border of its image and towards its masks, rad.
constexpr double kRamp = 0.05;
constexpr double kLowCell = 0.015;  // width of a cell of a low image, rad
constexpr int kLowBlur = 2;         // cells to each side, twice
/// Levels of a low image that are neither too dark to measure nor saturated.
constexpr float kDarkest = 6, kBrightest = 240;
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

/// Sums of the pixels of a cell that show something: by channel of an RGB image, by parity of column and row of a
/// mosaic.
struct CellSums {
  std::array<std::uint32_t, 4> sum{}, count{};
};

/// Adds the cell with `from` as its first pixel, `across` x `down` pixels. `clearance` is that of its first pixel, or
/// null; both have rows of so many bytes.
void add_cell(const std::uint8_t* from, std::size_t stride, const std::uint8_t* clearance, std::size_t clearance_stride,
              int across, int down, bool is_rgb, CellSums& out) {
  for (int j = 0; j < down; ++j, from += stride) {
    if (is_rgb) {
      for (int i = 0; i < across; ++i) {
        const std::uint32_t shows = clearance == nullptr || clearance[i] != 0;
        for (std::size_t c = 0; c < 3; ++c) out.sum[c] += shows * from[3 * static_cast<std::size_t>(i) + c];
        for (std::size_t c = 0; c < 3; ++c) out.count[c] += shows;
      }
    } else {
      const auto quad = 2 * static_cast<std::size_t>(j & 1);
      for (int i = 0; i + 1 < across; i += 2) {
        const std::uint32_t left = clearance == nullptr || clearance[i] != 0,
                            right = clearance == nullptr || clearance[i + 1] != 0;
        out.sum[quad] += left * from[i], out.count[quad] += left;
        out.sum[quad + 1] += right * from[i + 1], out.count[quad + 1] += right;
      }
    }
    if (clearance != nullptr) clearance += clearance_stride;
  }
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

PanoramaEye PanoramaRenderer::eye_of(const FloatLens& lens, const HeadShot& shot, int rank) const {
  PanoramaEye eye{.lens = lens, .image = shot.images[lens.camera], .rank = rank};
  eye.lens.mask = eye.lens.margin = {};  // clearance_ knows more
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> R(lens.R_lens_head.data());
  const Eigen::Map<const Eigen::Vector3f> t(lens.t_lens_head.data());
  const Eigen::Matrix3f R_head = R * shot.T_shot_head.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t_head = R * shot.T_shot_head.translation.cast<float>() + t;
  for (int i = 0; i < 9; ++i) eye.lens.R_lens_head[static_cast<std::size_t>(i)] = R_head(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    eye.lens.t_lens_head[at] = t_head[i];
    eye.lens.axis[at] = R_head(2, i);
  }
  eye.motion = motion_from(shot.motion, shot.T_shot_head);
  // The vehicle may be shown, but not where it was at another moment.
  if (config_.hide_vehicle || rank > 0) eye.clearance = clearance_[lens.index];
  eye.ramp_px = ramp_px_[lens.index];
  return eye;
}

bool PanoramaRenderer::fits(const FloatLens& lens, const RawView& image) {
  return image.data && lens.x_offset + lens.width <= image.width && lens.y_offset + lens.height <= image.height;
}

std::vector<LowImage> PanoramaRenderer::low_images(std::span<const RawView> images, WorkerPool& pool) const {
  std::vector<LowImage> out(projector_.lenses().size());
  if (config_.blend != PanoramaBlend::Bands && !config_.even_gains) return out;
  pool.run(out.size(), [&](std::size_t i) {
    const FloatLens& lens = projector_.lenses()[i];
    if (fits(lens, images[lens.camera])) out[i] = low_image(lens, images[lens.camera]);
  });
  return out;
}

LowImage PanoramaRenderer::low_image(const FloatLens& lens, const RawView& image) const {
  const auto& clearance = clearance_[lens.index];
  const int cell = std::max(2, static_cast<int>(std::lround(kLowCell * lens.focal_x / 2)) * 2);
  LowImage out;
  const int lens_width = static_cast<int>(lens.width), lens_height = static_cast<int>(lens.height);
  out.width = std::max(2, lens_width / cell);
  out.height = std::max(2, lens_height / cell);
  out.scale = 1.0f / static_cast<float>(cell);
  const bool is_rgb = image.format == PixelFormat::Rgb8;
  // The channels of a mosaic's quads, whose rows and columns count from a cell's first pixel.
  std::array<std::size_t, 4> channel{};
  if (const auto red = red_parity(image.format))
    for (std::size_t i = 0; i < 4; ++i) {
      const bool is_red_column = static_cast<int>((lens.x_offset + i) & 1u) == red->x,
                 is_red_row = static_cast<int>((lens.y_offset + i / 2) & 1u) == red->y;
      channel[i] = is_red_column != is_red_row ? 1 : is_red_row ? 0 : 2;
    }
  std::vector<std::array<float, 4>> cells(static_cast<std::size_t>(out.width) * out.height);
  for (int cy = 0; cy < out.height; ++cy)
    for (int cx = 0; cx < out.width; ++cx) {
      const int x = cx * cell, y = cy * cell;
      if (x >= lens_width || y >= lens_height) continue;
      const std::size_t column = std::size_t{lens.x_offset} + static_cast<std::size_t>(x),
                        row = std::size_t{lens.y_offset} + static_cast<std::size_t>(y);
      CellSums sums;
      add_cell(image.data + row * image.stride + (is_rgb ? 3 * column : column), image.stride,
               clearance.empty() ? nullptr : &clearance[static_cast<std::size_t>(y) * lens.width + x], lens.width,
               std::min(cell, lens_width - x), std::min(cell, lens_height - y), is_rgb, sums);
      std::array<std::uint32_t, 3> sum{}, count{};
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t c = is_rgb ? std::min<std::size_t>(i, 2) : channel[i];
        sum[c] += sums.sum[i];
        count[c] += sums.count[i];
      }
      if (image.format == PixelFormat::Mono8) sum.fill(sum[0]), count.fill(count[0]);
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

void PanoramaRenderer::solve_gains(PanoramaScene& scene, WorkerPool& pool) const {
  // The brightness of places that two lenses see, from the low images, which small errors of distance do not change.
  constexpr std::uint32_t kRows = 128, kColumns = 2 * kRows;
  const std::size_t n = scene.eyes.size();
  struct Pair {
    std::size_t a, b;
    std::array<float, 3> ratio;  // a divided by b
  };
  PanoramaColumns columns;
  for (std::uint32_t c = 0; c < kColumns; ++c)
    columns.push_back(scene.column((c + 0.5) * scene.view.shape.width / kColumns - 0.5));
  std::vector<std::vector<Pair>> rows(kRows);
  pool.run(kRows, [&](std::size_t index) {
    PanoramaPlaces places;
    places.find(scene, columns, 0, kColumns,
                scene.row((static_cast<double>(index) + 0.5) * scene.view.shape.height / kRows - 0.5));
    PanoramaLook look;
    std::vector<std::pair<std::size_t, Rgb>> seen(kColumns * n);  // of each place, the first so many
    std::vector<std::size_t> eyes_of(kColumns);
    for (std::size_t e = 0; e < n; ++e) {
      if (!look.look(scene.eyes[e], places)) continue;
      for (std::uint32_t c = 0; c < kColumns; ++c) {
        if (look.ramp[c] <= 0) continue;
        const Rgb light = scene.eyes[e].low->at(look.sights.x[c], look.sights.y[c]);
        const auto [low, high] = std::minmax({light.red, light.green, light.blue});
        if (low >= kDarkest && high <= kBrightest) seen[c * n + eyes_of[c]++] = {e, light};
      }
    }
    for (std::size_t c = 0; c < kColumns; ++c) {
      const std::span of_place(&seen[c * n], eyes_of[c]);
      // Two lenses of other moments say nothing about how bright those of this one are.
      for (std::size_t i = 0; i < of_place.size() && scene.eyes[of_place[i].first].rank == 0; ++i)
        for (std::size_t j = i + 1; j < of_place.size(); ++j) {
          const Rgb &x = of_place[i].second, &y = of_place[j].second;
          rows[index].push_back(
              {of_place[i].first, of_place[j].first, {x.red / y.red, x.green / y.green, x.blue / y.blue}});
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
        const double ratio = portable::log(median(common)), weight = std::sqrt(static_cast<double>(common.size()));
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

RenderedPanorama PanoramaRenderer::render(const PanoramaView& view, const HeadShot& shot,
                                          std::span<const HeadShot> others, const DepthPanorama* depth,
                                          WorkerPool& pool) const {
  PanoramaScene scene(view, depth, 1 + static_cast<int>(others.size()),
                      static_cast<float>(1 / head_.panorama.stitching_radius_m), natural_width());
  std::vector<std::vector<LowImage>> made(static_cast<std::size_t>(scene.ranks));
  for (int rank = 0; rank < scene.ranks; ++rank) {
    const HeadShot& from = rank == 0 ? shot : others[static_cast<std::size_t>(rank - 1)];
    std::span<const LowImage> low = from.low;
    if (low.empty()) low = made[static_cast<std::size_t>(rank)] = low_images(from.images, pool);
    for (const FloatLens& lens : projector_.lenses()) {
      if (!fits(lens, from.images[lens.camera]) || (from.blind >> lens.index & 1u) != 0) continue;
      scene.eyes.push_back(eye_of(lens, from, rank));
      scene.eyes.back().low = &low[lens.index];
    }
  }
  if (config_.even_gains) solve_gains(scene, pool);
  RenderedPanorama out;
  out.picture.width = view.shape.width;
  out.picture.height = view.shape.height;
  out.picture.pixels.resize(3 * std::size_t{view.shape.width} * view.shape.height);
  std::vector<std::array<std::uint64_t, 2>> seen((view.shape.height + kRowsAtATime - 1) / kRowsAtATime);
  pool.run(seen.size(), [&](std::size_t piece) {
    const auto from = static_cast<std::uint32_t>(piece) * kRowsAtATime;
    PanoramaPainter(scene, config_, hole_cosine_)
        .paint(from, std::min(view.shape.height, from + kRowsAtATime), out.picture, seen[piece][0], seen[piece][1]);
  });
  const double pixels = static_cast<double>(view.shape.width) * view.shape.height;
  for (const auto& [own, filled] : seen) {
    out.seen_share += static_cast<double>(own) / pixels;
    out.filled_share += static_cast<double>(filled) / pixels;
  }
  out.gains.assign(projector_.lenses().size(), {1.0f, 1.0f, 1.0f});
  for (const PanoramaEye& eye : scene.eyes)
    if (eye.rank == 0) out.gains[eye.lens.index] = eye.gain;
  return out;
}

}  // namespace hueline::fusion
