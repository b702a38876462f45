#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "core/geodesy.hpp"
#include "core/result.hpp"

/// From the local level of a drive to a projected map.
namespace hueline::storage {

/// The EPSG code of WGS84's UTM zone at a place, with the exceptions around Norway and Svalbard.
int utm_epsg(const Geodetic& place);

/// Enu at an origin -> easting and northing of a projected CRS (m) and WGS84 ellipsoidal height (m; no geoid is
/// applied).
///
/// Points are placed by a quadratic polynomial per cube of 256 m that is fitted to PROJ; it was within 2e-7 m of PROJ
/// wherever it was tried, and a cube in which it is not within 1e-5 m at its corners asks PROJ for each point. A
/// point's result depends on that point alone: not on other points, their order or a thread. Thread-bound (it keeps the
/// cubes). Move-only.
class Projection {
 public:
  /// `epsg` 0: the UTM zone of the origin. Invalid, with a sentence, if the code is unknown, not a projected CRS in
  /// metres, or not used where the drive is.
  static Result<Projection> create(const Geodetic& origin, int epsg = 0);
  Projection(Projection&&) noexcept;
  Projection& operator=(Projection&&) noexcept;
  ~Projection();

  /// {easting, northing, ellipsoidal height}. Not finite if the place cannot be projected.
  Eigen::Vector3d project(double east, double north, double up);
  /// The same by PROJ itself: for checks.
  Eigen::Vector3d project_exactly(double east, double north, double up) const;

  const Geodetic& origin() const { return origin_; }
  int epsg() const { return epsg_; }
  const std::string& crs_name() const { return name_; }
  /// OGC WKT 1 (as LAS 1.4 wants it): the projected CRS with ellipsoidal height.
  const std::string& wkt() const { return wkt_; }

 private:
  struct Proj;
  struct Cube {
    std::int64_t east = 0, north = 0, up = 0;  // index of the cube; its centre is (index + 0.5) * side
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
