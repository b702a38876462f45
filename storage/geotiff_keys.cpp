#include "storage/geotiff_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "storage/byte_order.hpp"
#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint16_t kKeyDirectory = 34735, kKeyDoubles = 34736;
constexpr std::uint16_t kDegree = 9102;

/// A parameter of a projection: its name in WKT, and the keys that may have it. Which of them a program uses for a
/// projection differs.
struct Parameter {
  const char* wkt;
  std::array<std::uint16_t, 3> keys;
  double otherwise = 0;
};
struct Method {
  std::uint16_t number;
  const char* wkt;
  std::vector<Parameter> parameters;
};

// Of the natural origin, the false origin and the centre.
constexpr std::array<std::uint16_t, 3> kLatitude{3081, 3085, 3089}, kLongitude{3080, 3084, 3088},
    kFalseEasting{3082, 3086, 3090}, kFalseNorthing{3083, 3087, 3091}, kScale{3092, 3093, 0};

const std::vector<Method>& methods() {
  static const std::vector<Method> all = [] {
    const Parameter latitude{"latitude_of_origin", kLatitude}, meridian{"central_meridian", kLongitude},
        scale{"scale_factor", kScale, 1}, easting{"false_easting", kFalseEasting},
        northing{"false_northing", kFalseNorthing}, first{"standard_parallel_1", {3078}},
        second{"standard_parallel_2", {3079}};
    return std::vector<Method>{
        {1, "Transverse_Mercator", {latitude, meridian, scale, easting, northing}},
        {7, "Mercator_1SP", {meridian, scale, easting, northing}},
        {8, "Lambert_Conformal_Conic_2SP", {first, second, latitude, meridian, easting, northing}},
        {9, "Lambert_Conformal_Conic_1SP", {latitude, meridian, scale, easting, northing}},
        {11,
         "Albers_Conic_Equal_Area",
         {first, second, {"latitude_of_center", kLatitude}, {"longitude_of_center", kLongitude}, easting, northing}}};
  }();
  return all;
}

/// Returns WKT of what EPSG has under a number, in the form of LAS; empty if there is none.
std::string epsg_wkt(PJ_CONTEXT* context, std::uint16_t number, PJ_CATEGORY category) {
  const ProjObject found(
      proj_create_from_database(context, "EPSG", std::to_string(number).c_str(), category, 0, nullptr));
  constexpr const char* kForm[] = {"MULTILINE=NO", nullptr};
  const char* const wkt = found ? proj_as_wkt(context, found.get(), PJ_WKT1_GDAL, kForm) : nullptr;
  return wkt ? wkt : "";
}

}  // namespace

GeoKeys::GeoKeys(const LasReader& cloud) {
  std::vector<double> doubles;
  for (const LasVlr& record : cloud.records())
    if (record.user_id == "LASF_Projection" && record.record_id == kKeyDoubles) {
      ByteReader in(as_bytes(record.data));
      doubles.resize(record.data.size() / sizeof(double));
      for (double& value : doubles) value = in.take<double>();
    }
  for (const LasVlr& record : cloud.records()) {
    if (record.user_id != "LASF_Projection" || record.record_id != kKeyDirectory) continue;
    ByteReader in(as_bytes(record.data));
    in.take_bytes(6);  // versions
    const auto count = in.take<std::uint16_t>();
    for (std::uint16_t i = 0; i < count && in.ok(); ++i) {
      const auto key = in.take<std::uint16_t>(), place = in.take<std::uint16_t>();
      in.take<std::uint16_t>();
      const auto value = in.take<std::uint16_t>();
      if (!in.ok()) break;
      if (place == 0) values_[key] = value;
      if (place == kKeyDoubles && value < doubles.size()) numbers_[key] = doubles[value];
    }
  }
}

std::uint16_t GeoKeys::operator[](GeoKey key) const {
  const auto found = values_.find(static_cast<std::uint16_t>(key));
  return found == values_.end() ? std::uint16_t{0} : found->second;
}

std::optional<double> GeoKeys::number(std::uint16_t key) const {
  const auto found = numbers_.find(key);
  return found == numbers_.end() || !std::isfinite(found->second) ? std::nullopt : std::optional(found->second);
}

