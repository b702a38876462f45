#include "storage/map_operation.hpp"

#include <fmt/format.h>
#include <proj_experimental.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include "core/angle.hpp"

namespace hueline::storage {
namespace {

constexpr double kSameMap_m = 1e-6;
constexpr auto kOtherUnit = "counts in \"{}\"; only metres, feet and US survey feet can be written";
constexpr double kNear = 0.01;  // degrees around the place for which operations are chosen
using FreeList = decltype(&proj_list_destroy);
using List = std::unique_ptr<PJ_OBJ_LIST, FreeList>;

std::string name_of(PJ* object) {
  const char* name = proj_get_name(object);
  return name != nullptr ? name : "?";
}

/// Returns the unit of a CRS whose axes count so many metres; nothing if clouds cannot
/// have it.
std::optional<MapUnit> map_unit_of(double metres) {
  constexpr double kRounded = 1e-12;  // PROJ has 15 digits of a US survey foot
  for (const MapUnit& unit : kMapUnits)
    if (std::abs(metres - unit.metres) < kRounded) return unit;
  return {};
}

/// Returns the unit of an axis of a CRS; nothing if clouds cannot have it, and `name` is then what PROJ calls it.
std::optional<MapUnit> unit_along(PJ_CONTEXT* context, const PJ* crs, std::string& name) {
  const ProjObject axes(crs ? proj_crs_get_coordinate_system(context, crs) : nullptr);
  double metres = 0;
  const char* unit = nullptr;
  if (axes) proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, nullptr, &metres, &unit, nullptr, nullptr);
  name = unit ? unit : "?";
  return map_unit_of(metres);
}

/// Returns the first sentence of a description of EPSG; many countries stand behind it.
std::string first_sentence(const char* text) {
  const std::string_view all(text ? text : "?");
  return std::string(all.substr(0, all.find(". ")));
}

/// Returns the unit of a CRS. Errors: Invalid if it is not projected, or not in a unit that clouds can have.
Result<MapUnit> unit_of_map(PJ_CONTEXT* context, PJ* crs) {
  if (proj_get_type(crs) != PJ_TYPE_PROJECTED_CRS)
    return Error{ErrorCode::Invalid, "is not a projected CRS (map coordinates in metres or feet are needed)"};
  std::string name;
  const auto known = unit_along(context, crs, name);
  if (!known) return Error{ErrorCode::Invalid, fmt::format(kOtherUnit, name)};
  return *known;
}

/// Returns a sentence that says for where a CRS is; empty if it is used at `place`.
std::string use_elsewhere(PJ_CONTEXT* context, PJ* crs, const Geodetic& place) {
  double west = 0, south = 0, east = 0, north = 0;
  const char* area = nullptr;
  if (!proj_get_area_of_use(context, crs, &west, &south, &east, &north, &area) || west < -180) return {};
  constexpr double kBeyond = 3.0;  // degrees by which a drive may leave the area of use
  const double latitude = place.latitude * kDegPerRad, longitude = place.longitude * kDegPerRad;
  const double width = east >= west ? east - west : east - west + 360;
  const double from_west = std::fmod(longitude - west + kBeyond + 720, 360);  // >= 0
  if (from_west > width + 2 * kBeyond || latitude < south - kBeyond || latitude > north + kBeyond)
    return fmt::format("is for {} (latitude {} to {}, longitude {} to {}), the drive is at {:.4f}, {:.4f}",
                       first_sentence(area), south, north, west, east, latitude, longitude);
  return {};
}

/// Returns the geographic CRS with heights that EPSG has for the datum of `geographic`, in which GNSS services give
/// positions; null if there is none.
ProjObject with_heights_of(PJ_CONTEXT* context, PJ* geographic) {
  ProjObject datum(proj_crs_get_datum(context, geographic));
  if (!datum) datum.reset(proj_crs_get_datum_ensemble(context, geographic));
  const char* const code = datum ? proj_get_id_code(datum.get(), 0) : nullptr;
  if (code == nullptr) return {};
  const List list(proj_query_geodetic_crs_from_datum(context, "EPSG", "EPSG", code, "geographic 3D"),
                  &proj_list_destroy);
  if (!list) return {};
  for (int i = 0; i < proj_list_get_count(list.get()); ++i) {
    ProjObject found(proj_list_get(context, list.get(), i));
    if (found && !proj_is_deprecated(found.get())) return found;
  }
  return {};
}

/// WKT 1 has no 3D CRS, so ellipsoidal heights are a vertical datum of type 2002 (OGC 01-009), which PROJ and GDAL
/// understand; heights above a geoid are of type 2005.
std::string compound_wkt(const std::string& name, const std::string& projected, const std::string& heights,
                         int datum_type) {
  return "COMPD_CS[\"" + name + "\"," + projected + ",VERT_CS[\"" + heights + " (metre)\",VERT_DATUM[\"" + heights +
         "\"," + std::to_string(datum_type) + "],UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],AXIS[\"Up\",UP]]]";
}

/// Returns the grids of an operation that this computer has not, in words; empty if it has all.
std::string missing_grids(PJ_CONTEXT* context, PJ* operation) {
  std::string out;
  for (int i = 0; i < proj_coordoperation_get_grid_used_count(context, operation); ++i) {
    const char *file = nullptr, *url = nullptr;
    int is_there = 0;
    if (!proj_coordoperation_get_grid_used(context, operation, i, &file, nullptr, nullptr, &url, nullptr, nullptr,
                                           &is_there) ||
        is_there)
      continue;
    out += fmt::format("{}{}{}", out.empty() ? "" : ", ", file ? file : "?",
                       url && *url ? fmt::format(" ({})", url) : std::string());
  }
  return out;
}

/// Returns the parameters of an operation that is a transverse Mercator map and nothing else.
std::optional<TransverseMercator::Parameters> transverse_mercator_of(PJ_CONTEXT* context, const PJ* operation,
                                                                     const PJ* source) {
  constexpr std::string_view kMethod = "9807";  // EPSG's code of the method
  constexpr int kParameters = 5;
  const char* code = nullptr;
  if (proj_get_type(operation) != PJ_TYPE_CONVERSION ||
      !proj_coordoperation_get_method_info(context, operation, nullptr, nullptr, &code) || code == nullptr ||
      code != kMethod || proj_coordoperation_get_param_count(context, operation) != kParameters)
    return {};
  // In rad and m: latitude and longitude of the origin, scale, easting and northing, in the order of EPSG's registry.
  std::array<double, kParameters> values{};
  for (int i = 0; i < kParameters; ++i) {
    double value = 0, unit = 0;
    if (!proj_coordoperation_get_param(context, operation, i, nullptr, nullptr, nullptr, &value, nullptr, &unit,
                                       nullptr, nullptr, nullptr, nullptr))
      return {};
    values[static_cast<std::size_t>(i)] = value * unit;
  }
  const ProjObject ellipsoid(proj_get_ellipsoid(context, source));
  double semi_major = 0, inverse_flattening = 0;
  if (!ellipsoid ||
      !proj_ellipsoid_get_parameters(context, ellipsoid.get(), &semi_major, nullptr, nullptr, &inverse_flattening))
    return {};
  const double flattening = inverse_flattening == 0 ? 0 : 1 / inverse_flattening;
  return TransverseMercator::Parameters{semi_major, flattening, values[0], values[1], values[2], values[3], values[4]};
}

}  // namespace

