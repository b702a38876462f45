#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/coloured_point.hpp"
#include "core/geodesy.hpp"
#include "fusion/camera_model.hpp"
#include "storage/projection.hpp"

/// Tables that say where the pictures of a drive were taken, in the formats of the programs that read them. The pixels
/// of all of them are those of single lenses as they stood on the vehicle: no picture is turned level with gravity, and
/// the tables say so.
namespace hueline::products {

/// A lens of the head, as its pictures show it.
struct PictureLens {
  std::string name;  ///< letters, digits, '_', '-' and '.'; also the name of the pictures' folder
  fusion::CameraIntrinsics intrinsics;
  nanoseconds row_time{0};  ///< of a rolling shutter; the poses are those of the middle row
};

/// One picture, and the place and direction of its lens at the middle of the exposure.
struct TakenPicture {
  std::string file;      ///< below the folder of the tables
  std::size_t lens = 0;  ///< number among the lenses of the set
  std::uint32_t exposure = 0;
  GpsTime time{};
  nanoseconds sigma_time{0};
  Transform<Enu, Lens> T_enu_lens;                           ///< in the local level of the drive
  Eigen::Vector3d sigma_position = Eigen::Vector3d::Zero();  ///< of the lens: one sigma east, north, up, m
  Eigen::Vector3d sigma_attitude = Eigen::Vector3d::Zero();  ///< of the vehicle: roll, pitch, heading, rad
};

/// A point that a picture shows.
struct Observation {
  std::uint32_t point = 0;  ///< number among the points of the set
  float u = 0, v = 0;       ///< its pixel, by the model and pose of the picture; pixel centres have whole numbers
};

/// What all pictures of a set have in common.
struct PictureSet {
  std::filesystem::path folder;     ///< exists
  std::vector<PictureLens> lenses;  ///< of all pictures
  Geodetic origin;                  ///< of the local level of the drive
  storage::MapConfig map;           ///< of the cloud
  double epoch = 0;                 ///< of the drive, decimal year
};

/// What a set shows in the end.
struct ShownPoints {
  std::span<const TakenPicture> pictures;          ///< all of them, in the order in which they were added
  std::span<const ColouredPoint> points;           ///< a sample of the cloud, in the local level of the drive
  std::span<const std::vector<Observation>> seen;  ///< of each picture, in the order of the points
};

/// Receives the pictures of a set in the order in which they are written, then the points. Thread safety: none.
class ImageTable {
 public:
  virtual ~ImageTable() = default;
  virtual void add(const TakenPicture& picture) = 0;
  /// Ends the table. Errors: Io.
  virtual Status close(const ShownPoints& shown) = 0;
};

/// COLMAP's text model (colmap.github.io/format.html): cameras.txt, images.txt and points3D.txt in `folder`/sparse/0,
/// names of pictures relative to `folder`/images. The world is the local level of the drive: x east, y north, z up, m.
/// The observations are where the poses show the points, so nothing is left to reproject: the column ERROR is how far
/// the sigma of the point's place would shift its pixel, px, as a mean of its pictures; -1 (COLMAP's "not known") for a
/// point that none shows. Errors: Io.
Result<std::unique_ptr<ImageTable>> make_colmap_table(const PictureSet& set);
/// transforms.json as nerfstudio reads it (docs.nerf.studio), and points.ply. The world is that of COLMAP's model; a
/// camera looks along its -z axis, y up. The format has one lens model for all pictures. Errors: Unsupported if the
/// lenses need two; Io.
Result<std::unique_ptr<ImageTable>> make_nerfstudio_table(const PictureSet& set);
/// poses.csv, with coordinates on the map and on the ellipsoid and angles in two systems (docs/formats.md). Errors:
/// those of storage::Projection::create(); Io.
Result<std::unique_ptr<ImageTable>> make_pose_table(const PictureSet& set);

/// The angles of photogrammetry, rad: R = R_x(omega) R_y(phi) R_z(kappa) turns the axes of a picture (x right, y up, z
/// towards the viewer) into those of the map (easting, northing, height).
struct OmegaPhiKappa {
  double omega = 0, phi = 0, kappa = 0;
};
/// `R_map_lens` turns the axes of the lens (core/frames.hpp) into those of the map. Where phi is 90 degrees, kappa is
/// 0.
OmegaPhiKappa omega_phi_kappa(const Eigen::Matrix3d& R_map_lens);

}  // namespace hueline::products
