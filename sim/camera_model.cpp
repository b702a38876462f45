#include "sim/camera_model.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

#include "sim/exposure_control.hpp"
#include "sim/noise.hpp"

namespace hueline::sim {
namespace {
constexpr int kBlockRows = 8;
}

/// The rows `first` to `first + rows - 1` of a lens.
struct PanoramicCamera::Block {
  int first = 0, rows = 0;
  std::vector<Radiance> light;
  std::vector<std::uint32_t> face;
};

PanoramicCamera::PanoramicCamera(const Scenario& scenario, const Motion& motion, const World& world)
    : scenario_(scenario),
      motion_(motion),
      world_(world),
      rig_(rig_truth(scenario)),
      tone_(scenario.camera.tone_curve, scenario.camera.gain),
      shutter_(scenario),
      exposures_(0) {
  const double longest = scenario.camera.auto_exposure ? scenario.camera.auto_exposure_limit : 1;
  while (exposure_start(exposures_) + shutter_.exposure_ns(static_cast<float>(longest)) < scenario.sensors_end_gps_ns())
    ++exposures_;
  gains_ = sim::lens_gains(scenario, world, motion, rig_, exposures_);
  for (const TrueLens& optics : rig_.lenses) {
    Lens lens;
    lens.optics = optics;
    lens.cone = static_cast<float>(1 / optics.focal_x);
    lens.directions.resize(3 * static_cast<std::size_t>(optics.width) * static_cast<std::size_t>(optics.height));
    float* out = lens.directions.data();
    double lowest = 1;
    for (int v = 0; v < optics.height; ++v)
      for (int u = 0; u < optics.width; ++u, out += 3)
        if (const auto d = optics.ray(u, v)) {
          out[0] = static_cast<float>(d->x);
          out[1] = static_cast<float>(d->y);
          out[2] = static_cast<float>(d->z);
          lowest = std::min(lowest, d->z);
        }
    lens.dim = static_cast<float>(scenario.camera.vignetting / std::max(1e-6, 1 - lowest));
    lenses_.push_back(std::move(lens));
  }
}

Pose PanoramicCamera::T_enu_head(std::size_t number) const {
  const GpsNs mid = exposure_mid(number);
  return motion_.T_enu_body(mid) * rig_.T_body_head_at(mid);
}

std::vector<Moment> PanoramicCamera::moments(std::size_t number, std::size_t lens, double row) const {
  // The samples are spread evenly over the exposure; a single one is at its middle.
  std::vector<Moment> out;
  const int samples = scenario_.camera.blur_samples;
  const GpsNs start = shutter_.true_start(number) + shutter_.row_delay(row),
              duration = shutter_.exposure_ns(gains_[number][lens]);
  for (int i = 0; i < samples; ++i) out.push_back(world_.moment(start + duration * (2 * i + 1) / (2 * samples)));
  return out;
}

/// Returns the moments of a lens's rows, if all its rows are exposed at once.
PanoramicCamera::Moments PanoramicCamera::moments_of_lens(std::size_t number, std::size_t lens) const {
  return {moments(number, lens, 0.5 * (scenario_.camera.lens_height - 1))};
}

void PanoramicCamera::expose_rows(std::size_t number, std::size_t lens, const Moments& all_rows, Block& block,
                                  std::vector<std::uint8_t>& image) const {
  Moments by_rows;
  if (shutter_.is_rolling())
    for (int row = 0; row < block.rows; ++row) by_rows.push_back(moments(number, lens, block.first + row));
  const Moments& used = shutter_.is_rolling() ? by_rows : all_rows;
  render(lenses_[lens], used, block);
  if (scenario_.camera.antialias) smooth_outlines(lenses_[lens], used, block);
  develop(number, lens, block, image);
}

std::vector<std::uint8_t> PanoramicCamera::expose(std::size_t number, unsigned threads) const {
  std::vector<Moments> all_rows;
  for (std::size_t lens = 0; lens < lenses_.size(); ++lens) all_rows.push_back(moments_of_lens(number, lens));
  std::vector<std::uint8_t> image(static_cast<std::size_t>(rig_.image_width()) *
                                  static_cast<std::size_t>(rig_.image_height()));
  const int blocks = (scenario_.camera.lens_height + kBlockRows - 1) / kBlockRows;
  const int total = blocks * static_cast<int>(lenses_.size());
  std::atomic<int> next{0};
  const auto work = [&] {
    Block block;
    for (int task; (task = next.fetch_add(1)) < total;) {
      block.first = task % blocks * kBlockRows;
      block.rows = std::min(kBlockRows, scenario_.camera.lens_height - block.first);
      const auto lens = static_cast<std::size_t>(task / blocks);
      expose_rows(number, lens, all_rows[lens], block, image);
    }
  };
  {
    std::vector<std::jthread> others;
    for (unsigned i = 1; i < threads; ++i) others.emplace_back(work);
    work();
  }
  return image;
}

std::vector<std::uint8_t> PanoramicCamera::expose_lens(std::size_t number, std::size_t lens) const {
  const Moments all_rows = moments_of_lens(number, lens);
  std::vector<std::uint8_t> image(static_cast<std::size_t>(rig_.image_width()) *
                                  static_cast<std::size_t>(rig_.image_height()));
  Block block;
  for (block.first = 0; block.first < scenario_.camera.lens_height; block.first += kBlockRows) {
    block.rows = std::min(kBlockRows, scenario_.camera.lens_height - block.first);
    expose_rows(number, lens, all_rows, block, image);
  }
  return image;
}

void PanoramicCamera::render(const Lens& lens, const Moments& moments, Block& block) const {
  const int width = lens.optics.width;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(block.rows);
  block.light.assign(pixels, {});
  block.face.assign(pixels, 0);
  const float share = 1.0f / static_cast<float>(moments[0].size());
  std::array<World::Ray, World::kBatch> rays;
  std::array<Seen, World::kBatch> seen;
  std::array<std::size_t, World::kBatch> target;
  // Tiles of 4 x 2 pixels keep the rays of a batch close together. Rows with moments of their own are traced in tiles
  // of 8 x 1.
  const bool by_row = moments.size() > 1;
  const int tile_rows = by_row ? 1 : 2, tile_columns = by_row ? 8 : 4;
  for (int y = 0; y < block.rows; y += tile_rows)
    for (const Moment& moment : moments[by_row ? static_cast<std::size_t>(y) : 0]) {
      const Pose T = moment.T_enu_body * rig_.T_body_head_at(moment.gps_ns) * lens.optics.T_head_lens;
      for (int x = 0; x < width; x += tile_columns) {
        std::size_t n = 0;
        for (int k = 0; k < 8; ++k) {
          const int u = x + k % tile_columns, v = y + k / tile_columns;
          if (u >= width || v >= block.rows) continue;
          const auto pixel =
              static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
          const float* d =
              &lens.directions[3 * (static_cast<std::size_t>(block.first) * static_cast<std::size_t>(width) + pixel)];
          if (d[2] == 0) continue;
          rays[n] = {T.p, T.R * Vec3{d[0], d[1], d[2]}};
          target[n++] = pixel;
        }
        if (n == 0) continue;
        world_.look(moment, std::span(rays).first(n), lens.cone, std::span(seen).first(n));
        for (std::size_t i = 0; i < n; ++i) {
          Radiance& l = block.light[target[i]];
          l = {l.r + share * seen[i].colour.r, l.g + share * seen[i].colour.g, l.b + share * seen[i].colour.b};
          block.face[target[i]] = seen[i].is_hit ? seen[i].face + 1 : 0;
        }
      }
    }
}

void PanoramicCamera::smooth_outlines(const Lens& lens, const Moments& moments, Block& block) const {
  const auto width = static_cast<std::size_t>(lens.optics.width);
  std::vector<std::vector<std::size_t>> edges(moments.size());  // grouped by rows that share their moments
  for (std::size_t y = 0; y < static_cast<std::size_t>(block.rows); ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      const bool differs = (x > 0 && block.face[i] != block.face[i - 1]) ||
                           (x + 1 < width && block.face[i] != block.face[i + 1]) ||
                           (y > 0 && block.face[i] != block.face[i - width]) ||
                           (y + 1 < static_cast<std::size_t>(block.rows) && block.face[i] != block.face[i + width]);
      if (differs) edges[moments.size() == 1 ? 0 : y].push_back(i);
    }
  // Three additional samples a pixel; together with the centre they form a skewed lattice.
  static constexpr std::array<std::array<float, 2>, 3> kOffsets{{{-0.38f, 0.18f}, {0.12f, -0.38f}, {0.36f, 0.32f}}};
  const float share = 0.25f / static_cast<float>(moments[0].size());
  for (std::size_t group = 0; group < edges.size(); ++group) {
    for (const std::size_t i : edges[group])
      block.light[i] = {0.25f * block.light[i].r, 0.25f * block.light[i].g, 0.25f * block.light[i].b};
    for (const Moment& moment : moments[group]) sample_outlines(lens, moment, edges[group], share, kOffsets, block);
  }
}

void PanoramicCamera::sample_outlines(const Lens& lens, const Moment& moment, const std::vector<std::size_t>& edges,
                                      float share, std::span<const std::array<float, 2>> offsets, Block& block) const {
  const auto width = static_cast<std::size_t>(lens.optics.width);
  const auto first = static_cast<std::size_t>(block.first);
  const Pose T = moment.T_enu_body * rig_.T_body_head_at(moment.gps_ns) * lens.optics.T_head_lens;
  std::array<World::Ray, World::kBatch> rays;
  std::array<Seen, World::kBatch> seen;
  std::array<std::size_t, World::kBatch> target;
  std::size_t n = 0;
  const auto flush = [&] {
    world_.look(moment, std::span(rays).first(n), lens.cone, std::span(seen).first(n));
    for (std::size_t k = 0; k < n; ++k) {
      Radiance& l = block.light[target[k]];
      l = {l.r + share * seen[k].colour.r, l.g + share * seen[k].colour.g, l.b + share * seen[k].colour.b};
    }
    n = 0;
  };
  for (const std::size_t i : edges) {
    const std::size_t at = first * width + i, x = i % width, y = at / width;
    const float* d = &lens.directions[3 * at];
    // Directions vary smoothly, so a direction between pixels is interpolated with the pixels to the right and below;
    // at the right and lower borders with those to the left and above.
    const float* right = x + 1 < width ? d + 3 : d - 3;
    const float* below = y + 1 < static_cast<std::size_t>(lens.optics.height) ? d + 3 * width : d - 3 * width;
    const float su = x + 1 < width ? 1.0f : -1.0f,
                sv = y + 1 < static_cast<std::size_t>(lens.optics.height) ? 1.0f : -1.0f;
    if (d[2] == 0 || right[2] == 0 || below[2] == 0) continue;
    for (const auto& [du, dv] : offsets) {
      std::array<float, 3> e;
      for (std::size_t k = 0; k < 3; ++k) e[k] = d[k] + su * du * (right[k] - d[k]) + sv * dv * (below[k] - d[k]);
      rays[n] = {T.p, normalised(T.R * Vec3{e[0], e[1], e[2]})};
      target[n++] = i;
      if (n == World::kBatch) flush();
    }
  }
  if (n > 0) flush();
}

void PanoramicCamera::develop(std::size_t number, std::size_t index, const Block& block,
                              std::vector<std::uint8_t>& image) const {
  const Lens& lens = lenses_[index];
  const auto width = static_cast<std::size_t>(lens.optics.width), stack = static_cast<std::size_t>(rig_.image_width());
  const auto column = static_cast<std::size_t>(rig_.column_of(index)),
             row = static_cast<std::size_t>(rig_.row_of(index));
  const auto well = static_cast<float>(scenario_.camera.full_well_electrons);
  const auto read2 = static_cast<float>(scenario_.camera.read_noise_electrons * scenario_.camera.read_noise_electrons);
  const float gain = gains_[number][index], amplification = shutter_.amplification(gain);
  const std::uint64_t key =
      scrambled(scenario_.seed ^ scrambled(kStreamPixel + (static_cast<std::uint64_t>(number) << 8)));
  for (std::size_t y = 0; y < static_cast<std::size_t>(block.rows); ++y) {
    const std::size_t v = static_cast<std::size_t>(block.first) + y;
    std::uint8_t* out = &image[(row + v) * stack + column];
    for (std::size_t u = 0; u < width; ++u) {
      const Radiance& l = block.light[y * width + u];
      const float colour = v % 2 == 0 ? (u % 2 == 0 ? l.r : l.g) : (u % 2 == 0 ? l.g : l.b);
      const float cosine = lens.directions[3 * (v * width + u) + 2];
      float x = tone_.gain() * gain * colour * (1 - lens.dim * (1 - cosine));
      if (scenario_.noise) {
        // Amplification is applied after the electrons, so a dark lens is noisy.
        const float electrons = std::min(x, 1.2f) / amplification * well;
        const std::uint64_t pixel = (row + v) * stack + column + u;
        x += std::sqrt(electrons + read2) / well * amplification * quick_gaussian(scrambled(key + pixel));
      }
      out[u] = tone_(x);
    }
  }
}

}  // namespace hueline::sim
