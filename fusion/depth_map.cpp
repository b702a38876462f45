// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time. The loops are written so that the compiler turns them into vector instructions.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/depth_map.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "fusion/depth_map.hpp"

#ifndef HUELINE_FUSION_DEPTH_MAP_ONCE
#define HUELINE_FUSION_DEPTH_MAP_ONCE
namespace hueline::fusion {
/// How far the filters of a row reach to the left and right, in cells. Near the poles a cell is narrower.
struct RowReach {
  int gap, guard;
};
/// What a closing works on. Each row has `pad` cells more on both sides, which repeat those of the other side.
struct DepthClosing {
  DepthMap::Config config;
  int columns = 0, rows = 0, pad = 0, gap = 0, guard = 0;
  float tolerance = 0, share = 0;
  std::vector<RowReach> reach;
  std::vector<float> closed, far, outline, guarded, slope, scratch;
  std::ptrdiff_t stride() const { return columns + 2 * pad; }
  std::size_t size() const { return static_cast<std::size_t>(stride()) * static_cast<std::size_t>(rows); }
};
constexpr int kMostCells = 8;  // largest reach to the left and right
}  // namespace hueline::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {

struct Nearer {
  static float of(float a, float b) { return a > b ? a : b; }
};
struct Farther {
  static float of(float a, float b) { return a < b ? a : b; }
};

/// Replaces each value by the extreme of those within the reach in its row and then in its column.
template <class Extreme, class ReachOf>
void filter(std::vector<float>& values, DepthClosing& closing, int vertical, const ReachOf& reach_of) {
  const std::ptrdiff_t stride = closing.stride();
  std::vector<float>& scratch = closing.scratch;
  for (int y = 0; y < closing.rows; ++y) {
    const float* __restrict in = values.data() + y * stride;
    float* __restrict out = scratch.data() + y * stride;
    const int reach = reach_of(y);
    for (std::ptrdiff_t x = 0; x < stride; ++x) out[x] = in[x];
    for (int k = 1; k <= reach; ++k)
      for (std::ptrdiff_t x = k; x < stride - k; ++x) out[x] = Extreme::of(out[x], Extreme::of(in[x - k], in[x + k]));
  }
  for (int y = 0; y < closing.rows; ++y) {
    float* __restrict out = values.data() + y * stride;
    const int first = std::max(0, y - vertical), last = std::min(closing.rows - 1, y + vertical);
    std::memcpy(out, scratch.data() + first * stride, static_cast<std::size_t>(stride) * sizeof(float));
    for (int k = first + 1; k <= last; ++k) {
      const float* __restrict in = scratch.data() + k * stride;
      for (std::ptrdiff_t x = 0; x < stride; ++x) out[x] = Extreme::of(out[x], in[x]);
    }
  }
}

/// Returns the difference to the neighbour that is smaller in size; 0 if the two have different signs.
inline float gentler(float back, float ahead) {
  const float size_back = std::abs(back), size_ahead = std::abs(ahead);
  const float smaller = size_back < size_ahead ? back : ahead;
  return back * ahead > 0.0f ? smaller : 0.0f;
}

