#include "calibration/lens/board.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>

namespace hueline::calibration {

std::string Board::validate() const {
  const bool has_markers = kind == BoardKind::Charuco || kind == BoardKind::AprilGrid;
  const int least = kind == BoardKind::Charuco ? 3 : 2;
  if (columns < least || columns > 100 || rows < least || rows > 100)
    return fmt::format("the board is {} x {}; allowed: {} to 100 each way", columns, rows, least);
  if (kind == BoardKind::Chessboard && columns * rows < 9) return "the board has fewer than 9 inner corners";
  if (!(spacing_m > 1e-3 && spacing_m < 10))
    return fmt::format("the board's step is {} m; allowed: 0.001 to 10 m", spacing_m);
  if (has_markers && !(marker_m > 0 && marker_m < spacing_m))
    return fmt::format("the marker's edge is {} m; allowed: above 0, below the square's {} m", marker_m, spacing_m);
  return {};
}

std::size_t Board::corner_count() const {
  if (kind == BoardKind::AprilGrid) return static_cast<std::size_t>(4 * columns * rows);
  return kind == BoardKind::Charuco ? static_cast<std::size_t>((columns - 1) * (rows - 1))
                                    : static_cast<std::size_t>(columns * rows);
}

namespace {

/// Returns the place of a corner on the board as if it were plane.
Eigen::Vector2d plane_corner(const Board& board, std::size_t index) {
  const BoardKind kind = board.kind;
  const int columns = board.columns;
  const double spacing_m = board.spacing_m, marker_m = board.marker_m;
  if (kind == BoardKind::AprilGrid) {
    const std::size_t tag = index / 4, tags = static_cast<std::size_t>(columns);
    return {static_cast<double>(tag % tags) * spacing_m + (index % 2 == 1 ? marker_m : 0),
            static_cast<double>(tag / tags) * spacing_m + (index % 4 >= 2 ? marker_m : 0)};
  }
  const auto across = static_cast<std::size_t>(kind == BoardKind::Charuco ? columns - 1 : columns);
  const auto row = static_cast<double>(index / across), column = static_cast<double>(index % across);
  if (kind == BoardKind::AsymmetricCircles) return {(2 * column + std::fmod(row, 2.0)) * spacing_m, row * spacing_m};
  return {column * spacing_m, row * spacing_m};
}

}  // namespace

Eigen::Vector3d Board::corner(std::size_t index) const {
  const Eigen::Vector2d place = plane_corner(*this, index);
  if (bend_m == std::array<double, kBendTerms>{}) return {place.x(), place.y(), 0};
  const auto terms = bend_terms(index);
  return {place.x(), place.y(), std::inner_product(terms.begin(), terms.end(), bend_m.begin(), 0.0)};
}

std::array<double, kBendTerms> Board::bend_terms(std::size_t index) const {
  const Eigen::Vector2d half = plane_corner(*this, corner_count() - 1) / 2;
  const Eigen::Vector2d place = (plane_corner(*this, index) - half) / half.maxCoeff();
  const double u = place.x(), v = place.y();
  return {u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v};
}

double Board::bend_height() const {
  const auto count = static_cast<Eigen::Index>(corner_count());
  Eigen::MatrixX3d plane(count, 3);
  Eigen::VectorXd heights(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d p = corner(static_cast<std::size_t>(i));
    plane.row(i) << p.x() / spacing_m, p.y() / spacing_m, 1;
    heights[i] = p.z();
  }
  heights -= plane * (plane.transpose() * plane).ldlt().solve(plane.transpose() * heights);
  return heights.maxCoeff() - heights.minCoeff();
}

}  // namespace hueline::calibration
