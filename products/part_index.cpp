#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "core/utc_text.hpp"
#include "products/cloud_split.hpp"
#include "products/text_file.hpp"
#include "storage/proj_context.hpp"

namespace hueline::products {
namespace {

/// From a projected CRS to longitude and latitude on its own datum, deg.
class ToGeographic {
 public:
  explicit ToGeographic(const std::string& wkt) {
    const storage::ProjObject crs(proj_create(context_.get(), wkt.c_str()));
    if (!crs) return;
    const storage::ProjObject flat = storage::horizontal_part(context_.get(), crs.get());
    const PJ_TYPE type = flat ? proj_get_type(flat.get()) : PJ_TYPE_UNKNOWN;
    // Of a CRS of another kind, x and y are no places on a map: geocentric coordinates, or those of a building site.
    if (type != PJ_TYPE_PROJECTED_CRS && type != PJ_TYPE_GEOGRAPHIC_2D_CRS && type != PJ_TYPE_GEOGRAPHIC_3D_CRS &&
        type != PJ_TYPE_BOUND_CRS)
      return;
    const storage::ProjObject datum(flat ? proj_crs_get_geodetic_crs(context_.get(), flat.get()) : nullptr);
    if (!datum) return;
    const storage::ProjObject operation(
        proj_create_crs_to_crs_from_pj(context_.get(), flat.get(), datum.get(), nullptr, nullptr));
    if (operation) operation_.reset(proj_normalize_for_visualization(context_.get(), operation.get()));
  }
  Status database() const { return context_.database(); }
  explicit operator bool() const { return operation_ != nullptr; }
  std::array<double, 2> operator()(double x, double y) const {
    const PJ_COORD out = proj_trans(operation_.get(), PJ_FWD, proj_coord(x, y, 0, 0));
    return {out.v[0], out.v[1]};
  }

 private:
  storage::ProjContext context_;
  storage::ProjObject operation_;
};

}  // namespace

Result<bool> write_part_index(const std::filesystem::path& path, const std::vector<CloudPart>& parts,
                              const std::string& wkt) {
  auto file = TextFile::create(path);
  if (!file) return file.error();
  const ToGeographic to_geographic(wkt);
  if (Status database = to_geographic.database(); !database.ok()) return database.error();
  file->add("{\"type\":\"FeatureCollection\",\"features\":[");
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const CloudPart& part = parts[i];
    file->add(i == 0 ? "\n" : ",\n");
    file->add("{\"type\":\"Feature\",\"geometry\":");
    const auto& [low, high] = std::pair(part.minimum, part.maximum);
    if (to_geographic) {
      file->add("{\"type\":\"Polygon\",\"coordinates\":[[");
      const std::array<std::array<double, 2>, 5> corners{
          {{low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}, {low[0], low[1]}}};
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const auto [longitude, latitude] = to_geographic(corners[k][0], corners[k][1]);
        file->add(fmt::format("{}[{:.8f},{:.8f}]", k == 0 ? "" : ",", longitude, latitude));
      }
      file->add("]]}");
    } else {
      file->add("null");
    }
    file->add(fmt::format(
        ",\"properties\":{{\"file\":\"{}\",\"points\":{},\"bytes\":{},\"minimum\":[{:.3f},{:.3f},{:.3f}],\"maximum\":"
        "[{:.3f},{:.3f},{:.3f}]",
        part.file.string(), part.points, part.bytes, low[0], low[1], low[2], high[0], high[1], high[2]));
    if (part.strip > 0) file->add(fmt::format(",\"point_source_id\":{}", part.strip));
    if (part.first != GpsTime{})
      file->add(fmt::format(",\"first_utc\":\"{}\",\"last_utc\":\"{}\",\"first_gps_s\":{:.6f},\"last_gps_s\":{:.6f}",
                            utc_text(part.first), utc_text(part.last),
                            static_cast<double>(count_ns(part.first) / 1000) * 1e-6,
                            static_cast<double>(count_ns(part.last) / 1000) * 1e-6));
    file->add("}}");
  }
  file->add("\n]}\n");
  if (Status closed = file->close(); !closed.ok()) return closed.error();
  return static_cast<bool>(to_geographic);
}

}  // namespace hueline::products
