// Boards drawn here are found, and each corner has its number.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/lens/board.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::calibration {
namespace {

using test::TemporaryFolder;

constexpr int kSquare_px = 80, kMarker_px = 60, kMargin_px = 80;

/// A ChArUco board of 60 : 80. With `white_first` its first square is white, as OpenCV before 4.6 drew boards with an
/// even number of rows.
cv::Mat drawn_charuco(int columns, int rows, bool white_first) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
  cv::Mat out(rows * kSquare_px + 2 * kMargin_px, columns * kSquare_px + 2 * kMargin_px, CV_8UC1, cv::Scalar(255));
  int id = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const cv::Point at(kMargin_px + column * kSquare_px, kMargin_px + row * kSquare_px);
      if (((row + column) % 2 == 0) != white_first) {
        out(cv::Rect(at, cv::Size(kSquare_px, kSquare_px))) = 0;
        continue;
      }
      cv::Mat marker;
      cv::aruco::drawMarker(dictionary, id++, kMarker_px, marker, 1);
      constexpr int kBorder = (kSquare_px - kMarker_px) / 2;
      marker.copyTo(out(cv::Rect(at + cv::Point(kBorder, kBorder), marker.size())));
    }
  return out;
}

GreyImage image_of(const cv::Mat& grey) {
  GreyImage out{grey.cols, grey.rows, {}};
  for (int row = 0; row < grey.rows; ++row)
    out.pixels.insert(out.pixels.end(), grey.ptr(row), grey.ptr(row) + grey.cols);
  return out;
}

Board charuco(int columns, int rows) { return {BoardKind::Charuco, columns, rows, 0.08, 0.06, "DICT_4X4_50"}; }

/// Finds `board` in the drawing, seen at an angle, of which only `seen` is in the image. Returns how many corners were
/// found, each of which must be where it is.
std::size_t found_corners(const cv::Mat& drawing, const Board& board, const cv::Rect& seen) {
  const cv::Matx33d H(0.9, 0.12, 10, -0.05, 0.95, 60, 1e-4, 2e-4, 1);
  cv::Mat tilted;
  cv::warpPerspective(drawing, tilted, H, drawing.size(), cv::INTER_AREA, cv::BORDER_CONSTANT, cv::Scalar(255));
  const auto found = find_board(image_of(tilted(seen)), board);
  EXPECT_TRUE(found.ok()) << found.error().message;
  if (!found.ok()) return 0;
  for (const SeenCorner& corner : *found) {
    const Eigen::Vector3d at = board.corner(corner.index) / board.spacing_m * kSquare_px;
    // The corner is between the last pixel of one square and the first of the next.
    const double first = kMargin_px + kSquare_px - 0.5;
    const cv::Vec3d p = H * cv::Vec3d(first + at.x(), first + at.y(), 1);
    const Eigen::Vector2d truth(p[0] / p[2] - seen.x, p[1] / p[2] - seen.y);
    EXPECT_LT((corner.pixel - truth).norm(), 0.4) << "corner " << corner.index;
  }
  return found->size();
}

TEST(FindBoard, CharucoWithEitherFirstSquare) {
  for (const auto& [columns, rows, white_first] :
       {std::tuple{7, 6, false}, std::tuple{7, 6, true}, std::tuple{8, 6, true}, std::tuple{7, 5, false}}) {
    const cv::Mat drawing = drawn_charuco(columns, rows, white_first);
    SCOPED_TRACE(testing::Message() << columns << " x " << rows << (white_first ? ", white first" : ""));
    EXPECT_EQ(found_corners(drawing, charuco(columns, rows), {0, 0, drawing.cols, drawing.rows}),
              static_cast<std::size_t>((columns - 1) * (rows - 1)));
    // Markers at the border of the image are missing, so that corners there have one marker only.
    EXPECT_GT(found_corners(drawing, charuco(columns, rows), {230, 150, drawing.cols - 230, drawing.rows - 150}), 8u);
  }
}

TEST(FindBoard, RefusesTheMarkersOfAnotherBoard) {
  const GreyImage image = image_of(drawn_charuco(8, 6, false));
  EXPECT_THAT(find_board(image, charuco(6, 8)).error().message,
              testing::HasSubstr("not where a board of 6 x 8 squares has them"));
  Board small_markers = charuco(8, 6);
  small_markers.marker_m = 0.02;
  EXPECT_THAT(find_board(image, small_markers).error().message, testing::HasSubstr("--marker-m"));
  Board other = charuco(8, 6);
  other.dictionary = "DICT_7X7_250";
  EXPECT_THAT(find_board(image, other).error().message, testing::HasSubstr("0 markers of DICT_7X7_250"));
  for (const std::string& name : marker_dictionaries()) {
    other.dictionary = name;
    const auto found = find_board(image, other);
    EXPECT_TRUE(found.ok() || found.error().code == ErrorCode::Unavailable) << name;
  }
}

