#pragma once

#include <vector>

#include <Eigen/Core>

#include "storage/png.hpp"

/// The parts that the perspective pictures of a cloud share: the view from one eye, and a picture with a depth for each
/// pixel.
namespace hueline::storage {

/// The view of a pinhole camera. Pixel (0, 0) is the centre of the upper left pixel.
class PointView {
 public:
  /// `eye` is in the cloud's coordinates, m. `heading` is clockwise from grid north and `pitch` positive upwards, rad.
  /// `focal` is in px.
  PointView(const Eigen::Vector3d& eye, double heading, double pitch, double focal, int width, int height);

  struct Seen {
    double x, y;   ///< px; without meaning if the depth is not positive
    double depth;  ///< m along the optical axis; negative behind the eye
  };
  Seen project(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d d = point - eye_;
    const double depth = d.dot(forward_);
    return {cx_ + focal_ * d.dot(right_) / depth, cy_ + focal_ * d.dot(down_) / depth, depth};
  }

 private:
  Eigen::Vector3d eye_, forward_, right_, down_;
  double focal_, cx_, cy_;
};

/// A picture and the depth of each of its pixels.
struct PointCanvas {
  RgbImage image;
  std::vector<float> depth;  ///< m along the optical axis; infinite where nothing is drawn

  PointCanvas(int width, int height);
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * image.width + x; }
};

/// Draws a disc whose middle is nearer than its rim. Where the discs of a surface overlap, each pixel therefore takes
/// the colour of the nearest middle.
void draw_disc(PointCanvas& canvas, double x, double y, double radius_px, double depth, double radius_m, Rgb colour);

/// Closes the gaps between the points of a surface: a pixel that is empty, or far behind the pixels all around it,
/// takes the mean of `count` pixels within `radius` pixels. Beside an edge the near pixels lie on one side only, so
/// surfaces do not grow.
void close_gaps(PointCanvas& canvas, double radius, int count);

}  // namespace hueline::storage
