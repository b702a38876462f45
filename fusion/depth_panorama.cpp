#include "fusion/depth_panorama.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/portable_math.hpp"
#include "fusion/panorama_cells.hpp"
#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {

using std::numbers::pi;
constexpr std::size_t kPointsOfPiece = 16384;
constexpr std::uint32_t kRowsOfPiece = 32;
/// Weight of `unknown_m` at the coarsest level of the pyramid, where a cell with points has the weight 1.
constexpr float kUnknownWeight = 1e-3f;

/// Keeps the larger of two numbers that are not negative; such floats are ordered as their bits are.
void keep_larger(float& cell, float value) {
  std::atomic_ref<std::uint32_t> bits(reinterpret_cast<std::uint32_t&>(cell));
  const auto wanted = std::bit_cast<std::uint32_t>(value);
  std::uint32_t now = bits.load(std::memory_order_relaxed);
  while (now < wanted && !bits.compare_exchange_weak(now, wanted, std::memory_order_relaxed)) {
  }
}

/// Calls work(row) for all rows, divided into pieces.
template <class Work>
void for_rows(WorkerPool& pool, std::uint32_t rows, const Work& work) {
  pool.run((rows + kRowsOfPiece - 1) / kRowsOfPiece, [&](std::size_t piece) {
    const auto from = static_cast<std::uint32_t>(piece) * kRowsOfPiece;
    for (std::uint32_t row = from; row < std::min(rows, from + kRowsOfPiece); ++row) work(row);
  });
}

/// A level of the pyramid that fills cells without points: sums of nearness times weight, and the weights.
struct Level {
  std::uint32_t width = 0, height = 0;
  std::vector<float> value, weight;
  std::size_t at(std::uint32_t x, std::uint32_t y) const { return static_cast<std::size_t>(y) * width + x; }
};

/// Returns a level of half the size.
Level halved(const Level& fine, WorkerPool& pool) {
  Level out{(fine.width + 1) / 2, (fine.height + 1) / 2, {}, {}};
  out.value.resize(static_cast<std::size_t>(out.width) * out.height);
  out.weight.resize(out.value.size());
  for_rows(pool, out.height, [&](std::uint32_t y) {
    for (std::uint32_t x = 0; x < out.width; ++x) {
      float value = 0, weight = 0;
      for (std::uint32_t j = 2 * y; j < std::min(2 * y + 2, fine.height); ++j)
        for (std::uint32_t i = 2 * x; i < std::min(2 * x + 2, fine.width); ++i) {
          value += fine.value[fine.at(i, j)] * fine.weight[fine.at(i, j)];
          weight += fine.weight[fine.at(i, j)];
        }
      const std::size_t at = out.at(x, y);
      out.value[at] = weight > 0 ? value / weight : 0.0f;
      out.weight[at] = std::min(1.0f, weight);
    }
  });
  return out;
}

/// Returns the value of a level at a place of the next finer level, between its four nearest cells.
float between(const Level& coarse, std::uint32_t x, std::uint32_t y) {
  const std::uint32_t cx = x / 2, cy = y / 2;
  const std::uint32_t beside = x % 2 == 0 ? (cx + coarse.width - 1) % coarse.width : (cx + 1) % coarse.width;
  const std::uint32_t below = y % 2 == 0 ? (cy == 0 ? 0 : cy - 1) : std::min(cy + 1, coarse.height - 1);
  return 0.5625f * coarse.value[coarse.at(cx, cy)] + 0.1875f * coarse.value[coarse.at(beside, cy)] +
         0.1875f * coarse.value[coarse.at(cx, below)] + 0.0625f * coarse.value[coarse.at(beside, below)];
}

}  // namespace

DepthPanorama::DepthPanorama(const Config& config)
    : config_(config), width_(config.width), height_(config.width / 2), cells_(std::size_t{width_} * height_) {}

void DepthPanorama::clear() {
  std::fill(cells_.begin(), cells_.end(), 0.0f);
  known_share_ = 0;
}

void DepthPanorama::add(std::span<const Eigen::Vector3f> points, WorkerPool& pool) {
  pool.run((points.size() + kPointsOfPiece - 1) / kPointsOfPiece, [&](std::size_t piece) {
    const std::size_t from = piece * kPointsOfPiece;
    PanoramaCells found;
    find_cells(width_, points.subspan(from, std::min(kPointsOfPiece, points.size() - from)), found);
    for (std::size_t i = 0; i < found.nearness.size(); ++i) {
      if (!(found.nearness[i] > 0)) continue;
      float* cells = &cells_[static_cast<std::size_t>(found.row[i]) * width_];
      if (found.reach[i] == 0) {
        keep_larger(cells[found.column[i]], found.nearness[i]);
        continue;
      }
      const auto width = static_cast<std::int32_t>(width_);
      for (std::int32_t x = found.column[i] - found.reach[i]; x <= found.column[i] + found.reach[i]; ++x)
        keep_larger(cells[(x + width) % width], found.nearness[i]);
    }
  });
}

int DepthPanorama::reach_of_row(std::uint32_t row) const {
  const double sine = portable::sin((row + 0.5) * pi / height_), cells = config_.gap * width_ / (2 * pi);
  return std::min(static_cast<int>(std::lround(cells / std::max(sine, 1e-3))), static_cast<int>(width_ / 8));
}

