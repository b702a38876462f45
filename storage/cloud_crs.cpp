#include "storage/cloud_crs.hpp"

#include <cstdint>
#include <map>
#include <string>

#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

enum GeoKey : std::uint16_t {
  kModelType = 1024,
  kGeographicCrs = 2048,
  kProjectedCrs = 3072,
  kLinearUnit = 3076,
  kVerticalCrs = 4096
};
constexpr std::uint16_t kGeographic = 2, kMetre = 9001, kFoot = 9002, kSurveyFoot = 9003, kUserDefined = 32767;

/// The GeoTIFF keys whose values are in the directory itself.
class GeoKeys {
 public:
  explicit GeoKeys(const LasReader& cloud);
  /// Returns a value; 0 if the key is not there.
  std::uint16_t operator[](std::uint16_t key) const {
    const auto found = values_.find(key);
    return found == values_.end() ? std::uint16_t{0} : found->second;
  }
  /// Returns EPSG:number of the horizontal CRS; empty if the keys do not name one.
  std::string horizontal_crs() const {
    const std::uint16_t crs = (*this)[(*this)[kModelType] == kGeographic ? kGeographicCrs : kProjectedCrs];
    return crs == 0 || crs == kUserDefined ? std::string() : "EPSG:" + std::to_string(crs);
  }

 private:
  std::map<std::uint16_t, std::uint16_t> values_;
};

GeoKeys::GeoKeys(const LasReader& cloud) {
  for (const LasVlr& record : cloud.records()) {
    if (record.user_id != "LASF_Projection" || record.record_id != 34735) continue;
    ByteReader in(as_bytes(record.data));
    in.take_bytes(6);  // versions
    const auto count = in.take<std::uint16_t>();
    for (std::uint16_t i = 0; i < count && in.ok(); ++i) {
      const auto key = in.take<std::uint16_t>(), place = in.take<std::uint16_t>();
      in.take<std::uint16_t>();
      const auto value = in.take<std::uint16_t>();
      if (in.ok() && place == 0) values_[key] = value;
    }
  }
}

/// Returns the WKT of a CRS, in the form that LAS has; empty if PROJ does not know it.
Result<std::string> wkt_of(const std::string& definition) {
  const ProjContext context;
  const ProjObject crs(proj_create(context.get(), definition.c_str()));
  const char* const wkt = crs ? proj_as_wkt(context.get(), crs.get(), PJ_WKT1_GDAL, nullptr) : nullptr;
  std::string out = wkt ? wkt : "";
  if (Status database = context.database(); !database) return database.error();
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
  const GeoKeys keys(cloud);
  if (keys[kModelType] == kGeographic) return CrsUnit{1, true};
  switch (keys[kLinearUnit]) {
    case kMetre:
      return CrsUnit{};
    case kFoot:
      return CrsUnit{0.3048, false};
    case kSurveyFoot:
      return CrsUnit{1200.0 / 3937, false};
  }
  const std::string crs = keys.horizontal_crs();
  return crs.empty() ? Result<CrsUnit>(CrsUnit{}) : unit_of(crs);
}

Result<std::string> crs_wkt(const LasReader& cloud) {
  if (std::string wkt = cloud.wkt(); !wkt.empty()) return wkt;
  const GeoKeys keys(cloud);
  const std::string horizontal = keys.horizontal_crs();
  if (horizontal.empty()) return std::string();
  // The number of a vertical CRS is often one of the older list of GeoTIFF 1.0, which EPSG uses for other things.
  if (const std::uint16_t vertical = keys[kVerticalCrs]; vertical != 0 && vertical != kUserDefined) {
    Result<std::string> both = wkt_of(horizontal + "+" + std::to_string(vertical));
    if (!both || !both->empty()) return both;
  }
  return wkt_of(horizontal);
}

}  // namespace hueline::storage
