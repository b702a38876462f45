#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "core/geodesy.hpp"
#include "core/result.hpp"

/// Transforms points from the local level frame of a drive to a projected map.
namespace hueline::storage {

/// Returns the EPSG code of the WGS84 UTM zone at a place, with the exceptions around Norway and Svalbard.
int utm_epsg(const Geodetic& place);

/// Transforms Enu coordinates at an origin to easting and northing in a projected CRS (m) and WGS84 ellipsoidal height
/// (m; no geoid is applied).
///
/// In each cube of 256 m a quadratic polynomial, fitted to PROJ, places the points. It was within 2e-7 m of PROJ
/// wherever it was tried. In a cube whose corners it does not meet within 1e-5 m, PROJ is asked for each point. The
/// result of a point depends on that point alone, not on other points, their order or the thread. Move-only.
/// Thread safety: none, because it keeps the cubes; one thread calls all functions.
class Projection {
 public:
  /// Creates the projection. `epsg` 0 means the UTM zone of the origin. Error: Invalid, with a sentence, if the code is
  /// unknown, is not a projected CRS in metres, or is not used where the drive is.
  static Result<Projection> create(const Geodetic& origin, int epsg = 0);
  Projection(Projection&&) noexcept;
  Projection& operator=(Projection&&) noexcept;
  ~Projection();

  /// Returns {easting, northing, ellipsoidal height}. The values are not finite if the place cannot be projected.
  Eigen::Vector3d project(double east, double north, double up);
  /// Returns the same by PROJ itself, for checks.
  Eigen::Vector3d project_exactly(double east, double north, double up) const;

  const Geodetic& origin() const { return origin_; }
  int epsg() const { return epsg_; }
  const std::string& crs_name() const { return name_; }
  /// Returns the projected CRS with ellipsoidal height as OGC WKT 1, which LAS 1.4 requires.
  const std::string& wkt() const { return wkt_; }

 private:
  struct Proj;
  struct Cube {
    std::int64_t east = 0, north = 0, up = 0;  // indices of the cube; its centre is (index + 0.5) * side
    bool exact = false;                        // the polynomial does not fit: ask PROJ
    /// Columns: constant, e, n, u, ee, nn, uu, en, eu, nu in units of half a side.
    Eigen::Matrix<double, 3, 10> coefficients;
  };
  Projection(const Geodetic& origin, int epsg, std::unique_ptr<Proj> proj);
  const Cube& cube_at(double east, double north, double up);
  Cube fit(std::int64_t east, std::int64_t north, std::int64_t up) const;

  Geodetic origin_;
  int epsg_;
  std::string name_, wkt_;
  Transform<Ecef, Enu> T_ecef_enu_;
  std::unique_ptr<Proj> proj_;
  std::unordered_map<std::uint64_t, Cube> cubes_;
  const Cube* last_ = nullptr;
};

}  // namespace hueline::storage