/// A grid of AprilTags with black squares at their corners, as Kalibr draws it: the first tag below on the left,
/// borders of two bits. Or the first tag above, borders of one bit, tags turned by a quarter, and no squares.
cv::Mat drawn_aprilgrid(int columns, int rows, bool as_kalibr) {
  constexpr int kGap_px = 24, kStep_px = kSquare_px + kGap_px;
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  cv::Mat out(rows * kStep_px + 2 * kMargin_px, columns * kStep_px + 2 * kMargin_px, CV_8UC1, cv::Scalar(255));
  for (int id = 0; id < columns * rows; ++id) {
    const int row = as_kalibr ? rows - 1 - id / columns : id / columns;
    const cv::Point at(kMargin_px + id % columns * kStep_px, kMargin_px + row * kStep_px);
    cv::Mat tag;
    cv::aruco::drawMarker(dictionary, id, kSquare_px, tag, as_kalibr ? 2 : 1);
    if (!as_kalibr) cv::rotate(tag, tag, cv::ROTATE_90_CLOCKWISE);
    tag.copyTo(out(cv::Rect(at, tag.size())));
    for (const int x : {-kGap_px, kSquare_px})
      for (const int y : {-kGap_px, kSquare_px})
        if (as_kalibr) out(cv::Rect(at + cv::Point(x, y), cv::Size(kGap_px, kGap_px))) = 0;
  }
  return out;
}

TEST(FindBoard, AprilGrid) {
  constexpr double kStep_px = kSquare_px + 24;
  const Board board{BoardKind::AprilGrid, 5, 4, kStep_px / 1000, kSquare_px / 1000.0, "DICT_APRILTAG_36h11"};
  const cv::Matx33d H(0.9, 0.12, 10, -0.05, 0.95, 60, 1e-4, 2e-4, 1);
  for (const bool as_kalibr : {true, false}) {
    SCOPED_TRACE(as_kalibr ? "as Kalibr" : "rows that go down");
    const cv::Mat drawing = drawn_aprilgrid(5, 4, as_kalibr);
    cv::Mat tilted;
    cv::warpPerspective(drawing, tilted, H, drawing.size(), cv::INTER_AREA, cv::BORDER_CONSTANT, cv::Scalar(255));
    // A part of the board is enough.
    for (const cv::Rect& seen : {cv::Rect({0, 0}, tilted.size()), cv::Rect(200, 0, tilted.cols - 200, tilted.rows)}) {
      const auto found = find_board(image_of(tilted(seen)), board);
      ASSERT_TRUE(found.ok()) << found.error().message;
      EXPECT_GE(found->size(), seen.x == 0 ? 80u : 36u);
      for (const SeenCorner& corner : *found) {
        const Eigen::Vector3d at = board.corner(corner.index) * 1000;
        // Kalibr's y goes up from the lower edge of the lowest tags.
        const double y = as_kalibr ? 3 * kStep_px + kSquare_px - at.y() : at.y();
        const cv::Vec3d p = H * cv::Vec3d(kMargin_px - 0.5 + at.x(), kMargin_px - 0.5 + y, 1);
        const Eigen::Vector2d truth(p[0] / p[2] - seen.x, p[1] / p[2] - seen.y);
        EXPECT_LT((corner.pixel - truth).norm(), 0.4) << "corner " << corner.index;
      }
    }
  }
  Board other = board;
  std::swap(other.columns, other.rows);
  EXPECT_THAT(find_board(image_of(drawn_aprilgrid(5, 4, true)), other).error().message,
              testing::HasSubstr("--size is columns x rows"));
  other = board;
  other.marker_m = 0.04;
  EXPECT_THAT(find_board(image_of(drawn_aprilgrid(5, 4, true)), other).error().message,
              testing::HasSubstr("--marker-m, --spacing-m"));
}

/// Returns the drawing as a tilted board, and the function that tilts its pixels. `scale` is its size against that of
/// the small drawings, for which the tilt is made.
cv::Matx33d tilt_of(double scale) {
  return {0.9, 0.12, 10 * scale, -0.05, 0.95, 60 * scale, 1e-4 / scale, 2e-4 / scale, 1};
}
cv::Mat tilted_board(const cv::Mat& drawing, double scale) {
  cv::Mat out;
  cv::warpPerspective(drawing, out, tilt_of(scale), drawing.size(), cv::INTER_AREA, cv::BORDER_CONSTANT,
                      cv::Scalar(255));
  return out;
}

/// Returns the largest distance of a corner from its place in the drawing, seen tilted. The corners may be numbered
/// from either end of the board.
double largest_error(const Board& board, const std::vector<SeenCorner>& corners, double first_px, double step_px,
                     double scale) {
  double there = 0, back = 0;
  for (const SeenCorner& corner : corners) {
    const auto place = [&](std::size_t index) {
      const Eigen::Vector3d at = board.corner(index) / board.spacing_m * step_px;
      const cv::Vec3d p = tilt_of(scale) * cv::Vec3d(first_px + at.x(), first_px + at.y(), 1);
      return Eigen::Vector2d(p[0] / p[2], p[1] / p[2]);
    };
    there = std::max(there, (corner.pixel - place(corner.index)).norm());
    back = std::max(back, (corner.pixel - place(corners.size() - 1 - corner.index)).norm());
  }
  return std::min(there, back);
}

