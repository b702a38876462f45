#include "calibration/lens/board.hpp"

#include <fmt/format.h>

#include <cmath>

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

Eigen::Vector3d Board::corner(std::size_t index) const {
  if (kind == BoardKind::AprilGrid) {
    const std::size_t tag = index / 4, tags = static_cast<std::size_t>(columns);
    return {static_cast<double>(tag % tags) * spacing_m + (index % 2 == 1 ? marker_m : 0),
            static_cast<double>(tag / tags) * spacing_m + (index % 4 >= 2 ? marker_m : 0), 0};
  }
  const auto across = static_cast<std::size_t>(kind == BoardKind::Charuco ? columns - 1 : columns);
  const auto row = static_cast<double>(index / across), column = static_cast<double>(index % across);
  if (kind == BoardKind::AsymmetricCircles) return {(2 * column + std::fmod(row, 2.0)) * spacing_m, row * spacing_m, 0};
  return {column * spacing_m, row * spacing_m, 0};
}

}  // namespace hueline::calibration
