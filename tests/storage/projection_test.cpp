#include "storage/projection.hpp"

#include <gtest/gtest.h>
#include <proj.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

namespace hueline::storage {
namespace {

constexpr double kRad = std::numbers::pi / 180;

struct Place {
  const char* name;
  double latitude, longitude, height;
  const char* crs;
  const char* expected;
  const char* datum = "";
  double accuracy_m = 0.1;
};
const Place kPlaces[] = {{"Munich", 48.137, 11.575, 560, "utm", "EPSG:32632"},
                         {"Bergen", 60.39, 5.32, 40, "utm", "EPSG:32632"},
                         {"Sydney", -33.86, 151.21, 30, "utm", "EPSG:32756"},
                         {"Wuhan", 30.53, 114.36, 25, "EPSG:4547", "EPSG:4547"},
                         {"Berlin", 52.52, 13.40, 35, "EPSG:25833", "EPSG:25833"},
                         {"Paris Lambert", 48.85, 2.35, 35, "EPSG:2154", "EPSG:2154"},
                         {"Zuerich Swiss", 47.37, 8.54, 450, "EPSG:2056", "EPSG:2056", "EPSG:4937"},
                         {"London OSGB", 51.5, -0.12, 20, "EPSG:27700", "EPSG:27700", "EPSG:4979", 3},
                         {"Quito", -0.18, -78.47, 2850, "utm", "EPSG:32717"},
                         {"Web Mercator", 40.4, -3.7, 650, "EPSG:3857", "EPSG:3857"},
                         {"Fiji at the edge", -17.0, 179.999, 5, "utm", "EPSG:32760"}};

TEST(Projection, IsWithinATenthOfAMillimetreOfProj) {
  std::mt19937_64 random(7);
  for (const Place& place : kPlaces) {
    auto projection = Projection::create({place.latitude * kRad, place.longitude * kRad, place.height},
                                         {.crs = place.crs, .datum = place.datum, .accuracy_m = place.accuracy_m});
    ASSERT_TRUE(projection) << place.name << ": " << projection.error().message;
    EXPECT_EQ(projection->operation().crs(), place.expected) << place.name;
    double worst = 0;
    for (const double reach : {50.0, 2'000.0, 40'000.0}) {
      std::uniform_real_distribution<double> along(-reach, reach), up(-60, 250);
      for (int i = 0; i < 300; ++i) {
        const double e = along(random), n = along(random), u = up(random);
        worst = std::max(worst, (projection->project(e, n, u) - projection->project_exactly(e, n, u)).norm());
      }
    }
    EXPECT_LT(worst, 1e-4) << place.name;
    std::printf("%-18s %-10s worst %.2e m, %s\n", place.name, place.crs, worst,
                projection->operation().words().c_str());
  }
}

TEST(Projection, FindsAKnownPoint) {
  // A known point of UTM: on the central meridian of zone 32 (9 E) at the equator, easting is 500 000 m and northing is
  // 0.
  auto peg = Projection::create({0.0, 9 * kRad, 0}, {.crs = "EPSG:32632"});
  ASSERT_TRUE(peg) << peg.error().message;
  EXPECT_LT((peg->project(0, 0, 0) - Eigen::Vector3d(500'000, 0, 0)).norm(), 1e-6);
  // 1 km east of it is 0.9996 km on the map (k0), up to the curvature over that distance. The height is that above the
  // ellipsoid.
  const Eigen::Vector3d p = peg->project(1000, 0, 0);
  EXPECT_NEAR(p.x(), 500'999.6, 1e-3);
  EXPECT_NEAR(p.z(), 1000.0 * 1000.0 / (2 * 6'378'137.0), 1e-4);
}

TEST(Projection, DoesNotDependOnWhatWasAskedBefore) {
  const Geodetic origin{48 * kRad, 11 * kRad, 500};
  auto once = Projection::create(origin), often = Projection::create(origin);
  for (int i = 0; i < 100; ++i) (void)often->project(i * 97.0, i * -31.0, i % 7);
  EXPECT_EQ(once->project(1234.5, -678.9, 10.1), often->project(1234.5, -678.9, 10.1));
}

TEST(Projection, IsContinuousWhereCubesMeet) {
  auto projection = Projection::create({48 * kRad, 11 * kRad, 500});
  for (const double edge : {-512.0, 0.0, 256.0, 5120.0}) {
    const Eigen::Vector3d below = projection->project(edge - 1e-7, 10, 1),
                          above = projection->project(edge + 1e-7, 10, 1);
    EXPECT_LT((below - above).norm(), 1e-5) << edge;
  }
}

TEST(Projection, RefusesAWrongCodeWithItsReason) {
  const Geodetic munich{48.137 * kRad, 11.575 * kRad, 560};
  // A map of another place is not wrong, but of no use for this drive.
  struct Wrong {
    const char *crs, *reason;
    ErrorCode code = ErrorCode::Invalid;
  };
  for (const auto& [crs, reason, code] : {Wrong{"EPSG:99999", "not known"}, Wrong{"EPSG:4326", "not a projected CRS"},
                                          Wrong{"EPSG:2314", "only metres, feet and US survey feet"},
                                          Wrong{"EPSG:32756", "the drive is at", ErrorCode::Unsupported},
                                          Wrong{"EPSG:31468", "in which no GNSS service gives positions"}}) {
    const auto projection = Projection::create(munich, {.crs = crs});
    ASSERT_FALSE(projection) << crs;
    EXPECT_EQ(projection.error().code, code) << crs;
    EXPECT_NE(projection.error().message.find(reason), std::string::npos) << projection.error().message;
    EXPECT_NE(projection.error().message.find(crs), std::string::npos) << projection.error().message;
  }
  EXPECT_FALSE(Projection::create({NAN, 0, 0}));
}

TEST(Projection, GivesNoPlaceForNoNumber) {
  auto projection = Projection::create({48 * kRad, 11 * kRad, 500});
  for (const double bad : {double(NAN), double(INFINITY), 1e9})
    EXPECT_FALSE(projection->project(bad, 0, 0).allFinite());
}

TEST(Projection, WritesWktThatProjReadsAsTheSameCrsWithEllipsoidalHeight) {
  auto projection = Projection::create({48.137 * kRad, 11.575 * kRad, 560});
  PJ* crs = proj_create(nullptr, projection->operation().wkt().c_str());
  ASSERT_NE(crs, nullptr) << projection->operation().wkt();
  // PROJ takes the pair as one CRS with three axes, or as a compound CRS. Both must give the same positions.
  PJ* from = proj_create(nullptr, "EPSG:4979");
  PJ* stated = proj_create_crs_to_crs_from_pj(nullptr, from, crs, nullptr, nullptr);
  ASSERT_NE(stated, nullptr);
  PJ* to_map = proj_normalize_for_visualization(nullptr, stated);
  const PJ_COORD out = proj_trans(to_map, PJ_FWD, proj_coord(11.575, 48.137, 560, HUGE_VAL));
  const Eigen::Vector3d ours = projection->project(0, 0, 0);
  EXPECT_NEAR(out.xyz.x, ours.x(), 1e-4);
  EXPECT_NEAR(out.xyz.y, ours.y(), 1e-4);
  EXPECT_NEAR(out.xyz.z, ours.z(), 1e-4);
  for (PJ* p : {crs, from, stated, to_map}) proj_destroy(p);
}

TEST(UtmEpsg, KnowsTheExceptions) {
  const auto at = [](double lat, double lon) { return utm_epsg({lat * kRad, lon * kRad, 0}); };
  EXPECT_EQ(at(51, 0.5), 32631);
  EXPECT_EQ(at(-1, -179.9), 32701);
  EXPECT_EQ(at(60, 4), 32632);
  EXPECT_EQ(at(78, 15), 32633);
  EXPECT_EQ(at(78, 8), 32631);
  EXPECT_EQ(at(10, 180), 32601);
  EXPECT_EQ(at(-17, -180 - 1e-12), 32760);
  EXPECT_EQ(at(-17, 180 + 1e-12), 32701);
  EXPECT_EQ(at(83.9, 100), 32647);
  EXPECT_EQ(at(84, 100), 5041) << "UTM ends there";
  EXPECT_EQ(at(-80, 20), 32734);
  EXPECT_EQ(at(-90, 20), 5042);
}

}  // namespace
}  // namespace hueline::storage
