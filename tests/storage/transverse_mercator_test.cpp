#include "storage/transverse_mercator.hpp"

#include <gtest/gtest.h>
#include <proj.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numbers>
#include <random>

#include <fmt/format.h>

namespace hueline::storage {
namespace {

constexpr double kRad = std::numbers::pi / 180;

struct Map {
  const char* name;
  TransverseMercator::Parameters parameters;
  const char* ellipsoid;
};

constexpr double kBessel = 6377397.155, kBesselFlattening = 1 / 299.1528128, kGrs80Flattening = 1 / 298.257222101;
const Map kMaps[] = {
    {"UTM 32 north", {.longitude = 9 * kRad}, "WGS84"},
    {"UTM 56 south", {.longitude = 153 * kRad, .northing_m = 1e7}, "WGS84"},
    {"Gauss-Kruger 3", {kBessel, kBesselFlattening, 0, 9 * kRad, 1, 3.5e6, 0}, "bessel"},
    {"Poland 1992", {6378137, kGrs80Flattening, 0, 19 * kRad, 0.9993, 5e5, -5.3e6}, "GRS80"},
    {"New Zealand 2000", {6378137, kGrs80Flattening, 0, 173 * kRad, 0.9996, 1.6e6, 1e7}, "GRS80"},
    {"an origin of its own", {6378137, kGrs80Flattening, 49 * kRad, -2 * kRad, 0.9996012717, 4e5, -1e5}, "GRS80"},
};

TEST(TransverseMercator, IsWithinTenNanometresOfProj) {
  const std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)> context(proj_context_create(),
                                                                             &proj_context_destroy);
  std::mt19937_64 random(5);
  for (const Map& map : kMaps) {
    const auto& p = map.parameters;
    const std::string text =
        fmt::format("+proj=tmerc +lat_0={} +lon_0={} +k={} +x_0={} +y_0={} +ellps={}", p.latitude / kRad,
                    p.longitude / kRad, p.scale, p.easting_m, p.northing_m, map.ellipsoid);
    const std::unique_ptr<PJ, decltype(&proj_destroy)> proj(proj_create(context.get(), text.c_str()), &proj_destroy);
    ASSERT_TRUE(proj) << text;
    const TransverseMercator ours(p);
    double worst = 0;
    for (const double reach : {0.001, 3.0, 15.0}) {
      std::uniform_real_distribution<double> beside(-reach, reach), latitude(-84, 84);
      for (int i = 0; i < 3000; ++i) {
        const Geodetic place{latitude(random) * kRad, p.longitude + beside(random) * kRad, 0};
        const PJ_COORD wanted = proj_trans(proj.get(), PJ_FWD, proj_coord(place.longitude, place.latitude, 0, 0));
        const auto [easting, northing] = ours.apply(place);
        worst = std::max(worst, std::hypot(easting - wanted.xy.x, northing - wanted.xy.y));
      }
    }
    EXPECT_LT(worst, 1e-8) << map.name;
    std::printf("%-22s worst %.1e m\n", map.name, worst);
  }
}

TEST(TransverseMercator, KnowsTheEquatorAndTheMeridian) {
  const TransverseMercator map(TransverseMercator::Parameters{.longitude = 9 * kRad});
  const auto [easting, northing] = map.apply({0, 9 * kRad, 0});
  EXPECT_EQ(easting, 500000);
  EXPECT_EQ(northing, 0);
  const auto east = map.apply({0.8, 9.5 * kRad, 0}), west = map.apply({0.8, 8.5 * kRad, 0});
  EXPECT_EQ(east[0] - 500000, 500000 - west[0]);
  EXPECT_EQ(east[1], west[1]);
  EXPECT_TRUE(std::isnan(map.apply({std::nan(""), 0, 0})[0]));
}

// The bits that every machine must give; written down once, by one of them.
TEST(TransverseMercator, GivesTheSameBitsEverywhere) {
  const TransverseMercator map(TransverseMercator::Parameters{.longitude = 9 * kRad});
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (int i = 0; i < 5000; ++i)
    for (const double value : map.apply({i * 0.0003, (9 + (i % 61 - 30) * 0.1) * kRad, 0})) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 0x100000001b3ull;
    }
  EXPECT_EQ(hash, 3356566819583904962u);
}

}  // namespace
}  // namespace hueline::storage
