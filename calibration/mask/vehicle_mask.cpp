#include "calibration/mask/vehicle_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace hueline::calibration {
namespace {

constexpr int kAlike = 20;  // colours that differ less are one, in steps of 8 bits
constexpr float kDark = 8;  // added to a brightness, so that noise in the dark does not rule its logarithm
constexpr float kMaskSurroundings = 0.075f;  // side of the square whose mean is taken away, of the image's width
constexpr double kFewestAround = 20;         // pixels there that make a mean
constexpr int kNeighbours = 2;               // cells on each side that may be judged together
constexpr double kMaskEnough = 40;           // comparisons that decide about a cell
constexpr double kFollows = 0.4;             // correlation that only the world has
constexpr double kIsDeaf = 0.25;             // correlation that the world exceeds where its texture is seen
constexpr double kMaskTexture = 0.05;  // standard deviation of predictions whose texture is seen, of the logarithm
constexpr double kStill = 0.16;        // standard deviation that the vehicle keeps below, of the logarithm
constexpr double kSame = 0.6, kOther = 0.3;  // share of alike colours without texture: the world; the vehicle
constexpr double kSpeck = 3e-3;              // share of the image below which a patch is a speck
constexpr float kFarthestFilled = 0.02f;     // of the image's width
constexpr float kRatherVehicle = 2;          // the vehicle may be so much farther than the world, and fills a gap
constexpr float kOneMore = 1.5f;             // cells
constexpr double kDecided = 0.125;           // share of the cells

bool is_alike(const std::array<std::uint8_t, 3>& a, const std::array<std::uint8_t, 3>& b) {
  int sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum <= kAlike * kAlike;
}

/// Light and shade multiply brightness, and add to its logarithm.
float brightness(const std::array<std::uint8_t, 3>& colour) {
  return std::log(static_cast<float>(colour[0] + colour[1] + colour[2]) / 3 + kDark);
}

/// Sums over rectangles of cells.
class CellSums {
 public:
  CellSums(int columns, int rows) : columns_(columns), rows_(rows) {
    sums_.assign(static_cast<std::size_t>(columns + 1) * static_cast<std::size_t>(rows + 1), 0);
  }
  /// Adds the value of the next cell, by rows.
  void put(int column, int row, double value) {
    sums_[at(column + 1, row + 1)] =
        value + sums_[at(column, row + 1)] + sums_[at(column + 1, row)] - sums_[at(column, row)];
  }
  /// Returns the sum over the cells at most `reach` away.
  double around(int column, int row, int reach) const {
    const int left = std::max(0, column - reach), top = std::max(0, row - reach),
              right = std::min(columns_, column + reach + 1), bottom = std::min(rows_, row + reach + 1);
    return sums_[at(right, bottom)] - sums_[at(left, bottom)] - sums_[at(right, top)] + sums_[at(left, top)];
  }

 private:
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1) + static_cast<std::size_t>(column);
  }
  int columns_, rows_;
  std::vector<double> sums_;
};

/// Removes patches of set cells that are smaller than `least` cells.
void drop_specks(cv::Mat& mask, int least) {
  cv::Mat labels, stats, centres;
  cv::connectedComponentsWithStats(mask, labels, stats, centres, 4);
  for (int row = 0; row < mask.rows; ++row)
    for (int column = 0; column < mask.cols; ++column)
      if (stats.at<int>(labels.at<int>(row, column), cv::CC_STAT_AREA) < least) mask.at<std::uint8_t>(row, column) = 0;
}

/// Returns each cell's distance from the nearest set one.
cv::Mat distance_from(const cv::Mat& mask) {
  cv::Mat distance;
  cv::distanceTransform(mask == 0, distance, cv::DIST_L2, cv::DIST_MASK_5);
  return distance;
}

