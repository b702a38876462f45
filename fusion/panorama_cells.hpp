#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

/// Finds the cells of an equirectangular picture in which points lie, for many points at once.
namespace hueline::fusion {

/// The cells of points, one element for each.
struct PanoramaCells {
  std::vector<std::int32_t> column, row;
  std::vector<std::int32_t> reach;  ///< the point covers so many columns to each side, fewer than half of the width
  std::vector<float> nearness;      ///< 1 / distance, 1/m; 0: the point is nearer than 5 cm or not finite
};

/// Finds the cells of points in metres. Their axes are x to the middle column, y left, z up. Columns run clockwise seen
/// from above, the first row is the zenith; there are half as many rows as columns. `width` is at most 65536. Angles
/// are within 1e-6 rad. Uses the widest vector instructions that the processor has; the results have the same bits with
/// each of them.
void find_cells(std::uint32_t width, std::span<const Eigen::Vector3f> points, PanoramaCells& out);

}  // namespace hueline::fusion
