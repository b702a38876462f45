#include "storage/cloud_crs.hpp"

#include <proj_experimental.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "storage/geotiff_keys.hpp"
#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint16_t kMetre = 9001;

/// Returns the WKT of a CRS, in the form that LAS has, on one line; empty for null and if it has none. A CRS with
/// heights above its ellipsoid becomes a compound one.
std::string las_wkt(PJ_CONTEXT* context, const PJ* crs) {
  constexpr const char* kForm[] = {"MULTILINE=NO", "ALLOW_ELLIPSOIDAL_HEIGHT_AS_VERTICAL_CRS=YES", nullptr};
  const char* const wkt = crs ? proj_as_wkt(context, crs, PJ_WKT1_GDAL, kForm) : nullptr;
  return wkt ? wkt : "";
}

/// Returns the WKT of a CRS that PROJ finds by its definition; empty if it does not know it.
Result<std::string> wkt_of(const std::string& definition) {
  const ProjContext context;
  const ProjObject crs(proj_create(context.get(), definition.c_str()));
  std::string out = las_wkt(context.get(), crs.get());
  if (Status database = context.database(); !database) return database.error();
  return out;
}

/// Returns how many metres a step along an axis of a CRS is; nothing if it has no such axis.
std::optional<double> metres_along(PJ_CONTEXT* context, const PJ* crs, int axis) {
  const ProjObject axes(crs ? proj_crs_get_coordinate_system(context, crs) : nullptr);
  double factor = 0;
  if (!axes || proj_cs_get_axis_count(context, axes.get()) <= axis ||
      proj_cs_get_axis_info(context, axes.get(), axis, nullptr, nullptr, nullptr, &factor, nullptr, nullptr, nullptr) ==
          0 ||
      factor <= 0)
    return {};
  return factor;
}

/// Returns a CRS, or the one within if it has a way to WGS 84 with it (TOWGS84).
ProjObject without_way(PJ_CONTEXT* context, ProjObject crs) {
  if (crs && proj_get_type(crs.get()) == PJ_TYPE_BOUND_CRS) crs.reset(proj_get_source_crs(context, crs.get()));
  return crs;
}

/// Returns the vertical part of a compound CRS; null for any other.
ProjObject vertical_part(PJ_CONTEXT* context, const PJ* crs) {
  return crs && proj_get_type(crs) == PJ_TYPE_COMPOUND_CRS
             ? without_way(context, ProjObject(proj_crs_get_sub_crs(context, crs, 1)))
             : nullptr;
}

/// Returns the unit of a CRS, as WKT or as EPSG:number.
Result<CrsUnit> unit_of(const std::string& definition) {
  const ProjContext context;
  const ProjObject crs(proj_create(context.get(), definition.c_str()));
  const ProjObject flat = without_way(context.get(), horizontal_part(context.get(), crs.get()));
  CrsUnit out;
  if (flat) {
    const PJ_TYPE type = proj_get_type(flat.get());
    out.is_angle = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
    if (!out.is_angle) out.metres = metres_along(context.get(), flat.get(), 0).value_or(1);
  }
  if (Status database = context.database(); !database) return database.error();
  return out;
}

/// Returns a CRS that is the same but counts in metres; null if there is none.
ProjObject in_metres(PJ_CONTEXT* context, const PJ* crs) {
  const ProjObject out(
      crs ? proj_crs_alter_cs_linear_unit(context, crs, "metre", 1, "EPSG", std::to_string(kMetre).c_str()) : nullptr);
  // The name says feet as a rule.
  return ProjObject(out ? proj_alter_name(context, out.get(), (proj_get_name(crs) + std::string(" in metres")).c_str())
                        : nullptr);
}

}  // namespace

Result<CrsUnit> crs_unit(const LasReader& cloud) {
  if (const std::string wkt = cloud.wkt(); !wkt.empty()) return crs_unit(wkt);
  const GeoKeys keys(cloud);
  if (keys.is_geographic()) return CrsUnit{1, true};
  if (const std::optional<double> metres = metres_of_unit(keys[GeoKey::LinearUnit])) return CrsUnit{*metres, false};
  const std::string crs = keys.horizontal_crs();
  return crs.empty() ? Result<CrsUnit>(CrsUnit{}) : unit_of(crs);
}

Result<std::string> crs_wkt(const LasReader& cloud) {
  if (std::string wkt = cloud.wkt(); !wkt.empty()) return wkt;
  const GeoKeys keys(cloud);
  const std::string horizontal = keys.horizontal_crs();
  const std::uint16_t vertical = keys[GeoKey::VerticalCrs];
  const bool has_vertical = vertical != 0 && vertical != kGeoUserDefined;
  if (horizontal.empty()) {
    Result<std::string> own = keys.own_projection();
    if (own.ok() && !own->empty()) own = wkt_of(*own);
    if (!own.ok() || own->empty() || !has_vertical) return own;
    const Result<std::string> up = wkt_of("EPSG:" + std::to_string(vertical));
    if (!up.ok()) return up;
    return up->starts_with("VERT_CS[") ? "COMPD_CS[\"unnamed\"," + *own + "," + *up + "]" : *own;
  }
  // The number of a vertical CRS is often one of the older list of GeoTIFF 1.0, which EPSG uses for other things.
  if (has_vertical) {
    Result<std::string> both = wkt_of(horizontal + "+" + std::to_string(vertical));
    if (!both || !both->empty()) return both;
  }
  return wkt_of(horizontal);
}

Result<bool> has_unread_crs(const LasReader& cloud) {
  const GeoKeys keys(cloud);
  if (!keys.has_own_projection()) return false;
  const Result<std::string> wkt = crs_wkt(cloud);
  if (!wkt.ok()) return wkt.error();
  return wkt->empty();
}

Result<CrsUnit> crs_unit(const std::string& wkt) { return unit_of(wkt); }

Result<CrsInMetres> crs_in_metres(const LasReader& cloud) {
  const Result<CrsUnit> unit = crs_unit(cloud);
  if (!unit) return unit.error();
  if (unit->is_angle)
    return Error{ErrorCode::Invalid, "its coordinates are longitude and latitude, which are not lengths"};
  Result<std::string> wkt = crs_wkt(cloud);
  if (!wkt) return wkt.error();
  const ProjContext context;
  const ProjObject crs(wkt->empty() ? nullptr : proj_create(context.get(), wkt->c_str()));
  const ProjObject flat = without_way(context.get(), horizontal_part(context.get(), crs.get()));
  const ProjObject up = vertical_part(context.get(), crs.get());
  CrsInMetres out{unit->metres, unit->metres, {}};
  if (const auto metres = metres_of_unit(cloud.wkt().empty() ? GeoKeys(cloud)[GeoKey::VerticalUnit] : std::uint16_t{0}))
    out.up_metres = *metres;
  else if (const auto along =
               up ? metres_along(context.get(), up.get(), 0) : metres_along(context.get(), flat.get(), 2))
    out.up_metres = *along;
  if (out.metres == 1 && out.up_metres == 1) {
    out.wkt = *std::move(wkt);
  } else if (ProjObject metric = in_metres(context.get(), flat.get())) {
    if (const ProjObject metric_up = in_metres(context.get(), up.get()))
      metric.reset(proj_create_compound_crs(
          context.get(), (proj_get_name(metric.get()) + std::string(" + ") + proj_get_name(metric_up.get())).c_str(),
          metric.get(), metric_up.get()));
    out.wkt = las_wkt(context.get(), metric.get());
  }
  if (Status database = context.database(); !database) return database.error();
  return out;
}

}  // namespace hueline::storage
