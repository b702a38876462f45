#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"

/// Calibration boards, and where their corners are seen.
namespace hueline::calibration {

enum class BoardKind : std::uint8_t { Chessboard, AsymmetricCircles, Charuco };

/// A plane board. Its frame: origin at the first corner, x along the rows, y along the columns, z = 0.
struct Board {
  BoardKind kind = BoardKind::Chessboard;
  /// Chessboard: inner corners; AsymmetricCircles: circles a row (every other row is shifted by half a step) and rows;
  /// Charuco: squares.
  int columns = 9, rows = 6;
  /// m: edge of a square. AsymmetricCircles: half the distance of neighbours in a row, which is the distance of rows.
  double spacing_m = 0.03;
  double marker_m = 0.02;                  ///< Charuco: edge of a marker
  std::string dictionary = "DICT_4X4_50";  ///< Charuco: name in OpenCV's aruco module

  std::string validate() const;
  /// Corners that the board has, and their places on it.
  std::size_t corner_count() const;
  Eigen::Vector3d corner(std::size_t index) const;
};

/// One corner in an image: which of the board, and its pixel (centres at whole numbers).
struct SeenCorner {
  std::size_t index = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// One image of the board.
struct BoardView {
  std::string name;  ///< of the image, for people
  std::vector<SeenCorner> corners;
};

/// Grey levels, row by row without gaps.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// JPEG, PNG, TIFF, BMP, with the rows and columns as stored (a turn in EXIF is not made). Errors: Io, Malformed.
Result<GreyImage> read_grey_image(const std::string& path);

/// The board's corners, refined by the grey levels around each (the Harris matrix's saddle point condition:
/// cv::cornerSubPix; circles: centres of gravity). Errors: Unavailable (not seen whole; Charuco: fewer than 6 corners),
/// Invalid. The plane of a Charuco board fixes its corners; the others are found up to a turn by half, which a lens
/// does not notice.
Result<std::vector<SeenCorner>> find_board(const GreyImage& image, const Board& board);

}  // namespace hueline::calibration