int utm_epsg(const Geodetic& place) {
  constexpr int kUpsNorth = 5041, kUpsSouth = 5042;
  const double latitude = place.latitude * kDegPerRad, longitude = place.longitude * kDegPerRad;
  if (latitude >= 84) return kUpsNorth;
  if (latitude < -80) return kUpsSouth;
  // A longitude that was rounded may lie beyond the antimeridian, on either side.
  int zone = (static_cast<int>(std::floor((longitude + 180) / 6)) + 60) % 60 + 1;
  if (latitude >= 56 && latitude < 64 && longitude >= 3 && longitude < 12) zone = 32;
  if (latitude >= 72 && latitude < 84 && longitude >= 0 && longitude < 42)
    zone = longitude < 9 ? 31 : longitude < 21 ? 33 : longitude < 33 ? 35 : 37;
  return (latitude >= 0 ? 32600 : 32700) + zone;
}

Result<MapOperation> MapOperation::create(const Geodetic& place, const MapConfig& config, double epoch) {
  MapOperation out;
  PJ_CONTEXT* const context = out.context_.get();
  const bool is_utm = config.crs == "utm";
  out.crs_ = is_utm ? fmt::format("EPSG:{}", utm_epsg(place)) : config.crs;
  // What PROJ has not read is the reason for everything that follows from it.
  const auto refused = [&](const std::string& why, ErrorCode code = ErrorCode::Invalid) {
    const Status database = out.context_.database();
    return database.ok() ? Error{code, why} : database.error();
  };
  const auto invalid = [&](const std::string& why, ErrorCode code = ErrorCode::Invalid) {
    return refused(out.crs_ + (is_utm ? " (UTM zone of the drive) " : " ") + why, code);
  };
  const ProjObject crs(proj_create(context, out.crs_.c_str()));
  if (!crs) return invalid("is not known to PROJ: give the code of a projected CRS, or utm");
  const bool is_compound = proj_get_type(crs.get()) == PJ_TYPE_COMPOUND_CRS;
  const ProjObject horizontal = horizontal_part(context, crs.get());
  if (!horizontal) return invalid("has no horizontal part");
  const Result<MapUnit> unit = unit_of_map(context, horizontal.get());
  if (!unit) return invalid(unit.error().message);
  out.unit_ = *unit;
  if (const std::string why = use_elsewhere(context, horizontal.get(), place); !why.empty())
    return invalid(why, ErrorCode::Unsupported);
  if (is_compound) {
    std::string name;
    const auto known = unit_along(context, ProjObject(proj_crs_get_sub_crs(context, crs.get(), 1)).get(), name);
    if (!known) return invalid("has heights whose axis " + fmt::format(kOtherUnit, name));
    out.up_unit_ = *known;
  }
  if (is_compound && !config.geoid.empty()) return invalid("has heights of its own; leave out cloud.geoid");

  const ProjObject geographic(proj_crs_get_geodetic_crs(context, horizontal.get()));
  if (!geographic) return invalid("has no datum");
  const ProjObject own = with_heights_of(context, geographic.get());
  ProjObject source;
  if (!config.datum.empty()) {
    source.reset(proj_create(context, config.datum.c_str()));
    const PJ_TYPE type = source ? proj_get_type(source.get()) : PJ_TYPE_UNKNOWN;
    if (type != PJ_TYPE_GEOGRAPHIC_2D_CRS && type != PJ_TYPE_GEOGRAPHIC_3D_CRS)
      return refused(fmt::format("cloud.datum: {} is not a geographic CRS", config.datum));
    if (type == PJ_TYPE_GEOGRAPHIC_2D_CRS) source.reset(proj_crs_promote_to_3D(context, nullptr, source.get()));
  } else if (own) {
    source.reset(proj_clone(context, own.get()));
  } else {
    return invalid(
        fmt::format("is on the datum of {}, in which no GNSS service gives positions: say with cloud.datum in "
                    "which CRS the POS gives them",
                    name_of(geographic.get())));
  }
  // Heights of a datum that has none in three dimensions stay those above the ellipsoid of the positions.
  out.has_heights_ = is_compound || own;
  const ProjObject target(is_compound || !own ? proj_clone(context, crs.get())
                                              : proj_crs_promote_to_3D(context, nullptr, horizontal.get()));
  if (!source || !target) return invalid("cannot be used with heights");
  out.epoch_ = config.epoch != 0 ? config.epoch : epoch;
  if (Status chosen = out.choose(place, config, source.get(), target.get()); !chosen.ok())
    return invalid(chosen.error().message, chosen.error().code);
  if (config.datum.empty())
    out.words_ = name_of(source.get()) + ", the map's own datum" + (is_compound ? "; " + out.words_ : std::string());

  const char* const wkt_options[] = {"MULTILINE=NO", nullptr};
  const char* const wkt = proj_as_wkt(context, crs.get(), PJ_WKT1_GDAL, wkt_options);
  if (wkt == nullptr) return invalid("cannot be written as OGC WKT 1, which LAS needs");
  out.name_ = name_of(crs.get());
  if (is_compound) {
    out.wkt_ = wkt;
  } else if (!config.geoid.empty()) {
    const std::string file = std::filesystem::path(config.geoid).filename().string();
    if (config.geoid.find_first_of(" ,\"") != std::string::npos || !std::filesystem::exists(config.geoid))
      return Error{ErrorCode::Invalid,
                   fmt::format("cloud.geoid: {} is no file, or its name has spaces, commas or quotes", config.geoid)};
    const std::string pipeline =
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +inv +proj=vgridshift +multiplier=1 "
        "+grids=" +
        std::filesystem::absolute(config.geoid).string() + " +step +proj=unitconvert +xy_in=rad +xy_out=deg";
    out.to_geoid_.reset(proj_create(context, pipeline.c_str()));
    if (!out.to_geoid_)
      return Error{
          ErrorCode::Invalid,
          fmt::format("cloud.geoid: {} is no grid of geoid heights that PROJ reads (GTX, GeoTIFF)", config.geoid)};
    out.wkt_ = compound_wkt(out.name_ + " + height by " + file, wkt, "height by " + file, 2005);
    out.words_ += "; heights by " + file;
  } else {
    out.wkt_ = compound_wkt(out.name_ + " + ellipsoidal height", wkt, "Ellipsoid", 2002);
    out.words_ += "; heights above the ellipsoid of " + name_of(own ? own.get() : source.get());
  }
  if (!is_compound && out.unit_.metres != 1) out.words_ += ", in metres";
  for (const double value : out.apply(place))
    if (!std::isfinite(value))
      return invalid(
          fmt::format("cannot show latitude {:.4f}, longitude {:.4f}{}", place.latitude * kDegPerRad,
                      place.longitude * kDegPerRad, out.to_geoid_ ? ", or cloud.geoid has no height there" : ""),
          ErrorCode::Unsupported);
  const double area = out.area_at(place);
  // Most programs that show points take x, y and z for axes of a right hand.
  if (!(area > 0))
    return invalid("has axes in an order that makes a mirror image of the ground: give the CRS with east and north");
  constexpr double kToldScale = 0.01;
  if (const double scale = std::sqrt(area); std::abs(scale - 1) > kToldScale)
    out.words_ += fmt::format("; 1 m on the ground is {:.3f} m on this map", scale);
  if (Status database = out.context_.database(); !database.ok()) return database.error();
  return out;
}