/// Circles of photographs are wider than OpenCV's detector takes by itself.
TEST(FindBoard, CirclesOfBothKindsAndOfAllSizes) {
  for (const int scale : {1, 3})
    for (const auto& [kind, columns, rows] :
         {std::tuple{BoardKind::Circles, 7, 5}, std::tuple{BoardKind::AsymmetricCircles, 4, 11}}) {
      SCOPED_TRACE(testing::Message() << columns << " x " << rows << " circles, scale " << scale);
      const Board board{kind, columns, rows, 0.03, 0, ""};
      const double step_px = (kind == BoardKind::Circles ? 100 : 60) * scale, first_px = 150 * scale;
      cv::Mat drawing(900 * scale, 900 * scale, CV_8UC1, cv::Scalar(255));
      for (std::size_t i = 0; i < board.corner_count(); ++i) {
        const Eigen::Vector3d at = board.corner(i) / board.spacing_m * step_px;
        cv::circle(drawing, {static_cast<int>(first_px + at.x()), static_cast<int>(first_px + at.y())}, 34 * scale,
                   cv::Scalar(0), cv::FILLED, cv::LINE_AA);
      }
      const auto found = find_board(image_of(tilted_board(drawing, scale)), board);
      ASSERT_TRUE(found.ok()) << found.error().message;
      EXPECT_EQ(found->size(), board.corner_count());
      // The centre of gravity is not the image of the centre: with this tilt 0.7 px beside it at the small scale.
      EXPECT_LT(largest_error(board, *found, first_px, step_px, scale), 1.0 * scale);
      Board other = board;
      other.kind = kind == BoardKind::Circles ? BoardKind::AsymmetricCircles : BoardKind::Circles;
      EXPECT_EQ(find_board(image_of(tilted_board(drawing, scale)), other).error().code, ErrorCode::Unavailable);
    }
}

/// Leaves and stones of 12 million pixels took OpenCV minutes. The corners are those of the whole image.
TEST(FindBoard, ChessboardOfALargePhotograph) {
  const Board board{BoardKind::Chessboard, 9, 6, 0.03, 0, ""};
  constexpr int kLargeSquare_px = 200, kFirst_px = 600;
  constexpr double kScale = 4;
  cv::Mat drawing(2400, 3200, CV_8UC1, cv::Scalar(255));
  for (int row = 0; row <= board.rows; ++row)
    for (int column = 0; column <= board.columns; ++column)
      if ((row + column) % 2 == 0)
        drawing(cv::Rect(kFirst_px + (column - 1) * kLargeSquare_px, kFirst_px + (row - 1) * kLargeSquare_px,
                         kLargeSquare_px, kLargeSquare_px)) = 0;
  const cv::Mat sharp = tilted_board(drawing, kScale);
  cv::Mat noise(sharp.size(), CV_8UC1), blurred;
  cv::RNG(1).fill(noise, cv::RNG::NORMAL, 20, 4);
  cv::GaussianBlur(sharp, blurred, {}, 14);
  // Edges of the second image are wider than the window of the refinement, which would leave corners 7 px beside.
  for (const auto& [image, most_px] : {std::pair{sharp, 0.25}, std::pair{blurred, 1.0}}) {
    const cv::Mat noisy = image * 0.8 + noise;
    const auto found = find_board(image_of(noisy), board);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_LT(largest_error(board, *found, kFirst_px - 0.5, kLargeSquare_px, kScale), most_px);
  }
  cv::Mat covered = sharp.clone();
  covered(cv::Rect(900, 700, 500, 500)) = 128;
  EXPECT_THAT(find_board(image_of(covered), board).error().message, testing::HasSubstr("narrower than 20 px"));
}

/// Industrial cameras store 10 or 12 bits in the lower ones of 16.
TEST(FindBoard, ReadsImagesOfTwelveBits) {
  const TemporaryFolder folder;
  const cv::Mat drawing = drawn_charuco(7, 5, false);
  for (const int bits : {8, 10, 12, 16}) {
    cv::Mat stored;
    drawing.convertTo(stored, bits == 8 ? CV_8U : CV_16U, ((1 << bits) - 1) / 255.0);
    ASSERT_TRUE(cv::imwrite((folder / "board.png").string(), stored));
    const auto image = read_grey_image((folder / "board.png").string());
    ASSERT_TRUE(image.ok());
    EXPECT_EQ(image->pixels, image_of(drawing).pixels) << bits << " bits";
  }
}

}  // namespace
}  // namespace hueline::calibration
