#include "storage/projection.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace hueline::storage {
namespace {

constexpr double kSide = 256.0;      // m
constexpr double kHalf = kSide / 2;  // also the step between the points of the fit
constexpr double kFitWithin = 1e-5;  // m

Eigen::Matrix<double, 10, 1> terms(double e, double n, double u) {
  Eigen::Matrix<double, 10, 1> t;
  t << 1, e, n, u, e * e, n * n, u * u, e * n, e * u, n * u;
  return t;
}

}  // namespace

Projection::Projection(const Geodetic& origin, MapOperation operation)
    : origin_(origin), T_ecef_enu_(ecef_from_enu(origin)), operation_(std::move(operation)) {}
// last_ points to a node of cubes_, which stays where it is when the map is moved.
Projection::Projection(Projection&&) noexcept = default;
Projection& Projection::operator=(Projection&&) noexcept = default;
Projection::~Projection() = default;

Result<Projection> Projection::create(const Geodetic& origin, const MapConfig& map, double epoch) {
  if (!std::isfinite(origin.latitude) || !std::isfinite(origin.longitude) || !std::isfinite(origin.ellipsoidal_height))
    return Error{ErrorCode::Invalid, "the origin of the cloud is not a place"};
  auto operation = MapOperation::create(origin, map, epoch);
  if (!operation.ok()) return operation.error();
  return Projection(origin, std::move(*operation));
}

Eigen::Vector3d Projection::project_exactly(double east, double north, double up) const {
  const auto [x, y, height] = operation_.apply(to_geodetic(T_ecef_enu_ * Point<Enu>{{east, north, up}}));
  return {x, y, height};
}

Projection::Cube Projection::fit(std::int64_t east, std::int64_t north, std::int64_t up) const {
  Cube cube{east, north, up, false, Eigen::Matrix<double, 3, 10>::Zero()};
  const auto f = [&](int e, int n, int u) {  // e, n, u: steps of half a side from the centre
    const auto along = [](std::int64_t index, int step) {
      return (static_cast<double>(index) + 0.5) * kSide + step * kHalf;
    };
    return project_exactly(along(east, e), along(north, n), along(up, u));
  };
  const Eigen::Vector3d f0 = f(0, 0, 0);
  const auto axis = [&](int column, const Eigen::Vector3d& plus, const Eigen::Vector3d& minus) {
    cube.coefficients.col(1 + column) = (plus - minus) / 2;
    cube.coefficients.col(4 + column) = (plus + minus) / 2 - f0;
  };
  cube.coefficients.col(0) = f0;
  axis(0, f(1, 0, 0), f(-1, 0, 0));
  axis(1, f(0, 1, 0), f(0, -1, 0));
  axis(2, f(0, 0, 1), f(0, 0, -1));
  cube.coefficients.col(7) = (f(1, 1, 0) - f(1, -1, 0) - f(-1, 1, 0) + f(-1, -1, 0)) / 4;
  cube.coefficients.col(8) = (f(1, 0, 1) - f(1, 0, -1) - f(-1, 0, 1) + f(-1, 0, -1)) / 4;
  cube.coefficients.col(9) = (f(0, 1, 1) - f(0, 1, -1) - f(0, -1, 1) + f(0, -1, -1)) / 4;
  for (int corner = 0; corner < 8; ++corner) {
    const int e = corner & 1 ? 1 : -1, n = corner & 2 ? 1 : -1, u = corner & 4 ? 1 : -1;
    const Eigen::Vector3d difference = cube.coefficients * terms(e, n, u) - f(e, n, u);
    if (!(difference.cwiseAbs().maxCoeff() <= kFitWithin)) cube.exact = true;
  }
  return cube;
}

const Projection::Cube& Projection::cube_at(double east, double north, double up) {
  const auto index = [](double x) { return static_cast<std::int64_t>(std::floor(x / kSide)); };
  const std::int64_t e = index(east), n = index(north), u = index(up);
  if (last_ && last_->east == e && last_->north == n && last_->up == u) return *last_;
  const auto part = [](std::int64_t i) { return static_cast<std::uint64_t>(i) & 0x1FFFFF; };  // 21 bits: 537 000 km
  const std::uint64_t key = part(e) << 42 | part(n) << 21 | part(u);
  auto found = cubes_.find(key);
  if (found == cubes_.end()) found = cubes_.emplace(key, fit(e, n, u)).first;
  last_ = &found->second;
  return *last_;
}

Eigen::Vector3d Projection::project(double east, double north, double up) {
  constexpr double kFar = 1e6;  // m from the origin; the comparison also refuses NaN
  if (!(std::abs(east) < kFar && std::abs(north) < kFar && std::abs(up) < kFar))
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Cube& cube = cube_at(east, north, up);
  if (cube.exact) return project_exactly(east, north, up);
  const auto local = [](double x, std::int64_t i) { return (x - (static_cast<double>(i) + 0.5) * kSide) / kHalf; };
  const double e = local(east, cube.east), n = local(north, cube.north), u = local(up, cube.up);
  Eigen::Vector3d p;
  const auto& c = cube.coefficients;
  for (int k = 0; k < 3; ++k)
    p[k] = c(k, 0) + (e * (c(k, 1) + e * c(k, 4) + n * c(k, 7) + u * c(k, 8)) +
                      n * (c(k, 2) + n * c(k, 5) + u * c(k, 9)) + u * (c(k, 3) + u * c(k, 6)));
  return p;
}

}  // namespace hueline::storage
