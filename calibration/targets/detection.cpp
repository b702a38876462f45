#include "calibration/targets/detection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "calibration/targets/ring_cells.hpp"

namespace hueline::calibration {
namespace {

/// Returns whether few enough points of the ring pass beside a sphere. A target stands free; a wall or a trunk
/// continues beside it.
bool stands_free(std::span<const Eigen::Vector3f> around, const CentreFit& fit, double radius, double most_clutter) {
  const Eigen::Vector3d sight = fit.centre_scanner.normalized();
  const double range = fit.centre_scanner.norm(), inner = 1.2 * radius, outer = 2.2 * radius;
  std::size_t beside = 0;
  for (const auto& point : around) {
    const Eigen::Vector3d p = point.cast<double>();
    const double depth = sight.dot(p);
    // Distance of the beam from the centre's line of sight, at the depth of the centre.
    const double off = (p - depth * sight).norm() * range / depth;
    beside += depth > 0 && off > inner && off < outer;
  }
  return static_cast<double>(beside) <= most_clutter * static_cast<double>(fit.points);
}

/// Removes duplicate candidates. LinearFit keeps the rounder one; KnownRadius keeps the one with more points, and the
/// rounder one if the numbers are equal.
void drop_duplicates(std::vector<Candidate>& candidates, double distance, CentreMethod method) {
  std::stable_sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
    if (method == CentreMethod::LinearFit || a.points == b.points) return a.roundness > b.roundness;
    return a.points > b.points;
  });
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates)
    if (std::ranges::none_of(kept, [&](const Candidate& other) {
          return (other.centre_scanner - candidate.centre_scanner).norm() < distance;
        }))
      kept.push_back(candidate);
  candidates = std::move(kept);
}

/// Fits spheres with a known radius in windows of two by two cells, so that a sphere that is cut by cells is complete
/// in one of them.
void search_joined(const RingCells& cells, double radius, const ScannerNoise& noise, const DetectionConfig& config,
                   std::vector<Candidate>& out) {
  std::vector<Eigen::Vector3f> window, around;
  for (const RingCells::Cell& cell : cells.cells()) {
    // Visits each window that has this cell at a corner. Several cells can share a window, which must count only once.
    for (int corner = 0; corner < 4; ++corner) {
      const int sector = cell.sector - (corner & 1), level = cell.level - (corner >> 1);
      // The window is skipped if an occupied cell that comes first in its order visits it.
      if (corner == 1 && cells.count_in(sector, 1, level, 2)) continue;
      if (corner == 2 && cells.count_in(sector, 2, level, 1)) continue;
      if (corner == 3 && (cells.count_in(sector, 1, level, 2) || cells.count_in(sector, 2, level, 1))) continue;
      const std::size_t inside = cells.count_in(sector, 2, level, 2);
      if (inside < kFewestOnTarget) continue;
      const std::size_t outside = cells.count_in(sector - 1, 4, level - 1, 4) - inside;
      if (static_cast<double>(outside) > 4 + config.most_clutter * static_cast<double>(inside)) continue;
      window.clear();
      around.clear();
      cells.gather(sector, 2, level, 2, window);
      cells.gather(sector - 1, 4, level - 1, 4, around);
      const auto fit = fit_known_radius(around, radius, start_of_centre(window, radius), noise);
      if (!fit || fit->chi_squared > noise_limit(static_cast<double>(fit->points) - 3) ||
          !stands_free(around, *fit, radius, config.most_clutter))
        continue;
      out.push_back({fit->centre_scanner, fit->covariance, fit->points, fit->roundness});
    }
  }
}

}  // namespace

std::string DetectionConfig::validate() const {
  if (!(ring_radii >= 2 && ring_radii <= 6)) return fmt::format("ring_radii is {}; allowed: 2 to 6", ring_radii);
  if (!(least_roundness > 0 && least_roundness < 1))
    return fmt::format("least_roundness is {}; allowed: between 0 and 1", least_roundness);
  if (!(most_clutter >= 0 && most_clutter <= 5))
    return fmt::format("most_clutter is {}; allowed: 0 to 5", most_clutter);
  if (most_candidates < 1 || most_candidates > 5000)
    return fmt::format("most_candidates is {}; allowed: 1 to 5000", most_candidates);
  return {};
}

double noise_limit(double freedom) {
  // Approximation of the quantile by Wilson and Hilferty.
  const double a = 2 / (9 * freedom), root = 1 - a + 3.72 * std::sqrt(a);
  return 1.5 * freedom * root * root * root;
}

Ring ring_of(double distance, double largest_radius, double doubt_m, const DetectionConfig& config) {
  const double half = std::max(config.ring_radii * largest_radius / 2, largest_radius + doubt_m);
  return {distance - half, distance + half};
}

RingDetection detect_spheres(std::span<const Eigen::Vector3f> points_scanner, const Ring& ring, double distance,
                             double radius, const ScannerNoise& noise, CentreMethod method,
                             const DetectionConfig& config) {
  RingDetection out;
  std::vector<Eigen::Vector3f> own;
  const double inner = ring.inner * ring.inner, outer = ring.outer * ring.outer;
  for (const auto& p : points_scanner) {
    const double squared = p.cast<double>().squaredNorm();
    if (squared >= inner && squared <= outer) own.push_back(p);
  }
  out.counts.points = own.size();
  const RingCells cells(own, distance, ring.outer - ring.inner, radius);
  std::vector<Eigen::Vector3f> around;
  for (const RingCells::Cell& cell : cells.cells()) {
    if (cell.count < kFewestOnTarget) continue;
    ++out.counts.cells;
    const auto fit = fit_linear(cells.points_of(cell));
    if (!fit || std::abs(fit->radius - radius) > 2 * noise.range_precision_m) continue;
    ++out.counts.right_size;
    if (fit->roundness < config.least_roundness) continue;
    ++out.counts.round;
    Candidate candidate{fit->centre_scanner,
                        Eigen::Matrix3d::Identity() * noise.range_precision_m * noise.range_precision_m, cell.count,
                        fit->roundness};
    if (method == CentreMethod::KnownRadius) {
      around.clear();
      cells.gather(cell.sector - 1, 3, cell.level - 1, 3, around);
      const auto known = fit_known_radius(around, radius, fit->centre_scanner, noise);
      if (!known) continue;
      candidate = {known->centre_scanner, known->covariance, known->points, known->roundness};
    }
    out.candidates.push_back(candidate);
  }
  if (method == CentreMethod::KnownRadius) search_joined(cells, radius, noise, config, out.candidates);
  // Of two overlapping spheres at least one is false. The published method only treats centres within 3 sigma as
  // duplicates.
  drop_duplicates(out.candidates, method == CentreMethod::LinearFit ? 3 * noise.range_precision_m : radius, method);
  if (out.candidates.size() > config.most_candidates) out.candidates.resize(config.most_candidates);
  out.counts.candidates = out.candidates.size();
  return out;
}

}  // namespace hueline::calibration