/// Returns the vehicle, 255, from what the views decided: without specks, and with the narrow gaps beside it. A cell
/// at the vehicle's outline shows both, and is decided by neither. One cell more is added all around: the mean of its
/// surroundings, which is taken away, makes the outermost part of the vehicle follow the world a little.
cv::Mat without_gaps(const std::vector<VehicleMask::Cell>& cells, int columns, int rows) {
  cv::Mat vehicle(rows, columns, CV_8U), world(rows, columns, CV_8U);
  for (int row = 0, i = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column, ++i) {
      const auto cell = cells[static_cast<std::size_t>(i)];
      vehicle.at<std::uint8_t>(row, column) = cell == VehicleMask::Cell::Vehicle ? 255 : 0;
      world.at<std::uint8_t>(row, column) = cell == VehicleMask::Cell::World ? 255 : 0;
    }
  const int least = std::max(4, static_cast<int>(kSpeck * rows * columns));
  drop_specks(vehicle, least);
  drop_specks(world, least);
  if (cv::countNonZero(vehicle) == 0) return vehicle;
  const cv::Mat from_vehicle = distance_from(vehicle), from_world = distance_from(world);
  const float farthest = kFarthestFilled * static_cast<float>(columns);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const float distance = from_vehicle.at<float>(row, column);
      if (distance <= farthest && distance <= kRatherVehicle * from_world.at<float>(row, column))
        vehicle.at<std::uint8_t>(row, column) = 255;
    }
  return distance_from(vehicle) < kOneMore;
}

/// Returns the outlines of the cells, px.
std::vector<std::vector<Eigen::Vector2d>> outlines(const cv::Mat& mask, int cell_px) {
  // Of a mask twice as large and one cell wider, the contours run half a cell inside the cells' borders.
  std::vector<std::vector<Eigen::Vector2d>> out;
  cv::Mat large;
  cv::resize(mask, large, {}, 2 * cell_px, 2 * cell_px, cv::INTER_NEAREST);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(large, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  for (const auto& contour : contours) {
    std::vector<cv::Point> corners;
    cv::approxPolyDP(contour, corners, cell_px, true);
    if (corners.size() < 3) continue;
    std::vector<Eigen::Vector2d>& polygon = out.emplace_back();
    for (const cv::Point& corner : corners) polygon.emplace_back(corner.x / 2.0 - 0.25, corner.y / 2.0 - 0.25);
  }
  return out;
}

}  // namespace

VehicleMask::VehicleMask(int width, int height)
    : width_(width),
      height_(height),
      cell_px_((width + kMostColumns - 1) / kMostColumns),
      columns_((width + cell_px_ - 1) / cell_px_),
      rows_((height + cell_px_ - 1) / cell_px_),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

void VehicleMask::add(std::span<const PredictedPixel> view) {
  view_.assign(cells_.size(), {});
  for (const PredictedPixel& pixel : view) {
    if (pixel.x >= width_ || pixel.y >= height_) continue;
    const std::size_t index = static_cast<std::size_t>(pixel.y / cell_px_) * static_cast<std::size_t>(columns_) +
                              static_cast<std::size_t>(pixel.x / cell_px_);
    Evidence& cell = cells_[index];
    ++compared_;
    ++cell.compared;
    cell.alike += is_alike(pixel.predicted, pixel.seen) ? 1 : 0;
    for (std::size_t i = 0; i < 3; ++i) cell.sum[i] += pixel.seen[i];
    view_[index].count += 1;
    view_[index].seen += brightness(pixel.seen);
    view_[index].predicted += brightness(pixel.predicted);
  }
  ++views_;
  CellSums count(columns_, rows_), seen(columns_, rows_), predicted(columns_, rows_);
  for (int row = 0, i = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column, ++i) {
      const Brightness& cell = view_[static_cast<std::size_t>(i)];
      count.put(column, row, static_cast<double>(cell.count));
      seen.put(column, row, static_cast<double>(cell.seen));
      predicted.put(column, row, static_cast<double>(cell.predicted));
    }
  const int reach = std::max(2, static_cast<int>(kMaskSurroundings * static_cast<float>(columns_) / 2));
  for (int row = 0, i = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column, ++i) {
      const Brightness& here = view_[static_cast<std::size_t>(i)];
      if (here.count == 0) continue;
      const double around = count.around(column, row, reach);
      if (around < kFewestAround) continue;
      const auto s = here.seen / here.count - static_cast<float>(seen.around(column, row, reach) / around),
                 p = here.predicted / here.count - static_cast<float>(predicted.around(column, row, reach) / around);
      Evidence& cell = cells_[static_cast<std::size_t>(i)];
      cell.local += 1;
      cell.s += s;
      cell.p += p;
      cell.ss += s * s;
      cell.pp += p * p;
      cell.sp += s * p;
    }
}

