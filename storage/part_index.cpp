#include "storage/part_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "core/utc_text.hpp"
#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

using Place = std::array<double, 2>;  // longitude and latitude, deg
using Ring = std::vector<Place>;      // its last place is the first

/// Returns the part of a convex ring on one side of the meridian `at`, turned so that it lies between -180 and 180 deg.
Ring beside(const Ring& ring, double at, bool is_east, double turn) {
  Ring out;
  const auto is_in = [&](const Place& place) { return is_east ? place[0] >= at : place[0] <= at; };
  for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
    const auto &a = ring[i], &b = ring[i + 1];
    if (is_in(a)) out.push_back({a[0] + turn, a[1]});
    if (is_in(a) != is_in(b) && a[0] != at && b[0] != at)
      out.push_back({at + turn, a[1] + (b[1] - a[1]) * (at - a[0]) / (b[0] - a[0])});
  }
  if (!out.empty()) out.push_back(out.front());
  return out;
}

/// Cuts a ring at the date line (RFC 7946, 3.1.9), which viewers would otherwise draw around the Earth.
std::vector<Ring> cut_at_date_line(Ring ring) {
  double least = ring[0][0], most = least;
  for (Place& place : ring) {
    if (place[0] - ring[0][0] > 180) place[0] -= 360;
    if (place[0] - ring[0][0] < -180) place[0] += 360;
    least = std::min(least, place[0]);
    most = std::max(most, place[0]);
  }
  const double line = least < -180 ? -180 : 180;
  if (least >= -180 && most <= 180) return {std::move(ring)};
  std::vector<Ring> out;
  if (least < line) out.push_back(beside(ring, line, false, line < 0 ? 360 : 0));
  if (most > line) out.push_back(beside(ring, line, true, line < 0 ? 0 : -360));
  return out;
}

std::string text_of(const Ring& ring) {
  std::string out = "[[";
  for (const auto& [longitude, latitude] : ring)
    out += fmt::format("{}[{:.8f},{:.8f}]", out.size() > 2 ? "," : "", longitude, latitude);
  return out + "]]";
}

/// From a projected CRS to longitude (from Greenwich) and latitude on its own datum, deg.
class ToGeographic {
 public:
  explicit ToGeographic(const std::string& wkt) {
    const ProjObject crs(proj_create(context_.get(), wkt.c_str()));
    if (!crs) return;
    const ProjObject flat = horizontal_part(context_.get(), crs.get());
    const PJ_TYPE type = flat ? proj_get_type(flat.get()) : PJ_TYPE_UNKNOWN;
    // Of a CRS of another kind, x and y are no places on a map: geocentric coordinates, or those of a building site.
    if (type != PJ_TYPE_PROJECTED_CRS && type != PJ_TYPE_GEOGRAPHIC_2D_CRS && type != PJ_TYPE_GEOGRAPHIC_3D_CRS &&
        type != PJ_TYPE_BOUND_CRS)
      return;
    const ProjObject datum(flat ? proj_crs_get_geodetic_crs(context_.get(), flat.get()) : nullptr);
    if (!datum) return;
    const ProjObject operation(
        proj_create_crs_to_crs_from_pj(context_.get(), flat.get(), datum.get(), nullptr, nullptr));
    if (!operation) return;
    operation_.reset(proj_normalize_for_visualization(context_.get(), operation.get()));
    // Some count from another meridian than that of Greenwich, and in grads: the French ones from Paris.
    double unit = 0;
    const ProjObject axes(proj_crs_get_coordinate_system(context_.get(), datum.get()));
    if (axes && proj_cs_get_axis_info(context_.get(), axes.get(), 0, nullptr, nullptr, nullptr, &unit, nullptr, nullptr,
                                      nullptr) != 0)
      degrees_ = unit * kDegPerRad;
    double meridian = 0;
    const ProjObject prime(proj_get_prime_meridian(context_.get(), datum.get()));
    if (prime && proj_prime_meridian_get_parameters(context_.get(), prime.get(), &meridian, &unit, nullptr) != 0)
      meridian_ = meridian * unit * kDegPerRad;
  }
  Status database() const { return context_.database(); }
  explicit operator bool() const { return operation_ != nullptr; }
  Place operator()(double x, double y) const {
    const PJ_COORD out = proj_trans(operation_.get(), PJ_FWD, proj_coord(x, y, 0, 0));
    return {std::remainder(out.v[0] * degrees_ + meridian_, 360), out.v[1] * degrees_};
  }

 private:
  ProjContext context_;
  ProjObject operation_;
  double degrees_ = 1, meridian_ = 0;  // of a unit of the CRS's angles; east of Greenwich
};

}  // namespace

Result<std::size_t> write_part_index(const std::filesystem::path& path, const std::vector<CloudPart>& parts,
                                     const std::string& wkt) {
  const ToGeographic to_geographic(wkt);
  if (Status database = to_geographic.database(); !database.ok()) return database.error();
  std::string text = "{\"type\":\"FeatureCollection\",\"features\":[";
  std::size_t without = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const CloudPart& part = parts[i];
    text += i == 0 ? "\n" : ",\n";
    text += "{\"type\":\"Feature\",\"geometry\":";
    const auto& [low, high] = std::pair(part.minimum, part.maximum);
    Ring ring;
    if (to_geographic)
      for (const auto& [x, y] : std::array<std::array<double, 2>, 5>{
               {{low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}, {low[0], low[1]}}})
        ring.push_back(to_geographic(x, y));
    const auto is_place = [](const Place& place) { return std::isfinite(place[0]) && std::isfinite(place[1]); };
    if (!ring.empty() && std::ranges::all_of(ring, is_place)) {
      const std::vector<Ring> rings = cut_at_date_line(std::move(ring));
      if (rings.size() == 1)
        text += fmt::format("{{\"type\":\"Polygon\",\"coordinates\":{}}}", text_of(rings[0]));
      else
        text +=
            fmt::format("{{\"type\":\"MultiPolygon\",\"coordinates\":[{},{}]}}", text_of(rings[0]), text_of(rings[1]));
    } else {
      ++without;
      text += "null";
    }
    text += fmt::format(
        ",\"properties\":{{\"file\":\"{}\",\"points\":{},\"bytes\":{},\"minimum\":[{:.3f},{:.3f},{:.3f}],\"maximum\":"
        "[{:.3f},{:.3f},{:.3f}]",
        part.file.string(), part.points, part.bytes, low[0], low[1], low[2], high[0], high[1], high[2]);
    if (part.strip > 0) text += fmt::format(",\"point_source_id\":{}", part.strip);
    if (part.first != GpsTime{})
      text += fmt::format(",\"first_utc\":\"{}\",\"last_utc\":\"{}\",\"first_gps_s\":{:.6f},\"last_gps_s\":{:.6f}",
                          utc_text(part.first), utc_text(part.last),
                          static_cast<double>(count_ns(part.first) / 1000) * 1e-6,
                          static_cast<double>(count_ns(part.last) / 1000) * 1e-6);
    text += "}}";
  }
  text += "\n]}\n";
  if (Status written = write_output(path, text); !written.ok()) return written.error();
  return without;
}

}  // namespace hueline::storage
