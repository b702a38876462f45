#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

/// How far away things are in every direction around a head, as far as laser points say.
namespace hueline::fusion {

class WorkerPool;

/// An equirectangular picture of distances. Each cell keeps the nearest of the points in its direction. close() then
/// closes the gaps between the points of a surface and estimates the directions that have no point.
///
/// The picture holds the nearness 1 / distance rather than the distance: the place of a thing in the image of a lens
/// beside the head's centre moves in proportion to it, so that it can be averaged and interpolated, and infinity is 0.
///
/// Axes are those of the view that is rendered: x to the middle column, y left, z up. Columns run clockwise seen from
/// above, the first row is the zenith.
///
/// Thread safety: one thread adds and closes, with the help of its pool; the results may be read by many.
class DepthPanorama {
 public:
  struct Config {
    std::uint32_t width = 2048;  ///< cells around; half as many from zenith to nadir
    /// Gaps of up to twice this angle between near points are closed, so that what lies behind does not show, rad.
    double gap = 0.012;
    double unknown_m = 20.0;  ///< distance that is taken where there is no point at all
  };

  explicit DepthPanorama(const Config& config);

  /// Forgets all points.
  void clear();
  /// Adds points in metres. The order of the points and the number of threads do not change the result.
  void add(std::span<const Eigen::Vector3f> points, WorkerPool& pool);
  /// Closes the gaps and fills what has no point. Call it once, after the last add().
  void close(WorkerPool& pool);

  /// Writes the nearness at many fractions of the width (0: left edge, 1: right edge) and one of the height (0: zenith)
  /// to `out`, 1/m. It is interpolated between cells; the columns wrap around.
  void nearness_of_row(std::span<const float> across, float down, float* out) const;
  /// Returns the share of the cells that had a point before close().
  double known_share() const { return known_share_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }

 private:
  int reach_of_row(std::uint32_t row) const;
  void close_gaps(WorkerPool& pool);
  void fill(WorkerPool& pool);

  Config config_;
  std::uint32_t width_, height_;
  std::vector<float> cells_;  // nearness; 0: no point
  double known_share_ = 0;
};

}  // namespace hueline::fusion
