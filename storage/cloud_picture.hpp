#pragma once

#include <string>

#include <Eigen/Core>

#include "storage/byte_order.hpp"
#include "storage/las_reader.hpp"
#include "storage/png.hpp"

/// Draws pictures of a LAS file for people, seen from above, seen from the street, and moving. Points without a colour
/// (colour_state 2 and above in files of this program) are drawn in grey by their intensity, and so are all points of a
/// file that has no colours.
namespace hueline::storage {

/// Settings of picture_from_above(). validate() returns an empty text if they are valid, else a sentence.
struct TopViewConfig {
  int longest_side_px = 2000;  ///< side of the picture that shows the longer extent of the cloud, px, 100 ... 20000
  /// Share of the points that may lie outside the picture on each of its four sides. It keeps a few far returns from
  /// shrinking the street.
  double cut_share = 0.002;  ///< 0 ... 0.2
  std::string validate() const;
};
/// The picture, and what is needed to find a place in it.
struct TopView {
  RgbImage image;
  double west = 0, north = 0;  ///< CRS coordinates of the upper left corner of pixel (0, 0), m
  double cell_m = 0;           ///< side of a pixel
  double scale_bar_m = 0;      ///< length of the drawn scale bar
  Status read;                 ///< Truncated if the cloud was cut; the picture then shows the points that are there
};
/// Draws the cloud from above, grid north up, with a north arrow and a scale bar. Each cell shows its highest coloured
/// point, and gaps of one or two cells are closed. Reads the file twice. Errors: those of LasReader; Invalid if the
/// file has no point.
Result<TopView> picture_from_above(const std::filesystem::path& las, const TopViewConfig& config = {});

/// Settings of picture_from_street(). validate() returns an empty text if they are valid, else a sentence.
struct StreetViewConfig {
  /// Position of the eye: easting, northing and height in the file's CRS, counted in metres (CrsInMetres).
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double heading = 0;               ///< clockwise from grid north, rad
  double pitch = 0;                 ///< positive upwards, rad
  double horizontal_view = 1.5;     ///< width of the view, rad, 0.2 ... 2.6
  int width = 1920, height = 1080;  ///< px, 16 ... 10000
  double nearest_m = 1.0, farthest_m = 200.0;
  double splat_m = 0.02;  ///< radius of the disc that shows a near point, m, 0.001 ... 1
  /// Smallest radius of the disc as a share of the distance, 0 ... 0.1: points lie wider apart farther away.
  double splat_share = 0.0025;
  std::string validate() const;
};
/// The result of picture_from_street().
struct StreetView {
  RgbImage image;
  Status read;  ///< as in TopView
};
/// Draws a perspective view without the points that nearer surfaces hide. Each point is a disc whose size falls with
/// distance. Gaps between the points of a near surface, through which farther points would show, are closed. Errors:
/// those of LasReader.
Result<StreetView> picture_from_street(const std::filesystem::path& las, const StreetViewConfig& config);

/// Settings of picture_while_driving(). validate() returns an empty text if they are valid, else a sentence.
struct MovingViewConfig {
  double start = 0.35;                 ///< share of the cloud's time at which the picture begins, 0 ... 0.95
  double drive_s = 11;                 ///< duration of the drive that it shows, s, 0.5 ... 60
  double speed = 2.5;                  ///< speed as a multiple of the drive's, 0.5 ... 20
  double frames_per_s = 14;            ///< 1 ... 50
  int width = 640, height = 360;       ///< px, 16 ... 4096
  double brightening = 1.15;           ///< exponent of the curve that lifts dark colours, 0.2 ... 5
  double quality = 60;                 ///< quality of the lossy compression, 0 ... 100
  double horizontal_view = 1.05;       ///< width of the view, rad, 0.2 ... 2.6
  double behind_m = 36, above_m = 19;  ///< place of the eye behind and above the vehicle's place on the ground, m
  double ahead_m = 4;    ///< distance of the point on the ground, before the vehicle, at which the eye looks, m
  double reach_m = 45;   ///< returns farther from the vehicle are not drawn
  double before_s = 10;  ///< returns from this time before the begin are drawn too
  std::uint64_t most_points = 4'000'000;  ///< points in memory, 1000 or more; if there are more, an even share is taken
  std::string validate() const;
};
/// The result of picture_while_driving().
struct MovingView {
  Bytes webp;      ///< the file
  int frames = 0;  ///< number of pictures in it
  Status read;     ///< as in TopView
};
/// Shows the street while it is measured and coloured, from an eye that follows the vehicle, as an animated WebP.
///
/// A return appears when its laser fired (the point's time). It is grey, by the strength of its echo, until the last
/// return that belongs to the exposure of its colour has been fired. Then it takes its colour. Returns without a colour
/// stay grey. A file without the fields `exposure` and `colour_state` of this program shows its colours at once. The
/// place of the vehicle is taken from the cloud itself: it is the middle of the ground that was hit within a short
/// time.
///
/// Reads the file twice and holds at most `most_points` points. Errors: those of LasReader; Unsupported (points without
/// times); Invalid (configuration; less than 0.5 s of drive, or too few points at that place).
Result<MovingView> picture_while_driving(const std::filesystem::path& las, const MovingViewConfig& config = {});

}  // namespace hueline::storage
