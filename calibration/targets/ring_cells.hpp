#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hueline::calibration {

/// The points of one ring in cells (steps 2 and 3 of the sphere-target orientation). Sectors around the scanner's z
/// axis are as wide as the ring is thick; levels along z are 1.95 radii high. A sphere lies in at most two sectors and,
/// apart from a thin part, in two levels, as long as its target is below 45 degrees of elevation.
class RingCells {
 public:
  struct Cell {
    std::int32_t sector = 0, level = 0;
    std::uint32_t begin = 0, count = 0;  ///< range in points()
  };

  /// Keeps those of `points_scanner` whose distance from the scanner is within width / 2 of `distance`.
  RingCells(std::span<const Eigen::Vector3f> points_scanner, double distance, double width, double radius);

  /// Returns the points in the order of sector, level and place in the scan.
  std::span<const Eigen::Vector3f> points() const { return points_; }
  std::span<const Cell> cells() const { return cells_; }
  /// Returns the points of one cell.
  std::span<const Eigen::Vector3f> points_of(const Cell& cell) const {
    return std::span(points_).subspan(cell.begin, cell.count);
  }
  int sectors() const { return static_cast<int>(sector_begin_.size()) - 1; }

  /// Returns the number of points in the sectors [sector, sector + wide) and levels [level, level + high). Sectors wrap
  /// around the circle.
  std::size_t count_in(int sector, int wide, int level, int high) const;
  /// Appends those points to `out`.
  void gather(int sector, int wide, int level, int high, std::vector<Eigen::Vector3f>& out) const;

 private:
  template <class Visit>
  void visit(int sector, int wide, int level, int high, Visit visit) const;

  std::vector<Eigen::Vector3f> points_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> sector_begin_;  // first cell of each sector, and the end
};

}  // namespace hueline::calibration