void close_gaps(const float* nearest, DepthClosing& closing) {
  const std::ptrdiff_t stride = closing.stride();
  const int columns = closing.columns, pad = closing.pad;
  for (int y = 0; y < closing.rows; ++y) {
    const float* in = nearest + static_cast<std::ptrdiff_t>(y) * columns;
    float* out = closing.closed.data() + y * stride;
    std::copy(in + columns - pad, in + columns, out);
    std::copy(in, in + columns, out + pad);
    std::copy(in, in + pad, out + pad + columns);
  }
  const auto gap = [&](int y) { return closing.reach[static_cast<std::size_t>(y)].gap; };
  const auto guard = [&](int y) { return closing.reach[static_cast<std::size_t>(y)].guard; };
  const auto one = [](int) { return 1; };
  filter<Nearer>(closing.closed, closing, closing.gap, gap);
  filter<Farther>(closing.closed, closing, closing.gap, gap);
  closing.far = closing.closed;
  filter<Farther>(closing.far, closing, 1, one);
  // An outline is where a neighbour is nearer than the cell's own slope explains. It is marked with the neighbour's
  // nearness.
  const float tolerance = closing.tolerance, share = closing.share;
  for (int y = 0; y < closing.rows; ++y) {
    const std::ptrdiff_t first = y * stride;
    const float* __restrict here = closing.closed.data() + first;
    const float* __restrict above = y > 0 ? here - stride : here;
    const float* __restrict below = y + 1 < closing.rows ? here + stride : here;
    float* __restrict mark = closing.outline.data() + first;
    float* __restrict steep = closing.slope.data() + first;
    for (std::ptrdiff_t x = 1; x < stride - 1; ++x) {
      const float c = here[x], left = here[x - 1], right = here[x + 1], up = above[x], down = below[x];
      const float along = gentler(c - left, right - c), across = gentler(c - up, down - c);
      const float slack = tolerance * c * c + share * c;
      float most = left > c - along + slack ? left : 0.0f;
      most = Nearer::of(most, right > c + along + slack ? right : 0.0f);
      most = Nearer::of(most, up > c - across + slack ? up : 0.0f);
      mark[x] = Nearer::of(most, down > c + across + slack ? down : 0.0f);
      steep[x] = std::abs(along) + std::abs(across);
    }
  }
  closing.guarded = closing.outline;
  filter<Nearer>(closing.outline, closing, 1, one);
  filter<Nearer>(closing.guarded, closing, closing.guard, guard);
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
namespace {
HWY_EXPORT(close_gaps);

int cells_of(double angle, double cell) { return std::max(1, static_cast<int>(std::lround(angle / cell))); }

DepthClosing closing_of(const DepthMap::Config& config, const DirectionGrid& grid) {
  DepthClosing closing;
  closing.config = config;
  closing.columns = grid.columns;
  closing.rows = grid.rows;
  closing.gap = cells_of(config.gap, config.cell);
  closing.guard = cells_of(config.guard, config.cell);
  closing.pad = std::min(grid.columns, 3 * kMostCells + 2);
  closing.tolerance = static_cast<float>(config.tolerance_m);
  closing.share = static_cast<float>(config.tolerance_share);
  for (int row = 0; row < grid.rows; ++row) {
    const double width = std::cos(std::numbers::pi * ((row + 0.5) / grid.rows - 0.5));
    const auto reach = [&](int cells) {
      return std::min(kMostCells, static_cast<int>(std::lround(cells / std::max(width, 0.01))));
    };
    closing.reach.push_back({reach(closing.gap), reach(closing.guard)});
  }
  for (std::vector<float>* values :
       {&closing.closed, &closing.far, &closing.outline, &closing.guarded, &closing.slope, &closing.scratch})
    values->assign(closing.size(), 0.0f);
  return closing;
}
}  // namespace

DepthMap::DepthMap(const Config& config)
    : config_(config),
      grid_(config.cell),
      tolerance_(static_cast<float>(config.tolerance_m)),
      share_(static_cast<float>(1.0 + config.tolerance_share)),
      most_(static_cast<float>(1.0 / config.nearest_m)),
      nearest_(grid_.size()),
      bounds_(grid_.size()) {}

void DepthMap::close() {
  if (!has_changed_) return;
  has_changed_ = false;
  // The memory of a closing is larger than the map, and maps are closed again and again.
  thread_local DepthClosing closing;
  if (closing.columns == 0 || closing.config != config_) closing = closing_of(config_, grid_);
  HWY_DYNAMIC_DISPATCH(close_gaps)(nearest_.data(), closing);
  for (int y = 0; y < grid_.rows; ++y) {
    const auto padded = static_cast<std::size_t>(y * closing.stride() + closing.pad);
    Bounds* bounds = bounds_.data() + static_cast<std::ptrdiff_t>(y) * grid_.columns;
    for (std::size_t x = 0; x < static_cast<std::size_t>(grid_.columns); ++x)
      bounds[x] = {closing.far[padded + x], closing.closed[padded + x] - closing.slope[padded + x],
                   closing.outline[padded + x], closing.guarded[padded + x]};
  }
}

}  // namespace hueline::fusion
#endif
