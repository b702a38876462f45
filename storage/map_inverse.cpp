#include "storage/map_inverse.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

/// Returns about where a position of the map lies, by PROJ's own inverse and on the map's datum; not finite if the map
/// has no such place. Nothing if `crs` is not a map.
std::optional<Geodetic> rough_place(const std::array<double, 3>& position, const std::string& crs) {
  const ProjContext context;
  const ProjObject whole(proj_create(context.get(), crs.c_str()));
  const ProjObject map = horizontal_part(context.get(), whole.get());
  const ProjObject geographic(map ? proj_crs_get_geodetic_crs(context.get(), map.get()) : nullptr);
  if (!geographic) return {};
  const ProjObject there(proj_create_crs_to_crs_from_pj(context.get(), map.get(), geographic.get(), nullptr, nullptr));
  const ProjObject degrees(there ? proj_normalize_for_visualization(context.get(), there.get()) : nullptr);
  if (!degrees) return {};
  const PJ_COORD found = proj_trans(degrees.get(), PJ_FWD, proj_coord(position[0], position[1], 0, HUGE_VAL));
  return Geodetic{found.xy.y * kRadPerDeg, found.xy.x * kRadPerDeg, position[2]};
}

/// How the coordinates of a map change with latitude and longitude, m/rad.
struct MapSlope {
  double east_by_latitude, north_by_latitude, east_by_longitude, north_by_longitude;
};
MapSlope slope_at(const MapOperation& map, const Geodetic& place) {
  constexpr double kStep = 1e-5;  // rad: 64 m, over which the third derivatives count for 1e-11 of the slope
  Geodetic south = place, north = place, west = place, east = place;
  south.latitude -= kStep, north.latitude += kStep, west.longitude -= kStep, east.longitude += kStep;
  const auto s = map.apply(south), n = map.apply(north), w = map.apply(west), e = map.apply(east);
  return {(n[0] - s[0]) / (2 * kStep), (n[1] - s[1]) / (2 * kStep), (e[0] - w[0]) / (2 * kStep),
          (e[1] - w[1]) / (2 * kStep)};
}

}  // namespace

Result<MapInverse> MapInverse::create(const std::array<double, 3>& position, const MapConfig& config) {
  const Error none{ErrorCode::Invalid, fmt::format("{} has no place with the coordinates {:.1f}, {:.1f}, height {:.1f}",
                                                   config.crs, position[0], position[1], position[2])};
  // What is wrong with what is no map is said by MapOperation.
  const Geodetic near = rough_place(position, config.crs).value_or(Geodetic{});
  if (!is_on_earth(near)) return none;
  auto out = create(near, config);
  if (out.ok() && !out->apply(position)) return none;
  return out;
}

Result<MapInverse> MapInverse::create(const Geodetic& near, const MapConfig& config) {
  auto map = MapOperation::create(near, config, 0);
  if (!map.ok()) return map.error();
  return MapInverse(near, std::move(*map));
}

std::optional<MapPlace> MapInverse::apply(const std::array<double, 3>& position) const {
  constexpr int kMostSteps = 30;
  constexpr double kClose_m = 1e-7, kHalfTurn = std::numbers::pi;
  Geodetic place = near_;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto at = map_.apply(place);
    const double east = position[0] - at[0], north = position[1] - at[1], up = position[2] - at[2];
    const MapSlope slope = slope_at(map_, place);
    if (std::abs(east) < kClose_m && std::abs(north) < kClose_m && std::abs(up) < kClose_m) {
      if (std::abs(place.longitude) > kHalfTurn) place.longitude -= std::copysign(2 * kHalfTurn, place.longitude);
      return MapPlace{place, portable::atan2(-slope.east_by_latitude, slope.north_by_latitude)};
    }
    const double scale =
        slope.east_by_longitude * slope.north_by_latitude - slope.east_by_latitude * slope.north_by_longitude;
    place.latitude += (slope.east_by_longitude * north - slope.north_by_longitude * east) / scale;
    place.longitude += (slope.north_by_latitude * east - slope.east_by_latitude * north) / scale;
    place.ellipsoidal_height += up;
    // A drive may cross the antimeridian.
    if (!(std::abs(place.latitude) < kHalfTurn / 2) || !(std::abs(place.longitude) < 2 * kHalfTurn)) return {};
  }
  return {};
}

}  // namespace hueline::storage
