#include "storage/projection.hpp"

#include <fmt/format.h>
#include <proj.h>

#include <cmath>
#include <limits>
#include <utility>

#include "core/angle.hpp"

namespace hueline::storage {
namespace {

constexpr double kSide = 256.0;      // m
constexpr double kHalf = kSide / 2;  // also the step between the points of the fit
constexpr double kFitWithin = 1e-5;  // m

struct FreePj {
  void operator()(PJ* p) const { proj_destroy(p); }
};
using PjPtr = std::unique_ptr<PJ, FreePj>;
struct FreeContext {
  void operator()(PJ_CONTEXT* c) const { proj_context_destroy(c); }
};

Eigen::Matrix<double, 10, 1> terms(double e, double n, double u) {
  Eigen::Matrix<double, 10, 1> t;
  t << 1, e, n, u, e * e, n * n, u * u, e * n, e * u, n * u;
  return t;
}

/// Returns a sentence that says why the CRS cannot be used. Empty if it is projected, in metres, without a vertical
/// part, and used at `place`.
std::string objection(PJ_CONTEXT* context, PJ* crs, const Geodetic& place) {
  const PJ_TYPE type = proj_get_type(crs);
  if (type == PJ_TYPE_COMPOUND_CRS)
    return "has heights of its own; clouds carry ellipsoidal heights: name its horizontal part instead";
  if (type != PJ_TYPE_PROJECTED_CRS) return "is not a projected CRS (map coordinates in metres are needed)";
  const PjPtr axes(proj_crs_get_coordinate_system(context, crs));
  double factor = 0;
  const char* unit = nullptr;
  if (!axes ||
      !proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, nullptr, &factor, &unit, nullptr, nullptr))
    return "has no axes";
  if (factor != 1.0) return fmt::format("counts in \"{}\"; only metres can be written", unit ? unit : "?");
  double west = 0, south = 0, east = 0, north = 0;
  const char* area = nullptr;
  if (!proj_get_area_of_use(context, crs, &west, &south, &east, &north, &area) || west < -180) return {};
  constexpr double kBeyond = 3.0;  // degrees by which a drive may leave the area of use
  const double latitude = place.latitude * kDegPerRad, longitude = place.longitude * kDegPerRad;
  const double width = east >= west ? east - west : east - west + 360;
  double from_west = std::fmod(longitude - west + kBeyond + 720, 360);  // >= 0
  if (from_west > width + 2 * kBeyond || latitude < south - kBeyond || latitude > north + kBeyond)
    return fmt::format("is for {} (latitude {} to {}, longitude {} to {}), the drive is at {:.4f}, {:.4f}",
                       area ? area : "?", south, north, west, east, latitude, longitude);
  return {};
}

/// Returns the WKT with ellipsoidal heights. WKT 1 has no 3D CRS, so the heights are a vertical datum of type 2002 (OGC
/// 01-009), which PROJ and GDAL understand.
std::string with_ellipsoidal_height(const std::string& name, const std::string& projected) {
  return "COMPD_CS[\"" + name + " + ellipsoidal height\"," + projected +
         ",VERT_CS[\"Ellipsoid (metre)\",VERT_DATUM[\"Ellipsoid\",2002],UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],"
         "AXIS[\"Up\",UP]]]";
}

}  // namespace

struct Projection::Proj {
  std::unique_ptr<PJ_CONTEXT, FreeContext> context;
  PjPtr transformation;  // longitude, latitude in degrees, height -> easting, northing
};

int utm_epsg(const Geodetic& place) {
  const double latitude = place.latitude * kDegPerRad, longitude = place.longitude * kDegPerRad;
  int zone = static_cast<int>(std::floor((longitude + 180) / 6)) % 60 + 1;
  if (latitude >= 56 && latitude < 64 && longitude >= 3 && longitude < 12) zone = 32;
  if (latitude >= 72 && latitude < 84 && longitude >= 0 && longitude < 42)
    zone = longitude < 9 ? 31 : longitude < 21 ? 33 : longitude < 33 ? 35 : 37;
  return (latitude >= 0 ? 32600 : 32700) + zone;
}

