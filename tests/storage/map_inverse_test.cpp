#include "storage/map_inverse.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/angle.hpp"
#include "storage/proj_context.hpp"

namespace hueline::storage {
namespace {

using testing::HasSubstr;

/// What PROJ says of the meridian convergence at a place: rad, clockwise from true to map north.
double convergence_of(const std::string& crs, const Geodetic& at) {
  const ProjContext context;
  const ProjObject whole(proj_create(context.get(), crs.c_str()));
  const ProjObject map = horizontal_part(context.get(), whole.get());
  return proj_factors(map.get(), proj_coord(at.longitude, at.latitude, 0, 0)).meridian_convergence;
}

struct MapCase {
  const char* crs;
  double latitude_deg, longitude_deg, height_m = 100;
};

TEST(MapInverse, FindsThePlacesOfCoordinates) {
  // Zones of both hemispheres, one at the equator and one at the antimeridian, cones, an oblique cylinder, and heights
  // above a geoid.
  const std::vector<MapCase> places{
      {"EPSG:32632", 50, 11.9},    {"EPSG:32734", -33.9, 18.4, 20}, {"EPSG:32648", 1.3, 103.8},
      {"EPSG:32760", -17, 179.99}, {"EPSG:25832", 47.5, 6.1},       {"EPSG:2154", 43.6, 3.9},
      {"EPSG:2056", 46.5, 6.6},    {"EPSG:3857", 48, 11},           {"EPSG:32613+5773", 40, -105.2}};
  for (const auto& [crs, latitude, longitude, height] : places) {
    const Geodetic first{latitude * kRadPerDeg, longitude * kRadPerDeg, height};
    // 20 km farther, and of the one at the antimeridian on the other side of it.
    const Geodetic at{(latitude + 0.13) * kRadPerDeg, (longitude + 0.13 - (longitude > 179 ? 360 : 0)) * kRadPerDeg,
                      height + 30};
    const MapConfig config{.crs = crs, .datum = std::string(crs) == "EPSG:2056" ? "EPSG:4937" : "", .accuracy_m = 1};
    const auto map = MapOperation::create(first, config, 0);
    ASSERT_TRUE(map.ok()) << map.error().message;
    const auto back = MapInverse::create(map->apply(first), config);
    ASSERT_TRUE(back.ok()) << crs << ": " << back.error().message;
    const auto found = back->apply(map->apply(at));
    ASSERT_TRUE(found) << crs;
    constexpr double kOneMicrometre = 1e-6 / 6.4e6;
    EXPECT_NEAR(found->place.latitude, at.latitude, kOneMicrometre) << crs;
    EXPECT_NEAR(found->place.longitude, at.longitude, kOneMicrometre) << crs;
    EXPECT_NEAR(found->place.ellipsoidal_height, at.ellipsoidal_height, 1e-6) << crs;
    // North of another datum, as PROJ takes it, differs by less than 1e-7 rad.
    EXPECT_NEAR(found->heading_of_map_north, convergence_of(crs, at), config.datum.empty() ? 1e-9 : 1e-7) << crs;
  }
}

TEST(MapInverse, MapNorthLeansToTheEastInTheEastOfAZone) {
  // 2.9 deg east of the central meridian: 2.9 deg times the sine of the latitude.
  const Geodetic at{50 * kRadPerDeg, 11.9 * kRadPerDeg, 0};
  const auto back = MapInverse::create(at, {.crs = "EPSG:32632"});
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_NEAR(back->apply(back->map().apply(at))->heading_of_map_north * kDegPerRad, 2.2226, 1e-3);
}

TEST(MapInverse, RefusesWhatIsNoPlaceOfTheMap) {
  const auto refused = [](const std::array<double, 3>& position, const std::string& crs) {
    const auto made = MapInverse::create(position, {.crs = crs});
    return made.ok() ? std::string("not refused") : made.error().message;
  };
  EXPECT_THAT(refused({500'000, 5'500'000, 100}, "EPSG:999999"), HasSubstr("not known to PROJ"));
  EXPECT_THAT(refused({9.1, 48.7, 100}, "EPSG:4326"), HasSubstr("not a projected CRS"));
  EXPECT_THAT(refused({500'000, 5'500'000, 100}, "EPSG:2056"), HasSubstr("is for"));
  EXPECT_THAT(refused({500'000, 5'500'000, NAN}, "EPSG:32632"), HasSubstr("has no place"));
  EXPECT_THAT(refused({1e12, 1e12, 100}, "EPSG:32632"), HasSubstr("has no place"));
  const auto back = MapInverse::create(std::array<double, 3>{500'000, 5'500'000, 100}, {.crs = "EPSG:32632"});
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_FALSE(back->apply({NAN, 0, 0}));
  EXPECT_FALSE(back->apply({1e12, 1e12, 0}));
}

}  // namespace
}  // namespace hueline::storage
