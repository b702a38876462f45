#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calibration/lens/find_board.hpp"
#include "core/exif_orientation.hpp"
#include "core/input_file.hpp"
#include "core/sample_bits.hpp"

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
                                                   {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
                                                   {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
                                                   {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
                                                   {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
                                                   {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
                                                   {"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
                                                   {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
                                                   {"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
                                                   {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11}};
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

/// Finds the corners of a chessboard, not refined. Without a board OpenCV takes seconds for a million pixels of leaves
/// or stones, and minutes for ten millions.
bool see_chessboard(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& corners) {
  const cv::Size size(board.columns, board.rows);
  if (cv::findChessboardCorners(grey, size, corners, cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return true;
  // The sector-based search also finds boards without a light border and under strong distortion. It is slower and
  // finds more false boards.
  return cv::findChessboardCornersSB(grey, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE);
}

constexpr double kSearchedLength_px = 1300;  // of the longer side of an image
constexpr double kSearchedSquare_px = 64;    // the same for each square of the board
constexpr double kFoundSquare_px = 8;        // edge of the smallest squares that are found: a board over an eighth
constexpr double kLeastShrinking = 1.5;

/// Returns by how much the image is shrunk for the search of the board; 1: it is searched as it is.
double search_shrinking(const cv::Size& image, const Board& board) {
  const double longer = std::max(image.width, image.height);
  const double searched = std::max(kSearchedLength_px, kSearchedSquare_px * (std::max(board.columns, board.rows) + 1));
  return longer < kLeastShrinking * searched ? 1 : longer / searched;
}

/// Finds a chessboard in the image shrunk by `shrinking`, and refines its corners in the whole one.
bool find_chessboard_shrunk(const cv::Mat& grey, const Board& board, int refine_half_px, double shrinking,
                            std::vector<cv::Point2f>& corners) {
  cv::Mat small;
  cv::resize(grey, small, {}, 1 / shrinking, 1 / shrinking, cv::INTER_AREA);
  if (!see_chessboard(small, board, corners)) return false;
  refine(small, corners, board.columns, 0);
  const float x = static_cast<float>(grey.cols) / static_cast<float>(small.cols),
              y = static_cast<float>(grey.rows) / static_cast<float>(small.rows);
  for (cv::Point2f& corner : corners) corner = {(corner.x + 0.5F) * x - 0.5F, (corner.y + 0.5F) * y - 0.5F};
  const std::vector<cv::Point2f> coarse = corners;
  refine(grey, corners, board.columns, refine_half_px);
  // Corners of the small image are known to a fifth of its pixels. Where many move by more than one, the image is
  // blurred: its edges are wider than the window, and the refinement follows noise.
  std::size_t far = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) far += cv::norm(corners[i] - coarse[i]) > shrinking;
  if (10 * far > corners.size()) corners = coarse;
  return true;
}

bool find_chessboard(const cv::Mat& grey, const Board& board, int refine_half_px, std::vector<cv::Point2f>& corners) {
  if (const double shrinking = search_shrinking(grey.size(), board); shrinking > 1)
    return find_chessboard_shrunk(grey, board, refine_half_px, shrinking, corners);
  if (!see_chessboard(grey, board, corners)) return false;
  refine(grey, corners, board.columns, refine_half_px);
  return true;
}

/// Finds the centres of a grid of dark circles on a light ground.
bool find_circles(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& centres) {
  // OpenCV's own limit is 5000 px: circles 80 px wide, as photographs show them, would not be seen.
  cv::SimpleBlobDetector::Params dark;
  dark.maxArea = static_cast<float>(grey.total()) / static_cast<float>(board.columns * board.rows);
  std::vector<cv::KeyPoint> blobs;
  cv::SimpleBlobDetector::create(dark)->detect(grey, blobs);
  std::vector<cv::Point2f> places;
  cv::KeyPoint::convert(blobs, places);
  if (places.size() < board.corner_count()) return false;
  const cv::Size size(board.columns, board.rows);
  const int grid = board.kind == BoardKind::Circles ? cv::CALIB_CB_SYMMETRIC_GRID : cv::CALIB_CB_ASYMMETRIC_GRID;
  return cv::findCirclesGrid(places, size, centres, grid | cv::CALIB_CB_CLUSTERING, nullptr) ||
         cv::findCirclesGrid(places, size, centres, grid, nullptr);
}

/// Markers that were seen in an image.
struct SeenMarkers {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
};

/// Returns the board with the pattern that OpenCV had before 4.6 and that makers still print: if the number of rows is
/// even, the first square is white. The corners have the same numbers.
cv::Ptr<cv::aruco::CharucoBoard> with_white_first_square(const Board& board, cv::Ptr<cv::aruco::CharucoBoard> out) {
  const auto square = static_cast<float>(board.spacing_m), edge = static_cast<float>(board.marker_m),
             border = (square - edge) / 2;
  out->objPoints.clear();
  for (int row = 0; row < board.rows; ++row)
    for (int column = row % 2; column < board.columns; column += 2) {
      const float x = static_cast<float>(column) * square + border, y = static_cast<float>(row) * square + border;
      out->objPoints.push_back({{x, y, 0}, {x + edge, y, 0}, {x + edge, y + edge, 0}, {x, y + edge, 0}});
    }
  const auto distance = [](const cv::Point3f& a, const cv::Point3f& b) { return cv::norm(a - b); };
  for (std::size_t c = 0; c < out->chessboardCorners.size(); ++c) {
    const cv::Point3f& corner = out->chessboardCorners[c];
    out->nearestMarkerIdx[c].clear();
    out->nearestMarkerCorners[c].clear();
    for (std::size_t m = 0; m < out->objPoints.size(); ++m) {
      const auto& marker = out->objPoints[m];
      const auto nearest = std::ranges::min_element(marker, {}, [&](const auto& p) { return distance(p, corner); });
      // A marker's square has the corner if the marker's own corner is away from it by no more than the border.
      if (distance(*nearest, corner) > 1.5F * border) continue;
      out->nearestMarkerIdx[c].push_back(static_cast<int>(m));
      out->nearestMarkerCorners[c].push_back(static_cast<int>(nearest - marker.begin()));
    }
  }
  return out;
}

/// How many markers are where the markers diagonally beside them say that the board has them.
struct Layout {
  int pairs = 0, right = 0;
  double share() const { return pairs > 0 ? static_cast<double>(right) / pairs : 1; }
};

/// Compares the places of the markers in the image with those on the board. Only neighbours are compared, each by the
/// four corners of the other, so that the lens may distort.
Layout compare_layout(const cv::aruco::CharucoBoard& board, const SeenMarkers& seen) {
  const auto centre = [](const auto& corners) { return (corners[0] + corners[2]) * 0.5F; };
  const double square = board.getSquareLength();
  Layout out;
  for (std::size_t a = 0; a < seen.ids.size(); ++a) {
    const auto id_a = static_cast<std::size_t>(seen.ids[a]);
    if (id_a >= board.objPoints.size()) continue;
    std::vector<cv::Point2f> on_board;
    for (const auto& p : board.objPoints[id_a]) on_board.emplace_back(p.x, p.y);
    const cv::Matx33d H = cv::getPerspectiveTransform(seen.corners[a], on_board);
    for (std::size_t b = 0; b < seen.ids.size(); ++b) {
      const auto id_b = static_cast<std::size_t>(seen.ids[b]);
      if (id_b >= board.objPoints.size()) continue;
      const cv::Point3f place = centre(board.objPoints[id_b]), away = place - centre(board.objPoints[id_a]);
      if (std::abs(std::abs(away.x) - square) > square / 2 || std::abs(std::abs(away.y) - square) > square / 2)
        continue;
      const cv::Point2f pixel = centre(seen.corners[b]);
      const cv::Vec3d p = H * cv::Vec3d(pixel.x, pixel.y, 1);
      ++out.pairs;
      out.right += std::hypot(p[0] / p[2] - place.x, p[1] / p[2] - place.y) < square / 2;
    }
  }
  return out;
}

/// Finds the corners of a ChArUco board. OpenCV numbers them by the markers.
Result<std::vector<SeenCorner>> find_charuco(const cv::Mat& grey, const Board& board) {
  const auto known = dictionaries().find(board.dictionary);
  if (known == dictionaries().end()) return Error{ErrorCode::Invalid, "unknown marker dictionary " + board.dictionary};
  const auto dictionary = cv::aruco::getPredefinedDictionary(known->second);
  const auto new_board = [&] {
    return cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.spacing_m),
                                           static_cast<float>(board.marker_m), dictionary);
  };
  auto charuco = new_board();
  SeenMarkers markers;
  cv::aruco::detectMarkers(grey, dictionary, markers.corners, markers.ids);
  Layout layout = compare_layout(*charuco, markers);
  if (board.rows % 2 == 0) {
    const auto white_first = with_white_first_square(board, new_board());
    if (const Layout other = compare_layout(*white_first, markers); other.right > layout.right) {
      charuco = white_first;
      layout = other;
    }
  }
  if (layout.share() < 0.5)
    return Error{ErrorCode::Unavailable,
                 fmt::format("{} markers, but not where a board of {} x {} squares has them (--size is columns x rows) "
                             "with markers of {:.3g} of a square (--marker-m, --spacing-m)",
                             markers.ids.size(), board.columns, board.rows, board.marker_m / board.spacing_m)};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  if (!markers.ids.empty())
    cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, grey, charuco, corners, ids);
  if (corners.size() < 6)
    return Error{ErrorCode::Unavailable,
                 fmt::format("{} markers of {} and {} corners were found, and 6 corners are needed", markers.ids.size(),
                             board.dictionary, corners.size())};
  // OpenCV counts the pixels of these corners from the border of the first pixel, and those of all other boards from
  // its centre.
  constexpr double kHalf_px = 0.5;
  std::vector<SeenCorner> out;
  for (std::size_t i = 0; i < corners.size(); ++i)
    out.push_back({static_cast<std::size_t>(ids[i]), {corners[i].x - kHalf_px, corners[i].y - kHalf_px}});
  return out;
}

/// How the tags of an AprilGrid are printed.
struct TagLayout {
  std::size_t first = 0;  ///< the corner of a tag that OpenCV names first
  bool rows_go_up = true;

  /// Returns the number on the board of a tag's corner that OpenCV names as the n-th.
  std::size_t corner(int id, std::size_t n) const {
    const std::size_t clockwise = (n + first) % 4;  // from the left upper one, as the tag hangs on the board
    const bool is_right = clockwise == 1 || clockwise == 2, is_upper = clockwise < 2;
    return 4 * static_cast<std::size_t>(id) + (is_right ? 1 : 0) + (is_upper == rows_go_up ? 2 : 0);
  }
};

/// Compares the places of the tags with those that the tags beside them give, as compare_layout().
Layout compare_tags(const Board& board, const SeenMarkers& seen, const TagLayout& tags) {
  const auto place = [&](int id, std::size_t n) {
    const Eigen::Vector3d p = board.corner(tags.corner(id, n));
    return cv::Point2f(static_cast<float>(p.x()), static_cast<float>(p.y()));
  };
  Layout out;
  for (std::size_t a = 0; a < seen.ids.size(); ++a) {
    std::vector<cv::Point2f> on_board;
    for (std::size_t n = 0; n < 4; ++n) on_board.push_back(place(seen.ids[a], n));
    const cv::Matx33d H = cv::getPerspectiveTransform(seen.corners[a], on_board);
    for (std::size_t b = 0; b < seen.ids.size(); ++b) {
      const cv::Point2f away = place(seen.ids[b], 0) - place(seen.ids[a], 0);
      if (std::abs(std::hypot(away.x, away.y) - board.spacing_m) > 0.01 * board.spacing_m) continue;
      ++out.pairs;
      bool is_right = true;
      for (std::size_t n = 0; n < 4; ++n) {
        const cv::Vec3d p = H * cv::Vec3d(seen.corners[b][n].x, seen.corners[b][n].y, 1);
        const cv::Point2f wanted = place(seen.ids[b], n);
        is_right &= std::hypot(p[0] / p[2] - wanted.x, p[1] / p[2] - wanted.y) < board.spacing_m / 4;
      }
      out.right += is_right;
    }
  }
  return out;
}

/// Finds the corners of the tags of an AprilGrid.
Result<std::vector<SeenCorner>> find_aprilgrid(const cv::Mat& grey, const Board& board) {
  const auto known = dictionaries().find(board.dictionary);
  if (known == dictionaries().end()) return Error{ErrorCode::Invalid, "unknown marker dictionary " + board.dictionary};
  const auto dictionary = cv::aruco::getPredefinedDictionary(known->second);
  SeenMarkers seen;
  double border = 0;  // as a share of a tag's edge
  for (const int border_bits : {2, 1}) {
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->markerBorderBits = border_bits;
    SeenMarkers found;
    cv::aruco::detectMarkers(grey, dictionary, found.corners, found.ids, parameters);
    if (found.ids.size() <= seen.ids.size()) continue;
    seen = std::move(found);
    border = static_cast<double>(border_bits) / (dictionary->markerSize + 2 * border_bits);
  }
  SeenMarkers tags;
  for (std::size_t i = 0; i < seen.ids.size(); ++i)
    if (seen.ids[i] < board.columns * board.rows) {
      tags.ids.push_back(seen.ids[i]);
      tags.corners.push_back(seen.corners[i]);
    }
  TagLayout layout;
  Layout best;
  for (std::size_t first = 0; first < 4; ++first)
    for (const bool rows_go_up : {true, false})
      if (const Layout one = compare_tags(board, tags, {first, rows_go_up});
          one.right > best.right || best.pairs == 0) {
        best = one;
        layout = {first, rows_go_up};
      }
  if (best.pairs == 0 || best.share() < 0.5)
    return Error{ErrorCode::Unavailable,
                 fmt::format("{} tags of {}, of which {} of {} neighbours are where a board of {} x {} tags has them "
                             "(--size is columns x rows) with tags of {:.3g} of their step (--marker-m, --spacing-m)",
                             seen.ids.size(), board.dictionary, best.right, best.pairs, board.columns, board.rows,
                             board.marker_m / board.spacing_m)};
  std::vector<SeenCorner> out;
  for (std::size_t i = 0; i < tags.ids.size(); ++i) {
    std::vector<cv::Point2f>& corners = tags.corners[i];
    double edge_px = 1e9;
    for (std::size_t n = 0; n < 4; ++n) edge_px = std::min(edge_px, cv::norm(corners[n] - corners[(n + 1) % 4]));
    // The window holds neither a bit of the tag nor the next tag.
    const double clear = std::min(border, board.spacing_m / board.marker_m - 1);
    const int half = std::clamp(static_cast<int>(edge_px * clear / 1.5), 2, 11);
    cv::cornerSubPix(grey, corners, {half, half}, {-1, -1},
                     {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-4});
    for (std::size_t n = 0; n < 4; ++n) out.push_back({layout.corner(tags.ids[i], n), {corners[n].x, corners[n].y}});
  }
  return out;
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

std::vector<std::string> marker_dictionaries() {
  std::vector<std::string> out;
  for (const auto& [name, number] : dictionaries()) out.push_back(name);
  return out;
}

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
    constexpr int kAsStored = cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION;
    if (!bytes->empty()) grey = cv::imdecode(encoded, kAsStored | cv::IMREAD_ANYDEPTH);
    if (!grey.empty() && grey.depth() == CV_16U) {
      double most = 0;
      cv::minMaxLoc(grey, nullptr, &most);
      const unsigned bits = 16 - empty_bits(static_cast<unsigned>(std::bit_width(static_cast<unsigned>(most))));
      grey.convertTo(grey, CV_8U, 256.0 / (1U << bits), -0.5);
    } else if (!grey.empty() && grey.depth() != CV_8U) {
      grey = cv::imdecode(encoded, kAsStored);
    }
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::Malformed, path + ": " + e.what()};
  }
  if (grey.empty()) return Error{ErrorCode::Io, path + ": cannot be read as an image (JPEG, PNG, TIFF, BMP)"};
  if (grey.total() > kMostPixels) return too_large(grey.total());
  GreyImage out{grey.cols, grey.rows, {}, exif_orientation(*bytes)};
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
    if (board.kind == BoardKind::Charuco) return find_charuco(grey, board);
    if (board.kind == BoardKind::AprilGrid) return find_aprilgrid(grey, board);
    std::vector<cv::Point2f> corners;
    const bool is_chessboard = board.kind == BoardKind::Chessboard;
    const bool seen =
        is_chessboard ? find_chessboard(grey, board, refine_half_px, corners) : find_circles(grey, board, corners);
    if (!seen || corners.size() != board.corner_count()) {
      std::string why = fmt::format("the board of {} x {} is not completely visible", board.columns, board.rows);
      if (const double shrinking = search_shrinking(grey.size(), board); is_chessboard && shrinking > 1)
        why += fmt::format(", or its squares are narrower than {:.0f} px", kFoundSquare_px * shrinking);
      return Error{ErrorCode::Unavailable, why};
    }
    for (std::size_t i = 0; i < corners.size(); ++i) out.push_back({i, {corners[i].x, corners[i].y}});
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::Unavailable, e.what()};
  }
  return out;
}

}  // namespace hueline::calibration