Projection::Projection(const Geodetic& origin, int epsg, std::unique_ptr<Proj> proj)
    : origin_(origin), epsg_(epsg), T_ecef_enu_(ecef_from_enu(origin)), proj_(std::move(proj)) {}
// last_ points to a node of cubes_, which stays where it is when the map is moved.
Projection::Projection(Projection&&) noexcept = default;
Projection& Projection::operator=(Projection&&) noexcept = default;
Projection::~Projection() = default;

Result<Projection> Projection::create(const Geodetic& origin, int epsg) {
  if (!std::isfinite(origin.latitude) || !std::isfinite(origin.longitude) || !std::isfinite(origin.ellipsoidal_height))
    return Error{ErrorCode::Invalid, "the origin of the cloud is not a place"};
  const int code = epsg == 0 ? utm_epsg(origin) : epsg;
  auto proj = std::make_unique<Proj>();
  proj->context.reset(proj_context_create());
  PJ_CONTEXT* const context = proj->context.get();
  proj_log_level(context, PJ_LOG_NONE);
  proj_context_set_enable_network(context, 0);  // no grids, which may be there one day and not the next
  const std::string named = "EPSG:" + std::to_string(code);
  const PjPtr crs(proj_create(context, named.c_str()));
  const char* const whose = epsg == 0 ? " (UTM zone of the drive)" : "";
  if (!crs)
    return Error{ErrorCode::Invalid,
                 named + whose + " is not known to PROJ: give the code of a projected CRS, or 0 for UTM"};
  if (const std::string why = objection(context, crs.get(), origin); !why.empty())
    return Error{ErrorCode::Invalid, named + whose + " " + why};
  const PjPtr wgs84(proj_create(context, "EPSG:4979"));
  if (!wgs84) return Error{ErrorCode::Unavailable, "PROJ's database is missing (package proj-data)"};
  const double latitude = origin.latitude * kDegPerRad, longitude = origin.longitude * kDegPerRad;
  const std::unique_ptr<PJ_AREA, decltype(&proj_area_destroy)> area(proj_area_create(), &proj_area_destroy);
  proj_area_set_bbox(area.get(), longitude - 0.01, latitude - 0.01, longitude + 0.01, latitude + 0.01);
  const PjPtr as_stated(proj_create_crs_to_crs_from_pj(context, wgs84.get(), crs.get(), area.get(), nullptr));
  if (as_stated) proj->transformation.reset(proj_normalize_for_visualization(context, as_stated.get()));
  if (!proj->transformation) return Error{ErrorCode::Invalid, "PROJ has no transformation from WGS84 to " + named};
  const char* const wkt_options[] = {"MULTILINE=NO", nullptr};
  const char* const wkt = proj_as_wkt(context, crs.get(), PJ_WKT1_GDAL, wkt_options);
  if (!wkt) return Error{ErrorCode::Invalid, named + " cannot be written as OGC WKT 1, which LAS needs"};
  Projection projection(origin, code, std::move(proj));
  projection.name_ = proj_get_name(crs.get());
  projection.wkt_ = with_ellipsoidal_height(projection.name_, wkt);
  if (!projection.project_exactly(0, 0, 0).allFinite())
    return Error{ErrorCode::Invalid,
                 fmt::format("{} cannot show latitude {:.4f}, longitude {:.4f}", named, latitude, longitude)};
  return projection;
}

Eigen::Vector3d Projection::project_exactly(double east, double north, double up) const {
  const Geodetic place = to_geodetic(T_ecef_enu_ * Point<Enu>{{east, north, up}});
  const PJ_COORD in =
      proj_coord(place.longitude * kDegPerRad, place.latitude * kDegPerRad, place.ellipsoidal_height, HUGE_VAL);
  const PJ_COORD out = proj_trans(proj_->transformation.get(), PJ_FWD, in);
  return {out.xyz.x, out.xyz.y, place.ellipsoidal_height};
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