std::string GeoKeys::horizontal_crs() const {
  constexpr std::uint16_t kGeocentric = 3, kWgs84 = 4326, kWgs84Heights = 4979;
  const std::uint16_t geographic = (*this)[GeoKey::GeographicCrs], model = (*this)[GeoKey::ModelType];
  // Programs give the geographic CRS of geocentric coordinates, and GeoTIFF has no key for the geocentric one.
  if (model == kGeocentric && (geographic == kWgs84 || geographic == kWgs84Heights)) return "EPSG:4978";
  const std::uint16_t crs = is_geographic() || model == kGeocentric ? geographic : (*this)[GeoKey::ProjectedCrs];
  return crs == 0 || crs == kGeoUserDefined ? std::string() : "EPSG:" + std::to_string(crs);
}

bool GeoKeys::has_own_projection() const {
  return !is_geographic() && (*this)[GeoKey::ProjectedCrs] == kGeoUserDefined && (*this)[GeoKey::ProjectionMethod] != 0;
}

Result<std::string> GeoKeys::own_projection() const {
  const auto method = std::ranges::find(methods(), (*this)[GeoKey::ProjectionMethod], &Method::number);
  const std::uint16_t angle = (*this)[GeoKey::AngularUnit];
  if (!has_own_projection() || method == methods().end() || (angle != 0 && angle != kDegree) ||
      number(static_cast<std::uint16_t>(GeoKey::PrimeMeridian)).value_or(0) != 0)
    return std::string();
  const std::uint16_t unit = (*this)[GeoKey::LinearUnit];
  std::optional<double> metres = unit == 0 ? std::optional(1.0) : metres_of_unit(unit);
  if (!metres) metres = number(static_cast<std::uint16_t>(GeoKey::LinearUnitSize));
  if (!metres || *metres <= 0) return std::string();

  const ProjContext context;
  const auto named = [&](GeoKey key, PJ_CATEGORY category) {
    const std::uint16_t number_of_it = (*this)[key];
    return number_of_it == 0 || number_of_it == kGeoUserDefined ? std::string()
                                                                : epsg_wkt(context.get(), number_of_it, category);
  };
  std::string geographic = named(GeoKey::GeographicCrs, PJ_CATEGORY_CRS);
  if (geographic.empty()) {
    std::string datum = named(GeoKey::Datum, PJ_CATEGORY_DATUM);
    if (datum.empty()) {
      std::string ellipsoid = named(GeoKey::Ellipsoid, PJ_CATEGORY_ELLIPSOID);
      const auto axis = number(static_cast<std::uint16_t>(GeoKey::SemiMajorAxis)),
                 flattening = number(static_cast<std::uint16_t>(GeoKey::InverseFlattening));
      if (ellipsoid.empty() && axis && flattening)
        ellipsoid = fmt::format("SPHEROID[\"unknown\",{},{}]", *axis, *flattening);
      if (!ellipsoid.empty()) datum = fmt::format("DATUM[\"unknown\",{}]", ellipsoid);
    }
    if (!datum.empty())
      geographic =
          fmt::format("GEOGCS[\"unknown\",{},PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]", datum);
  }
  if (Status database = context.database(); !database) return database.error();
  if (geographic.empty()) return std::string();
  std::string out = fmt::format("PROJCS[\"unnamed\",{},PROJECTION[\"{}\"]", geographic, method->wkt);
  for (const Parameter& parameter : method->parameters) {
    double value = parameter.otherwise;
    for (const std::uint16_t key : parameter.keys)
      if (const auto stored = number(key)) {
        value = *stored;
        break;
      }
    out += fmt::format(",PARAMETER[\"{}\",{}]", parameter.wkt, value);
  }
  const char* const unit_name = *metres == 1   ? "metre"
                                : unit == 9002 ? "foot"
                                : unit == 9003 ? "US survey foot"
                                               : "unknown";
  return out + fmt::format(",UNIT[\"{}\",{}]]", unit_name, *metres);
}

std::optional<double> metres_of_unit(std::uint16_t unit) {
  switch (unit) {
    case 9001:
      return 1;
    case 9002:
      return 0.3048;
    case 9003:
      return 1200.0 / 3937;
    default:
      return {};
  }
}

}  // namespace hueline::storage
