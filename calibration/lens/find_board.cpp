#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/lens/find_board.hpp"
#include "core/input_file.hpp"

namespace hueline::calibration {
namespace {

const std::map<std::string, int>& dictionaries() {
  static const std::map<std::string, int> names = {{"DICT_4X4_50", cv::aruco::DICT_4X4_50},
                                                   {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
                                                   {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
                                                   {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
                                                   {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
                                                   {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
                                                   {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
                                                   {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
                                                   {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
                                                   {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
                                                   {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
                                                   {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
                                                   {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL}};
  return names;
}

/// Returns half the edge of the refinement window. It is at most a third of the distance to the nearest neighbour, so
/// that the window has only the corner's own edges.
int refine_window(const std::vector<cv::Point2f>& corners, int columns) {
  double nearest = 1e9;
  const auto across = static_cast<std::size_t>(columns);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % across + 1 < across && i + 1 < corners.size())
      nearest = std::min(nearest, cv::norm(corners[i] - corners[i + 1]));
    if (i + across < corners.size()) nearest = std::min(nearest, cv::norm(corners[i] - corners[i + across]));
  }
  return std::clamp(static_cast<int>(nearest / 3.0), 2, 11);
}

void refine(const cv::Mat& grey, std::vector<cv::Point2f>& corners, int columns, int half) {
  if (half <= 0) half = refine_window(corners, columns);
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-4});
}

bool find_chessboard(const cv::Mat& grey, const Board& board, int refine_half_px, std::vector<cv::Point2f>& corners) {
  const cv::Size size(board.columns, board.rows);
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  if (cv::findChessboardCorners(grey, size, corners, flags)) {
    refine(grey, corners, board.columns, refine_half_px);
    return true;
  }
  // The sector-based search also finds boards without a light border and under strong distortion. It is slower and
  // finds more false boards.
  if (!cv::findChessboardCornersSB(grey, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE))
    return false;
  refine(grey, corners, board.columns, refine_half_px);
  return true;
}

constexpr std::uint64_t kMostImageBytes = 1'000'000'000;
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 27;  // 16384 x 8192, a large panorama

/// Returns width times height from the header of a PNG or JPEG file, so that a too large image costs no memory and no
/// time. Returns 0 for other formats.
std::uint64_t stated_pixels(std::string_view bytes) {
  const auto number = [&](std::size_t at, std::size_t width) {
    std::uint64_t value = 0;
    for (std::size_t i = at; i < at + width; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
  };
  if (bytes.starts_with("\x89PNG") && bytes.size() >= 24) return number(16, 4) * number(20, 4);
  if (!bytes.starts_with("\xFF\xD8")) return 0;
  for (std::size_t at = 2; at + 9 <= bytes.size();) {
    if (bytes[at] != '\xFF') return 0;
    const auto marker = static_cast<unsigned char>(bytes[at + 1]);
    // The frame header has one of the markers C0 to CF, except the tables C4 and CC and the reserved C8.
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC)
      return number(at + 5, 2) * number(at + 7, 2);
    at += marker == 0xFF ? 1 : 2 + number(at + 2, 2);
  }
  return 0;
}

}  // namespace

Result<GreyImage> read_grey_image(const std::string& path) {
  const Result<std::string> bytes = read_input(path, kMostImageBytes, "an image");
  if (!bytes.ok()) return bytes.error();
  const auto too_large = [&](std::uint64_t pixels) {
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: an image of {:.0f} million pixels; at most {:.0f} million are read", path,
                             static_cast<double>(pixels) / 1e6, static_cast<double>(kMostPixels) / 1e6)};
  };
  if (const std::uint64_t pixels = stated_pixels(*bytes); pixels > kMostPixels) return too_large(pixels);
  cv::Mat grey;
  try {
    const cv::Mat encoded(1, static_cast<int>(bytes->size()), CV_8UC1, const_cast<char*>(bytes->data()));
    // Rows and columns stay as stored, because a lens belongs to its sensor, however the camera was held.
    if (!bytes->empty()) grey = cv::imdecode(encoded, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::Malformed, path + ": " + e.what()};
  }
  if (grey.empty()) return Error{ErrorCode::Io, path + ": cannot be read as an image (JPEG, PNG, TIFF, BMP)"};
  if (grey.total() > kMostPixels) return too_large(grey.total());
  GreyImage out{grey.cols, grey.rows, {}};
  out.pixels.reserve(grey.total());
  for (int row = 0; row < grey.rows; ++row)
    out.pixels.insert(out.pixels.end(), grey.ptr(row), grey.ptr(row) + grey.cols);
  return out;
}

Result<std::vector<SeenCorner>> find_board(const GreyImage& image, const Board& board) {
  return find_board(image, board, 0);
}

Result<std::vector<SeenCorner>> find_board(const GreyImage& image, const Board& board, int refine_half_px) {
  if (const std::string wrong = board.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (image.width < 16 || image.height < 16 ||
      image.pixels.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    return Error{ErrorCode::Invalid, "the image is smaller than 16 x 16 px"};
  const cv::Mat grey(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data()));
  std::vector<SeenCorner> out;
  try {
    std::vector<cv::Point2f> corners;
    if (board.kind == BoardKind::Charuco) {
      const auto found = dictionaries().find(board.dictionary);
      if (found == dictionaries().end())
        return Error{ErrorCode::Invalid, "unknown marker dictionary " + board.dictionary};
      const auto dictionary = cv::aruco::getPredefinedDictionary(found->second);
      const auto charuco =
          cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.spacing_m),
                                          static_cast<float>(board.marker_m), dictionary);
      std::vector<std::vector<cv::Point2f>> markers;
      std::vector<int> marker_ids, ids;
      cv::aruco::detectMarkers(grey, dictionary, markers, marker_ids);
      if (!marker_ids.empty()) cv::aruco::interpolateCornersCharuco(markers, marker_ids, grey, charuco, corners, ids);
      if (corners.size() < 6)
        return Error{ErrorCode::Unavailable,
                     fmt::format("{} markers and {} corners were found, and 6 corners are needed", marker_ids.size(),
                                 corners.size())};
      for (std::size_t i = 0; i < corners.size(); ++i)
        out.push_back({static_cast<std::size_t>(ids[i]), {corners[i].x, corners[i].y}});
      return out;
    }
    const bool seen =
        board.kind == BoardKind::Chessboard
            ? find_chessboard(grey, board, refine_half_px, corners)
            : cv::findCirclesGrid(grey, {board.columns, board.rows}, corners,
                                  cv::CALIB_CB_ASYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING) ||
                  cv::findCirclesGrid(grey, {board.columns, board.rows}, corners, cv::CALIB_CB_ASYMMETRIC_GRID);
    if (!seen || corners.size() != board.corner_count())
      return Error{ErrorCode::Unavailable,
                   fmt::format("the board of {} x {} is not completely visible", board.columns, board.rows)};
    for (std::size_t i = 0; i < corners.size(); ++i) out.push_back({i, {corners[i].x, corners[i].y}});
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::Unavailable, e.what()};
  }
  return out;
}

}  // namespace hueline::calibration