void DepthPanorama::close_gaps(WorkerPool& pool) {
  // The closing of mathematical morphology: the largest value within the window, then the smallest of those. Each is
  // done for rows, then for columns. Only the windows of the rows depend on the row.
  const int reach = static_cast<int>(std::lround(config_.gap * width_ / (2 * pi)));
  std::vector<float> other(cells_.size());
  const auto along_rows = [&](const std::vector<float>& in, std::vector<float>& out, const auto& choose) {
    for_rows(pool, height_, [&](std::uint32_t y) {
      const int window = reach_of_row(y), width = static_cast<int>(width_), size = 2 * window + 1;
      // The values of a row, wrapped around, and the extremes from the beginning and to the end of blocks of the
      // window's size: every window is the end of one block and the beginning of the next (van Herk).
      const int length = width + 2 * window;
      std::vector<float> row(static_cast<std::size_t>(length)), ahead(row.size()), back(row.size());
      const float* from = &in[static_cast<std::size_t>(y) * width_];
      std::copy(from + width - window, from + width, row.begin());
      std::copy(from, from + width, row.begin() + window);
      std::copy(from, from + window, row.end() - window);
      for (int block = 0; block < length; block += size) {
        const auto first = static_cast<std::size_t>(block),
                   last = static_cast<std::size_t>(std::min(block + size, length) - 1);
        ahead[first] = row[first];
        for (std::size_t i = first + 1; i <= last; ++i) ahead[i] = choose(ahead[i - 1], row[i]);
        back[last] = row[last];
        for (std::size_t i = last; i-- > first;) back[i] = choose(back[i + 1], row[i]);
      }
      float* to = &out[static_cast<std::size_t>(y) * width_];
      for (int x = 0; x < width; ++x)
        to[x] = choose(back[static_cast<std::size_t>(x)], ahead[static_cast<std::size_t>(x + 2 * window)]);
    });
  };
  const auto along_columns = [&](const std::vector<float>& in, std::vector<float>& out, const auto& choose) {
    for_rows(pool, height_, [&](std::uint32_t y) {
      const auto first = static_cast<std::uint32_t>(std::max(0, static_cast<int>(y) - reach));
      const auto last =
          static_cast<std::uint32_t>(std::min(static_cast<int>(height_) - 1, static_cast<int>(y) + reach));
      float* to = &out[static_cast<std::size_t>(y) * width_];
      std::copy_n(&in[static_cast<std::size_t>(first) * width_], width_, to);
      for (std::uint32_t j = first + 1; j <= last; ++j) {
        const float* from = &in[static_cast<std::size_t>(j) * width_];
        for (std::uint32_t x = 0; x < width_; ++x) to[x] = choose(to[x], from[x]);
      }
    });
  };
  const auto larger = [](float a, float b) { return a > b ? a : b; };
  const auto smaller = [](float a, float b) { return a < b ? a : b; };
  along_rows(cells_, other, larger);
  along_columns(other, cells_, larger);
  along_rows(cells_, other, smaller);
  along_columns(other, cells_, smaller);
}

void DepthPanorama::fill(WorkerPool& pool) {
  std::vector<Level> levels(1);
  levels[0] = {width_, height_, cells_, std::vector<float>(cells_.size())};
  for (std::size_t i = 0; i < cells_.size(); ++i) levels[0].weight[i] = cells_[i] > 0 ? 1.0f : 0.0f;
  while (levels.back().height > 2) levels.push_back(halved(levels.back(), pool));
  Level& top = levels.back();
  const auto unknown = static_cast<float>(1 / config_.unknown_m);
  for (std::size_t i = 0; i < top.value.size(); ++i)
    top.value[i] = (top.value[i] * top.weight[i] + unknown * kUnknownWeight) / (top.weight[i] + kUnknownWeight);
  for (std::size_t n = levels.size() - 1; n-- > 0;) {
    Level& fine = levels[n];
    const Level& coarse = levels[n + 1];
    for_rows(pool, fine.height, [&](std::uint32_t y) {
      for (std::uint32_t x = 0; x < fine.width; ++x) {
        const std::size_t at = fine.at(x, y);
        if (fine.weight[at] < 1.0f)
          fine.value[at] = fine.weight[at] * fine.value[at] + (1.0f - fine.weight[at]) * between(coarse, x, y);
      }
    });
  }
  cells_ = std::move(levels[0].value);
}

void DepthPanorama::close(WorkerPool& pool) {
  known_share_ = static_cast<double>(std::count_if(cells_.begin(), cells_.end(), [](float c) { return c > 0; })) /
                 static_cast<double>(cells_.size());
  close_gaps(pool);
  fill(pool);
}

void DepthPanorama::nearness_of_row(std::span<const float> across, float down, float* out) const {
  const float y = down * static_cast<float>(height_) - 0.5f;
  const float top = std::clamp(std::floor(y), 0.0f, static_cast<float>(height_ - 1));
  const float wy = std::clamp(y - top, 0.0f, 1.0f);
  const auto row = static_cast<std::size_t>(top), below = std::min<std::size_t>(row + 1, height_ - 1);
  const float* a = &cells_[row * width_];
  const float* b = &cells_[below * width_];
  const auto width = static_cast<std::int32_t>(width_);
  for (std::size_t i = 0; i < across.size(); ++i) {
    const float x = across[i] * static_cast<float>(width_) - 0.5f;
    auto column = static_cast<std::int32_t>(x + 1.0f) - 1;
    const float wx = x - static_cast<float>(column);
    if (column < 0) column += width;
    if (column >= width) column -= width;
    const std::int32_t next = column + 1 == width ? 0 : column + 1;
    const float upper = a[column] + wx * (a[next] - a[column]), lower = b[column] + wx * (b[next] - b[column]);
    out[i] = upper + wy * (lower - upper);
  }
}

}  // namespace hueline::fusion
