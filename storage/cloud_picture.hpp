#pragma once

#include <Eigen/Core>

#include "storage/las_reader.hpp"
#include "storage/png.hpp"

/// Pictures of a LAS file, for people: from above and from the street. Points without a colour (our colour_state 2 and
/// above) are drawn in grey by their intensity. Files without colours are drawn in grey altogether.
namespace hueline::storage {

struct TopViewConfig {
  int longest_side_px = 2000;  ///< 100 ... 20000: the side of the picture that shows the cloud's longer extent
  /// Share of the points that may lie outside on each of the four sides: a few far returns must not shrink the street.
  double cut_share = 0.002;  ///< 0 ... 0.2
  std::string validate() const;
};
/// What the picture shows, to find a place in it.
struct TopView {
  RgbImage image;
  double west = 0, north = 0;  ///< CRS coordinates of the upper left corner of pixel (0, 0), m
  double cell_m = 0;           ///< side of a pixel
  double scale_bar_m = 0;      ///< length of the drawn scale bar
  Status read;                 ///< Truncated: the cloud was cut, and the picture shows what there is of it
};
/// Seen from above, grid north up: the highest coloured point in each cell, gaps of a cell or two closed; with north
/// arrow and scale bar. Reads the file twice. Errors: those of LasReader; Invalid if there is no point.
Result<TopView> picture_from_above(const std::filesystem::path& las, const TopViewConfig& config = {});

struct StreetViewConfig {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the eye: easting, northing, height in the file's CRS, m
  double heading = 0;                                  ///< rad, clockwise from grid north
  double pitch = 0;                                    ///< rad, up positive
  double horizontal_view = 1.5;                        ///< rad, 0.2 ... 2.6: width of the view
  int width = 1920, height = 1080;                     ///< px, 16 ... 10000
  double nearest_m = 1.0, farthest_m = 200.0;
  double splat_m = 0.02;  ///< radius of a point's disc near by, 0.001 ... 1
  double splat_share =
      0.0025;  ///< of the distance, 0 ... 0.1: the disc's least radius, as points lie wider apart farther away
  std::string validate() const;
};
struct StreetView {
  RgbImage image;
  Status read;  ///< as of TopView
};
/// Perspective view with hidden points removed: each point is a disc whose size falls with distance; what shines
/// through between points of a near surface is closed. Errors: those of LasReader.
Result<StreetView> picture_from_street(const std::filesystem::path& las, const StreetViewConfig& config);

}  // namespace hueline::storage