std::vector<VehicleMask::Cell> VehicleMask::decide() const {
  CellSums compared(columns_, rows_), alike(columns_, rows_), freedom(columns_, rows_), ss(columns_, rows_),
      pp(columns_, rows_), sp(columns_, rows_);
  for (int row = 0, i = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column, ++i) {
      const Evidence& cell = cells_[static_cast<std::size_t>(i)];
      const double n = std::max(1.0, static_cast<double>(cell.local)), s = static_cast<double>(cell.s),
                   p = static_cast<double>(cell.p);
      compared.put(column, row, cell.compared);
      alike.put(column, row, cell.alike);
      freedom.put(column, row, n - 1);
      ss.put(column, row, static_cast<double>(cell.ss) - s * s / n);
      pp.put(column, row, static_cast<double>(cell.pp) - p * p / n);
      sp.put(column, row, static_cast<double>(cell.sp) - s * p / n);
    }
  std::vector<Cell> out(cells_.size(), Cell::Unknown);
  for (int row = 0, i = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column, ++i) {
      // Few cells where they suffice: at the outline they are of one kind.
      int reach = 0;
      while (reach < kNeighbours && freedom.around(column, row, reach) < kMaskEnough) ++reach;
      const double count = compared.around(column, row, reach), free = freedom.around(column, row, reach);
      Cell& cell = out[static_cast<std::size_t>(i)];
      double seen = 0;
      if (free >= kMaskEnough) {
        const double predicted = pp.around(column, row, reach) / free, both = sp.around(column, row, reach) / free;
        seen = ss.around(column, row, reach) / free;
        const double follows = seen > 0 && predicted > 0 ? both / std::sqrt(seen * predicted) : 0;
        const bool has_texture = predicted >= kMaskTexture * kMaskTexture;
        if (follows >= kFollows) cell = Cell::World;
        if (has_texture && follows < kIsDeaf && seen <= kStill * kStill) cell = Cell::Vehicle;
        if (has_texture || cell != Cell::Unknown) continue;
      }
      if (count < kMaskEnough) continue;
      const double share = alike.around(column, row, reach) / count;
      if (share >= kSame) cell = Cell::World;
      if (share <= kOther && seen <= kStill * kStill) cell = Cell::Vehicle;
    }
  return out;
}

VehicleMask::Found VehicleMask::find() const {
  Found out;
  out.cell_px = cell_px_;
  out.columns = columns_;
  out.rows = rows_;
  out.cells = decide();
  out.compared = compared_;
  out.views = views_;
  const auto decided = std::ranges::count_if(out.cells, [](Cell cell) { return cell != Cell::Unknown; });
  out.is_determined =
      views_ >= kFewestViews && static_cast<double>(decided) >= kDecided * static_cast<double>(out.cells.size());
  const cv::Mat mask = without_gaps(out.cells, columns_, rows_);
  for (const std::uint8_t value : cv::Mat_<std::uint8_t>(mask)) out.vehicle.push_back(value != 0);
  out.polygons = outlines(mask, cell_px_);
  for (const Evidence& cell : cells_) {
    auto& mean = out.mean.emplace_back();
    for (std::size_t i = 0; i < 3 && cell.compared > 0; ++i)
      mean[i] = static_cast<std::uint8_t>(cell.sum[i] / cell.compared);
  }
  return out;
}

}  // namespace hueline::calibration
