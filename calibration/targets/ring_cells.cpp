#include "calibration/targets/ring_cells.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hueline::calibration {

RingCells::RingCells(std::span<const Eigen::Vector3f> points_scanner, double distance, double width, double radius) {
  const auto sectors = static_cast<std::int32_t>(std::max(4.0, std::floor(2 * std::numbers::pi * distance / width)));
  const double sectors_per_rad = sectors / (2 * std::numbers::pi), levels_per_m = 1 / (1.95 * radius);
  struct Place {
    std::int32_t sector, level;
    std::uint32_t point;
  };
  std::vector<Place> places(points_scanner.size());
  std::vector<std::uint32_t> fill(static_cast<std::size_t>(sectors) + 1, 0);
  for (std::size_t i = 0; i < points_scanner.size(); ++i) {
    const auto& p = points_scanner[i];
    const double angle = std::atan2(static_cast<double>(p.y()), static_cast<double>(p.x())) + std::numbers::pi;
    const auto sector = std::min(static_cast<std::int32_t>(angle * sectors_per_rad), sectors - 1);
    places[i] = {sector, static_cast<std::int32_t>(std::floor(static_cast<double>(p.z()) * levels_per_m)),
                 static_cast<std::uint32_t>(i)};
    ++fill[static_cast<std::size_t>(sector) + 1];
  }
  for (std::size_t s = 1; s < fill.size(); ++s) fill[s] += fill[s - 1];
  const std::vector<std::uint32_t> begins = fill;
  std::vector<Place> ordered(places.size());
  for (const Place& place : places) ordered[fill[static_cast<std::size_t>(place.sector)]++] = place;
  points_.reserve(ordered.size());
  sector_begin_.reserve(begins.size());
  for (std::size_t s = 0; s + 1 < begins.size(); ++s) {
    sector_begin_.push_back(static_cast<std::uint32_t>(cells_.size()));
    const auto begin = ordered.begin() + begins[s], end = ordered.begin() + begins[s + 1];
    std::sort(begin, end, [](const Place& a, const Place& b) {
      return a.level != b.level ? a.level < b.level : a.point < b.point;
    });
    for (auto it = begin; it != end; ++it) {
      if (it == begin || it->level != cells_.back().level)
        cells_.push_back({it->sector, it->level, static_cast<std::uint32_t>(points_.size()), 0});
      ++cells_.back().count;
      points_.push_back(points_scanner[it->point]);
    }
  }
  sector_begin_.push_back(static_cast<std::uint32_t>(cells_.size()));
}

template <class Visit>
void RingCells::visit(int sector, int wide, int level, int high, Visit visit) const {
  const int all = sectors();
  for (int s = sector; s < sector + std::min(wide, all); ++s) {
    const auto around = static_cast<std::size_t>((s % all + all) % all);
    const auto begin = cells_.begin() + sector_begin_[around], end = cells_.begin() + sector_begin_[around + 1];
    for (auto it = std::lower_bound(begin, end, level, [](const Cell&cell, int wanted) { return cell.level < wanted; });
         it != end && it->level < level + high; ++it)
      visit(*it);
  }
}

std::size_t RingCells::count_in(int sector, int wide, int level, int high) const {
  std::size_t count = 0;
  visit(sector, wide, level, high, [&](const Cell& cell) { count += cell.count; });
  return count;
}

void RingCells::gather(int sector, int wide, int level, int high, std::vector<Eigen::Vector3f>& out) const {
  visit(sector, wide, level, high, [&](const Cell& cell) {
    const auto points = points_of(cell);
    out.insert(out.end(), points.begin(), points.end());
  });
}

}  // namespace hueline::calibration
