#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>

#include "core/geodesy.hpp"
#include "core/result.hpp"
#include "storage/map_operation.hpp"

/// Transforms points from the local level frame of a drive to a projected map.
namespace hueline::storage {

/// Transforms Enu coordinates at an origin to easting, northing and height on a map, in its units
/// (MapOperation::unit()).
///
/// In each cube of 256 m a quadratic polynomial, fitted to the MapOperation, places the points. It was within 2e-7 m of
/// PROJ wherever it was tried. In a cube whose corners it does not meet within 1e-5 m, the operation is asked for each
/// point. The result of a point depends on that point alone, not on other points, their order or the thread. Move-only.
/// Thread safety: none, because it keeps the cubes; one thread calls all functions.
class Projection {
 public:
  /// Creates the projection for the drive's map, at the drive's epoch (decimal year). Errors: those of
  /// MapOperation::create().
  static Result<Projection> create(const Geodetic& origin, const MapConfig& map = {}, double epoch = 0);
  Projection(Projection&&) noexcept;
  Projection& operator=(Projection&&) noexcept;
  ~Projection();

  /// Returns {easting, northing, height}. The values are not finite if the place cannot be projected.
  Eigen::Vector3d project(double east, double north, double up);
  /// Returns the same by the MapOperation itself, for checks.
  Eigen::Vector3d project_exactly(double east, double north, double up) const;

  const Geodetic& origin() const { return origin_; }
  /// The map, and the way to it.
  const MapOperation& operation() const { return operation_; }

 private:
  struct Cube {
    std::int64_t east = 0, north = 0, up = 0;  // indices of the cube; its centre is (index + 0.5) * side
    bool exact = false;                        // the polynomial does not fit: ask the operation
    /// Columns: constant, e, n, u, ee, nn, uu, en, eu, nu in units of half a side.
    Eigen::Matrix<double, 3, 10> coefficients;
  };
  Projection(const Geodetic& origin, MapOperation operation);
  const Cube& cube_at(double east, double north, double up);
  Cube fit(std::int64_t east, std::int64_t north, std::int64_t up) const;

  Geodetic origin_;
  Transform<Ecef, Enu> T_ecef_enu_;
  MapOperation operation_;
  std::unordered_map<std::uint64_t, Cube> cubes_;
  const Cube* last_ = nullptr;
};

}  // namespace hueline::storage