double MapOperation::area_at(const Geodetic& place) const {
  constexpr double kSide_m = 10;
  const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(place);
  const auto place_of = [&](double east, double north) {
    const auto at = apply(to_geodetic(T_ecef_enu * Point<Enu>{{east, north, 0}}));
    return Eigen::Vector2d(at[0], at[1]);
  };
  const Eigen::Vector2d corner = place_of(0, 0), east = place_of(kSide_m, 0) - corner,
                        north = place_of(0, kSide_m) - corner;
  return (east.x() * north.y() - east.y() * north.x()) * unit_.metres * unit_.metres / (kSide_m * kSide_m);
}

Status MapOperation::choose(const Geodetic& place, const MapConfig& config, PJ* source, PJ* target) {
  PJ_CONTEXT* const context = context_.get();
  const double latitude = place.latitude * kDegPerRad, longitude = place.longitude * kDegPerRad;
  const std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, decltype(&proj_operation_factory_context_destroy)> factory(
      proj_create_operation_factory_context(context, nullptr), &proj_operation_factory_context_destroy);
  proj_operation_factory_context_set_area_of_interest(context, factory.get(), longitude - kNear, latitude - kNear,
                                                      longitude + kNear, latitude + kNear);
  proj_operation_factory_context_set_spatial_criterion(context, factory.get(),
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  // Grids that are missing shall be named, not passed over.
  proj_operation_factory_context_set_grid_availability_use(context, factory.get(), PROJ_GRID_AVAILABILITY_IGNORED);
  proj_operation_factory_context_set_allow_ballpark_transformations(context, factory.get(), 0);
  const List list(proj_create_operations(context, source, target, factory.get()), &proj_list_destroy);
  std::string missing;
  for (int i = 0; list && i < proj_list_get_count(list.get()); ++i) {
    const ProjObject operation(proj_list_get(context, list.get(), i));
    if (!operation || proj_coordoperation_has_ballpark_transformation(context, operation.get())) continue;
    const double stated = proj_coordoperation_get_accuracy(context, operation.get());
    // A conversion within one datum has no error.
    const double accuracy = stated < 0 && proj_get_type(operation.get()) == PJ_TYPE_CONVERSION ? 0 : stated;
    const std::string grids = missing_grids(context, operation.get());
    if (!grids.empty() || !proj_coordoperation_is_instantiable(context, operation.get())) {
      if (missing.empty())
        missing = fmt::format("the best way ({}{}) needs {}, which is not in PROJ's folders on this computer",
                              name_of(operation.get()), accuracy >= 0 ? fmt::format(", {} m", accuracy) : std::string(),
                              grids.empty() ? "what PROJ cannot make" : grids);
      continue;
    }
    if (accuracy < 0 || accuracy > config.accuracy_m) {
      return Error{
          ErrorCode::Unsupported,
          fmt::format("is reached from {} with {} only ({}){}{}: name the right cloud.datum, install the grid, "
                      "or allow it by cloud.accuracy_m",
                      name_of(source),
                      accuracy < 0 ? std::string("an unknown error") : fmt::format("an error of {} m", accuracy),
                      name_of(operation.get()), missing.empty() ? "" : "; ", missing)};
    }
    to_map_.reset(proj_normalize_for_visualization(context, operation.get()));
    if (!to_map_) continue;
    words_ = fmt::format("from {} by \"{}\"", name_of(source), name_of(operation.get()));
    if (accuracy > 0) words_ += fmt::format(" ({} m)", accuracy);
    if (proj_degree_input(to_map_.get(), PJ_FWD) == 0 && proj_angular_input(to_map_.get(), PJ_FWD) != 0)
      return Error{ErrorCode::Invalid, "takes angles in radians, which is not expected"};
    if (const auto parameters = transverse_mercator_of(context, operation.get(), source)) {
      transverse_mercator_.emplace(*parameters);
      const std::array<double, 3> wanted = apply_proj(place);
      const auto [easting, northing] = transverse_mercator_->apply(place);
      // A CRS whose axes are not what they seem is left to PROJ.
      if (!(std::abs(easting - wanted[0] * unit_.metres) < kSameMap_m &&
            std::abs(northing - wanted[1] * unit_.metres) < kSameMap_m))
        transverse_mercator_.reset();
    }
    return {};
  }
  return Error{ErrorCode::Unsupported,
               fmt::format("cannot be reached from {}{}{}", name_of(source), missing.empty() ? "" : ": ", missing)};
}

std::array<double, 3> MapOperation::apply(const Geodetic& place) const {
  // With no step but the map itself, heights stay what they are.
  if (transverse_mercator_ && !to_geoid_) {
    const auto [easting, northing] = transverse_mercator_->apply(place);
    return {easting / unit_.metres, northing / unit_.metres, place.ellipsoidal_height};
  }
  return apply_proj(place);
}

std::array<double, 3> MapOperation::apply_proj(const Geodetic& place) const {
  PJ_COORD in = proj_coord(place.longitude * kDegPerRad, place.latitude * kDegPerRad, place.ellipsoidal_height,
                           epoch_ > 0 ? epoch_ : HUGE_VAL);
  const PJ_COORD out = proj_trans(to_map_.get(), PJ_FWD, in);
  double height = has_heights_ ? out.xyz.z : place.ellipsoidal_height;
  if (to_geoid_) {
    in.xyz.z = 0;
    height += proj_trans(to_geoid_.get(), PJ_FWD, in).xyz.z;
  }
  return {out.xyz.x, out.xyz.y, height};
}

}  // namespace hueline::storage
