#include "storage/crs_unit.hpp"

#include <cstdint>
#include <map>
#include <string>

#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

enum GeoKey : std::uint16_t { kModelType = 1024, kProjectedCrs = 3072, kLinearUnit = 3076 };
constexpr std::uint16_t kGeographic = 2, kMetre = 9001, kFoot = 9002, kSurveyFoot = 9003, kUserDefined = 32767;

/// Returns the GeoTIFF keys whose values are in the directory itself.
std::map<std::uint16_t, std::uint16_t> geo_keys(const LasReader& cloud) {
  std::map<std::uint16_t, std::uint16_t> out;
  for (const LasVlr& record : cloud.records()) {
    if (record.user_id != "LASF_Projection" || record.record_id != 34735) continue;
    ByteReader in(as_bytes(record.data));
    in.take_bytes(6);  // versions
    const auto count = in.take<std::uint16_t>();
    for (std::uint16_t i = 0; i < count && in.ok(); ++i) {
      const auto key = in.take<std::uint16_t>(), place = in.take<std::uint16_t>();
      in.take<std::uint16_t>();
      const auto value = in.take<std::uint16_t>();
      if (in.ok() && place == 0) out[key] = value;
    }
  }
  return out;
}

/// Returns the unit of a CRS, as WKT or as EPSG:number.
Result<CrsUnit> unit_of(const std::string& definition) {
  const ProjContext context;
  const ProjObject crs(proj_create(context.get(), definition.c_str()));
  ProjObject flat = horizontal_part(context.get(), crs.get());
  if (flat && proj_get_type(flat.get()) == PJ_TYPE_BOUND_CRS)
    flat.reset(proj_get_source_crs(context.get(), flat.get()));
  CrsUnit out;
  const ProjObject axes(flat ? proj_crs_get_coordinate_system(context.get(), flat.get()) : nullptr);
  if (axes) {
    const PJ_TYPE type = proj_get_type(flat.get());
    out.is_angle = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
    double factor = 0;
    if (!out.is_angle &&
        proj_cs_get_axis_info(context.get(), axes.get(), 0, nullptr, nullptr, nullptr, &factor, nullptr, nullptr,
                              nullptr) != 0 &&
        factor > 0)
      out.metres = factor;
  }
  if (Status database = context.database(); !database) return database.error();
  return out;
}

}  // namespace

Result<CrsUnit> crs_unit(const LasReader& cloud) {
  if (const std::string wkt = cloud.wkt(); !wkt.empty()) return unit_of(wkt);
  const auto keys = geo_keys(cloud);
  const auto value = [&](std::uint16_t key) {
    const auto found = keys.find(key);
    return found == keys.end() ? std::uint16_t{0} : found->second;
  };
  if (value(kModelType) == kGeographic) return CrsUnit{1, true};
  switch (value(kLinearUnit)) {
    case kMetre:
      return CrsUnit{};
    case kFoot:
      return CrsUnit{0.3048, false};
    case kSurveyFoot:
      return CrsUnit{1200.0 / 3937, false};
  }
  const std::uint16_t projected = value(kProjectedCrs);
  if (projected == 0 || projected == kUserDefined) return CrsUnit{};
  return unit_of("EPSG:" + std::to_string(projected));
}

}  // namespace hueline::storage
