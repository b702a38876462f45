#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "calibration/mount/alignment.hpp"

namespace hueline::calibration {
namespace {

constexpr double kSampleCell = 0.35 * std::numbers::pi / 180;  // cell of the grid of directions
constexpr double kReach = 0.8 * std::numbers::pi / 180;        // largest angle to a neighbouring return
constexpr float kSampleJump_m = 0.6F;                          // A neighbour that is farther by this distance ...
constexpr float kSampleJumpShare = 0.08F;                      // ... and by this share of the range makes an outline.

}  // namespace

std::vector<float> ranks(const std::vector<float>& intensity) {
  const std::size_t n = intensity.size();
  std::vector<float> out(n);
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return intensity[a] < intensity[b]; });
  for (std::size_t i = 0; i < n;) {
    std::size_t j = i;
    while (j < n && intensity[order[j]] == intensity[order[i]]) ++j;
    for (std::size_t k = i; k < j; ++k) out[order[k]] = static_cast<float>(i + j) / static_cast<float>(2 * n);
    i = j;
  }
  return out;
}

std::vector<LaserSample> laser_samples(const std::vector<Eigen::Vector3f>& p_scanner,
                                       const std::vector<float>& intensity, double same_ring_deg) {
  const double same_ring = same_ring_deg * std::numbers::pi / 180;
  const int rows_reach = static_cast<int>(same_ring / kSampleCell) + 1;
  const std::size_t n = p_scanner.size();
  std::vector<LaserSample> out(n);
  const std::vector<float> ranked = ranks(intensity);
  for (std::size_t i = 0; i < n; ++i) out[i].intensity = ranked[i];
  // A grid of directions; each cell lists its returns.
  const int across = static_cast<int>(2 * std::numbers::pi / kSampleCell) + 1,
            down = static_cast<int>(std::numbers::pi / kSampleCell) + 1;
  struct Direction {
    double azimuth, elevation, range;
  };
  std::vector<Direction> directions(n);
  std::vector<std::vector<std::uint32_t>> cells(static_cast<std::size_t>(across * down));
  const auto cell_of = [&](double azimuth, double elevation) {
    const int column = std::clamp(static_cast<int>((azimuth + std::numbers::pi) / kSampleCell), 0, across - 1);
    const int row = std::clamp(static_cast<int>((elevation + std::numbers::pi / 2) / kSampleCell), 0, down - 1);
    return std::pair{column, row};
  };
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3f& p = p_scanner[i];
    out[i].p_body = p;
    const double flat = std::hypot(p.x(), p.y());
    directions[i] = {std::atan2(p.x(), p.y()), std::atan2(static_cast<double>(p.z()), flat), p.norm()};
    const auto [column, row] = cell_of(directions[i].azimuth, directions[i].elevation);
    cells[static_cast<std::size_t>(row * across + column)].push_back(static_cast<std::uint32_t>(i));
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Direction& own = directions[i];
    if (!(own.range > 0.5)) continue;
    const auto [column, row] = cell_of(own.azimuth, own.elevation);
    const double narrow = std::max(0.05, std::cos(own.elevation));
    const int reach = static_cast<int>(kReach / kSampleCell / narrow) + 1;
    // Finds the nearest return on each side in the same ring.
    double nearest[2] = {kReach, kReach}, range[2] = {own.range, own.range};
    for (int r = std::max(0, row - rows_reach); r <= std::min(down - 1, row + rows_reach); ++r) {
      for (int c = column - reach; c <= column + reach; ++c) {
        for (const std::uint32_t j : cells[static_cast<std::size_t>(r * across + (c + across) % across)]) {
          if (j == i || std::abs(directions[j].elevation - own.elevation) > same_ring) continue;
          double beside = std::remainder(directions[j].azimuth - own.azimuth, 2 * std::numbers::pi) * narrow;
          const int side = beside > 0;
          beside = std::abs(beside);
          if (beside > 1e-6 && beside < nearest[side]) {
            nearest[side] = beside;
            range[side] = directions[j].range;
          }
        }
      }
    }
    const auto jump = static_cast<float>(std::max(range[0], range[1]) - own.range),
               needed = std::max(kSampleJump_m, kSampleJumpShare * static_cast<float>(own.range));
    if (jump > needed) out[i].outline = std::min(1.0F, std::sqrt(jump / (5 * needed)));
  }
  return out;
}

}  // namespace hueline::calibration
