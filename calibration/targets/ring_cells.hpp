#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hueline::calibration {

/// Steps 2 and 3 of sphere-target orientation: the points of one ring in sectors about the scanner's z, each as wide as
/// the ring is thick, and in cells of 1.95 radii along z. A sphere lies in at most two sectors and, but for a sliver,
/// two cells, as long as its target stands below 45 degrees of elevation.
class RingCells {
 public:
  struct Cell {
    std::int32_t sector = 0, level = 0;
    std::uint32_t begin = 0, count = 0;  ///< in points()
  };

  /// `points_scanner`: those whose distance lies within width / 2 of `distance`.
  RingCells(std::span<const Eigen::Vector3f> points_scanner, double distance, double width, double radius);

  /// Ordered by sector, level and place in the scan.
  std::span<const Eigen::Vector3f> points() const { return points_; }
  std::span<const Cell> cells() const { return cells_; }
  std::span<const Eigen::Vector3f> points_of(const Cell& cell) const {
    return std::span(points_).subspan(cell.begin, cell.count);
  }
  int sectors() const { return static_cast<int>(sector_begin_.size()) - 1; }

  /// Points in sectors [sector, sector + wide) and levels [level, level + high), around the circle.
  std::size_t count_in(int sector, int wide, int level, int high) const;
  /// Those points, appended to `out`.
  void gather(int sector, int wide, int level, int high, std::vector<Eigen::Vector3f>& out) const;

 private:
  template <class Visit>
  void visit(int sector, int wide, int level, int high, Visit visit) const;

  std::vector<Eigen::Vector3f> points_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> sector_begin_;  // first cell of each sector, and the end
};

}  // namespace hueline::calibration
