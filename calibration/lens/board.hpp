#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"

/// Calibration boards, and the pixels at which images show their corners.
namespace hueline::calibration {

enum class BoardKind : std::uint8_t { Chessboard, Circles, AsymmetricCircles, Charuco, AprilGrid };

/// Number of the terms of second and third degree that describe how a board is bent.
constexpr std::size_t kBendTerms = 7;

/// A calibration board. Its frame has the origin at the first corner, x along the rows, y along the columns, and z = 0
/// on a plane board.
struct Board {
  BoardKind kind = BoardKind::Chessboard;
  /// Chessboard: number of inner corners each way. Circles: of circles. AsymmetricCircles: circles in a row, where
  /// every other row is shifted by half a step, and rows. Charuco: number of squares each way. AprilGrid: of tags.
  int columns = 9, rows = 6;
  /// Edge of a square, m. Circles: from centre to centre. AsymmetricCircles: half the distance between neighbours in a
  /// row, which is also the distance between rows. AprilGrid: from an edge of a tag to the same edge of the next.
  double spacing_m = 0.03;
  double marker_m = 0.02;                  ///< Charuco, AprilGrid: edge of a marker, m
  std::string dictionary = "DICT_4X4_50";  ///< Charuco, AprilGrid: name of the dictionary in OpenCV's aruco module
  /// How the board is bent, m: z of a corner is the sum of these times bend_terms(). All 0: it is plane.
  std::array<double, kBendTerms> bend_m{};

  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
  /// Returns the number of corners of the board.
  std::size_t corner_count() const;
  /// Returns the place of a corner in the board's frame, m. The corners of the tags of an AprilGrid are numbered tag by
  /// tag: along x, then along y.
  Eigen::Vector3d corner(std::size_t index) const;
  /// Returns the terms of `bend_m` at a corner: u2, uv, v2, u3, u2v, uv2, v3, where u and v are its x and y from the
  /// middle of the board in halves of its longer side.
  std::array<double, kBendTerms> bend_terms(std::size_t index) const;
  /// Returns how far the corners are from the plane that fits them best, from the farthest on one side to the farthest
  /// on the other, m.
  double bend_height() const;
};

/// One corner in an image: its index on the board and its pixel. The centre of the first pixel is (0, 0).
struct SeenCorner {
  std::size_t index = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();

  bool operator==(const SeenCorner& other) const { return index == other.index && pixel == other.pixel; }
};

/// One image of the board.
struct BoardView {
  std::string name;  ///< name of the image, for reports
  std::vector<SeenCorner> corners;
};

/// A grey image, row by row without gaps.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  int orientation = 1;  ///< how its file wants it to be shown (core/exif_orientation.hpp); the pixels are as stored
};

/// Reads a JPEG, PNG, TIFF or BMP file. Rows and columns are as stored; `orientation` has the rotation in the EXIF data
/// of a JPEG or PNG. Errors: Io, Malformed, Unsupported (an image of more than 134 million pixels).
Result<GreyImage> read_grey_image(const std::string& path);

/// Returns the names that Board::dictionary may have.
std::vector<std::string> marker_dictionaries();

/// Finds the corners of `board` in `image` and refines each by the grey levels around it: a chessboard by the gradient
/// condition of cv::cornerSubPix, dark circles by their centres of gravity. In a large image a chessboard is looked for
/// in a shrunk copy, where a board over an eighth of the image is found, and refined in the whole one. The markers of a
/// Charuco board identify its corners; its first square may be black or, with an even number of rows, white (OpenCV
/// before 4.6). The tags of an AprilGrid may have black borders of two bits (Kalibr) or one, and their rows may go up
/// or down from the first. The corners of other boards may be numbered from either end (a half turn of the board),
/// which does not change a lens calibration. Errors: Unavailable (the board is not completely visible; Charuco,
/// AprilGrid: fewer than 6 corners, or the markers are those of another board), Invalid (wrong board, image too small).
Result<std::vector<SeenCorner>> find_board(const GreyImage& image, const Board& board);

}  // namespace hueline::calibration
