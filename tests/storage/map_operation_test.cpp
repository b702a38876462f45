// Maps with datums, epochs and heights, against cs2cs, PROJ's own program, and against published check points.
#include "storage/map_operation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/angle.hpp"
#include "storage/proj_context.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using testing::HasSubstr;

Geodetic place(double latitude_deg, double longitude_deg, double height = 100) {
  return {latitude_deg * kRadPerDeg, longitude_deg * kRadPerDeg, height};
}

/// Returns what cs2cs says of a place: three numbers in the order of the target's axes.
std::array<double, 3> cs2cs(const std::string& options, const std::string& from, const std::string& to,
                            const Geodetic& at, double epoch) {
  char command[512];
  std::snprintf(command, sizeof command, "echo '%.12f %.12f %.6f %.6f' | PROJ_NETWORK=OFF cs2cs -f %%.6f %s %s %s",
                at.latitude * kDegPerRad, at.longitude * kDegPerRad, at.ellipsoidal_height, epoch, options.c_str(),
                from.c_str(), to.c_str());
  std::array<double, 3> out{NAN, NAN, NAN};
  if (std::FILE* pipe = ::popen(command, "r")) {
    if (std::fscanf(pipe, "%lf %lf %lf", &out[0], &out[1], &out[2]) != 3) out[0] = NAN;
    ::pclose(pipe);
  }
  return out;
}

struct Case {
  const char* country;
  Geodetic at;
  MapConfig map;
  const char* source;        // of cs2cs
  bool north_first = false;  // the target's axes are northing, easting
  bool keeps_height = false;
  const char* options = "";
};

TEST(MapOperation, MeetsCs2csWithinAMillimetre) {
  // The grids are those of Debian's proj-data.
  const std::vector<Case> cases{
      {"Germany, DHDN by the grid BETA2007",
       place(50.11, 8.68),
       {.crs = "EPSG:31467", .datum = "EPSG:4937", .accuracy_m = 1},
       "EPSG:4937",
       true,
       true},
      {"France, NTF by the grid ntf_r93",
       place(47.2, 2.1),
       {.crs = "EPSG:27572", .datum = "EPSG:4965", .accuracy_m = 1},
       "EPSG:4965",
       false,
       true},
      {"Switzerland, LV95", place(46.95, 7.44), {.crs = "EPSG:2056", .datum = "EPSG:4937"}, "EPSG:4937", false, true},
      {"New Zealand, NZGD49 by the grid nzgd2kgrid0005",
       place(-41.3, 174.8),
       {.crs = "EPSG:27200", .datum = "EPSG:4959", .accuracy_m = 1},
       "EPSG:4959",
       false,
       true},
      {"Italy, from ITRF2014 at its epoch",
       place(45.1, 9.2),
       {.crs = "EPSG:25832", .datum = "EPSG:7912", .epoch = 2026.5},
       "EPSG:7912"},
      {"United States, heights above EGM96",
       place(40.0, -105.2, 1600),
       {.crs = "EPSG:32613+5773", .accuracy_m = 1},
       "EPSG:4979"},
      {"Sweden, SWEREF99 TM", place(59.3, 18.1), {.crs = "EPSG:3006"}, "EPSG:4977", true},
      {"California, US survey feet", place(34.05, -118.25), {.crs = "EPSG:6424"}, "EPSG:6319", false, true},
      {"California, NAD83 itself",
       place(34.05, -118.25),
       {.crs = "EPSG:2229", .datum = "EPSG:4269"},
       "EPSG:4269",
       false,
       true},
      {"Arizona, feet, transverse Mercator",
       place(33.5, -110.1),
       {.crs = "EPSG:2222", .datum = "EPSG:4269"},
       "EPSG:4269",
       false,
       true},
      {"Florida, US survey feet, transverse Mercator",
       place(25.8, -80.2),
       {.crs = "EPSG:6438"},
       "EPSG:6319",
       false,
       true},
      {"Poland, its own datum", place(52.2, 21.0), {.crs = "EPSG:2180"}, "EPSG:9701", true},
  };
  for (const Case& one : cases) {
    const auto map = MapOperation::create(one.at, one.map, 2026.9);
    ASSERT_TRUE(map.ok()) << one.country << ": " << map.error().message;
    const auto ours = map->apply(one.at);
    // --3d keeps the heights of systems that have two axes in EPSG.
    auto theirs = cs2cs("--3d", one.source, one.map.crs, one.at, one.map.epoch != 0 ? one.map.epoch : 2026.9);
    if (one.north_first) std::swap(theirs[0], theirs[1]);
    std::printf("%-48s %s\n", one.country, map->words().c_str());
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(ours[i], theirs[i], 1e-3) << one.country;
    EXPECT_NEAR(ours[2], one.keeps_height ? one.at.ellipsoidal_height : theirs[2], 1e-3) << one.country;
  }
}

TEST(MapOperation, AMapInFeetSaysSoToOthers) {
  struct Feet {
    const char *crs, *datum, *unit;
    double metres;
    Geodetic at;
  };
  for (const Feet& one : {Feet{"EPSG:2229", "EPSG:4269", "ftUS", 1200.0 / 3937, place(34.05, -118.25)},
                          Feet{"EPSG:2222", "EPSG:4269", "ft", 0.3048, place(33.5, -110.1)},
                          Feet{"EPSG:32611", "", "m", 1, place(34, -118)}}) {
    const auto map = MapOperation::create(one.at, {.crs = one.crs, .datum = one.datum}, 2026);
    ASSERT_TRUE(map.ok()) << map.error().message;
    EXPECT_STREQ(map->unit().name, one.unit);
    EXPECT_STREQ(map->up_unit().name, "m");
    const ProjContext context;
    const ProjObject read(proj_create(context.get(), map->wkt().c_str()));
    ASSERT_EQ(proj_get_type(read.get()), PJ_TYPE_PROJECTED_CRS) << map->wkt();  // heights above the ellipsoid included
    const ProjObject axes(proj_crs_get_coordinate_system(context.get(), read.get()));
    for (const int axis : {0, 1, 2}) {
      double metres = 0;
      proj_cs_get_axis_info(context.get(), axes.get(), axis, nullptr, nullptr, nullptr, &metres, nullptr, nullptr,
                            nullptr);
      EXPECT_NEAR(metres, axis < 2 ? one.metres : 1, 1e-12) << map->wkt();
    }
    // Ten metres to the north are ten metres on the map, up to its scale.
    Geodetic north = one.at;
    north.latitude += 10 / 6.36e6;
    const auto a = map->apply(one.at), b = map->apply(north);
    EXPECT_NEAR(std::hypot(a[0] - b[0], a[1] - b[1]) * one.metres, 10, 0.05);
  }
}

/// The Czech and Slovak maps count to the south and to the west: with them in place of x and y a cloud is a mirror
/// image.
TEST(MapOperation, RefusesAxesThatMirrorTheGround) {
  const Geodetic prague = place(50.08, 14.42);
  const auto mirrored = MapOperation::create(prague, {.crs = "EPSG:5513", .datum = "EPSG:4937", .accuracy_m = 2}, 2026);
  ASSERT_FALSE(mirrored.ok());
  EXPECT_EQ(mirrored.error().code, ErrorCode::Invalid);
  EXPECT_THAT(mirrored.error().message, HasSubstr("mirror image of the ground"));
  const auto plain = MapOperation::create(prague, {.crs = "EPSG:5514", .datum = "EPSG:4937", .accuracy_m = 2}, 2026);
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  const auto here = plain->apply(prague), north = plain->apply(place(50.081, 14.42));
  EXPECT_NEAR(north[1] - here[1], 111.2 * std::cos(10.4 * kRadPerDeg), 1.5) << "the meridians lean by some 8 degrees";
  // To the west and to the south is a turn, not a mirror.
  EXPECT_TRUE(MapOperation::create(place(-26, 31), {.crs = "EPSG:2054", .datum = "EPSG:4148"}, 2026).ok());
}

TEST(MapOperation, SaysWhereTheMapsScaleIsFarFromOne) {
  const auto words = [](const Geodetic& at, const std::string& crs) {
    const auto map = MapOperation::create(at, {.crs = crs}, 2026);
    return map.ok() ? map->words() : map.error().message;
  };
  EXPECT_THAT(words(place(60, 20), "EPSG:3857"), HasSubstr("; 1 m on the ground is 1.99"));
  EXPECT_THAT(words(place(-85, 20), "EPSG:3031"), HasSubstr("; 1 m on the ground is 0.97"));
  EXPECT_THAT(words(place(60, 20), "EPSG:32634"), testing::Not(HasSubstr("on the ground")));
}

TEST(MapOperation, MeetsAPublishedCheckPoint) {
  // EPSG Guidance Note 7-2, transverse Mercator as used for UTM: none has a datum shift. swisstopo's own example of
  // LV95: the fundamental point, the old observatory of Bern, has E 2 600 000, N 1 200 000; in ETRS89 its place is
  // 46 deg 57' 3.89813" N, 7 deg 26' 19.07596" E (CHTRS95), height 602.03 m.
  const Geodetic bern = place(46 + 57 / 60.0 + 3.89813 / 3600, 7 + 26 / 60.0 + 19.07596 / 3600, 602.03);
  const auto map = MapOperation::create(bern, {.crs = "EPSG:2056", .datum = "EPSG:4937"}, 2026);
  ASSERT_TRUE(map.ok()) << map.error().message;
  const auto at = map->apply(bern);
  EXPECT_NEAR(at[0], 2'600'000, 0.05);
  EXPECT_NEAR(at[1], 1'200'000, 0.05);
}

TEST(MapOperation, AnItrfPositionMovesWithItsEpoch) {
  const Geodetic at = place(50.1, 8.7);
  const MapConfig itrf{.crs = "EPSG:25832", .datum = "EPSG:7912"};
  const auto now = MapOperation::create(at, itrf, 2026.9), then = MapOperation::create(at, itrf, 2016.9),
             etrs = MapOperation::create(at, {.crs = "EPSG:25832"}, 2026.9);
  ASSERT_TRUE(now.ok() && then.ok() && etrs.ok());
  const auto a = now->apply(at), b = then->apply(at), c = etrs->apply(at);
  EXPECT_NEAR(std::hypot(a[0] - b[0], a[1] - b[1]), 0.25, 0.05) << "Eurasia moves by 2.5 cm a year";
  EXPECT_GT(std::hypot(a[0] - c[0], a[1] - c[1]), 0.7);
}

TEST(MapOperation, AGeoidFileGivesTheHeightsThatPROJGives) {
  const Geodetic at = place(40.0, -105.2, 1600);
  const auto file = MapOperation::create(at, {.crs = "EPSG:32613", .geoid = "/usr/share/proj/egm96_15.gtx"}, 2026),
             known = MapOperation::create(at, {.crs = "EPSG:32613+5773", .accuracy_m = 1}, 2026);
  ASSERT_TRUE(file.ok() && known.ok()) << (file.ok() ? known.error().message : file.error().message);
  EXPECT_NEAR(file->apply(at)[2], known->apply(at)[2], 1e-4);
  EXPECT_GT(std::abs(file->apply(at)[2] - 1600), 10);
  EXPECT_THAT(file->wkt(), HasSubstr("height by egm96_15.gtx"));
  EXPECT_THAT(known->wkt(), HasSubstr("EGM96"));
}

TEST(MapOperation, WhatWouldBeAGuessIsRefusedWithWhatToDo) {
  const auto refused = [](const Geodetic& at, const MapConfig& map) {
    const auto made = MapOperation::create(at, map, 2026.9);
    return made.ok() ? "not refused: " + made->words() : made.error().message;
  };
  const Geodetic frankfurt = place(50.11, 8.68);
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:31467"}), HasSubstr("say with cloud.datum"));
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:31467", .datum = "EPSG:4937"}), HasSubstr("cloud.accuracy_m"));
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:25832", .datum = "EPSG:4979"}), HasSubstr("cloud.accuracy_m"))
      << "WGS 84 as such is known to 2 m only";
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:25832+7837"}), HasSubstr("which is not in PROJ's folders"))
      << "the grid of the German quasigeoid is not in Debian";
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:25832", .datum = "EPSG:25832"}), HasSubstr("not a geographic CRS"));
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:25832", .geoid = "/nonexistent"}), HasSubstr("is no file"));
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:25832", .geoid = "/etc/passwd"}), HasSubstr("cloud.geoid"));
  EXPECT_THAT(refused(frankfurt, {.crs = "EPSG:25832", .geoid = "/usr/share/proj/ntf_r93.gsb"}),
              HasSubstr("cloud.geoid"));
}

/// A rig is checked before anybody knows where it will drive.
TEST(MapOperation, TellsAWrongMapFromOneOfAnotherPlace) {
  const auto code = [](const Geodetic& at, const MapConfig& map) {
    const auto made = MapOperation::create(at, map, 2026.9);
    EXPECT_FALSE(made.ok()) << map.crs;
    return made.ok() ? ErrorCode::EndOfData : made.error().code;
  };
  const Geodetic frankfurt = place(50.11, 8.68), tokyo = place(35.7, 139.7);
  for (const MapConfig& wrong :
       {MapConfig{.crs = "EPSG:4326"}, MapConfig{.crs = "EPSG:999999"}, MapConfig{.crs = "EPSG:31467"},
        MapConfig{.crs = "EPSG:25832", .datum = "EPSG:25832"}, MapConfig{.crs = "EPSG:25832", .geoid = "/etc/passwd"}})
    EXPECT_EQ(code(frankfurt, wrong), ErrorCode::Invalid) << wrong.crs;
  EXPECT_EQ(code(tokyo, {.crs = "EPSG:25832"}), ErrorCode::Unsupported);
  EXPECT_EQ(code(frankfurt, {.crs = "EPSG:31467", .datum = "EPSG:4937"}), ErrorCode::Unsupported);
  EXPECT_EQ(code(frankfurt, {.crs = "EPSG:25832+7837"}), ErrorCode::Unsupported) << "its grid is not installed";
}

TEST(MapConfig, TellsKeysThatAreWrong) {
  EXPECT_TRUE(MapConfig{}.validate().empty());
  EXPECT_TRUE((MapConfig{.crs = "EPSG:25832+7837", .datum = "EPSG:4937", .epoch = 2020}).validate().empty());
  for (const char* crs : {"EPSG:", "EPSG:25832+", "EPSG:25832 + 7837", "WGS84", "EPSG:1234567"})
    EXPECT_EQ((MapConfig{.crs = crs}).validate().key, "crs") << crs;
  EXPECT_EQ((MapConfig{.epoch = 20}).validate().key, "epoch");
  EXPECT_EQ((MapConfig{.datum = "ETRS89"}).validate().key, "datum");
  EXPECT_EQ((MapConfig{.crs = "EPSG:25832+7837", .geoid = "a.gtx"}).validate().key, "geoid");
}

TEST(MapOperation, RefusesADatabaseThatCannotBeRead) {
  const ProjContext whole;
  const char* const database = proj_context_get_database_path(whole.get());
  ASSERT_NE(database, nullptr);
  const std::string bytes = test::contents(database);
  ASSERT_GT(bytes.size(), 1'000'000u);
  const test::TemporaryFolder folder;
  // Its catalogue is whole and its tables are not, as when a disk fails in its middle; and without a whole catalogue.
  for (const std::size_t whole_bytes : {std::size_t{200'000}, std::size_t{100}}) {
    test::write_file(folder / "proj.db", bytes.substr(0, whole_bytes) + std::string(bytes.size() - whole_bytes, '\0'));
    ::setenv("PROJ_LIB", folder.path().c_str(), 1);  // PROJ_DATA is its newer name
    ::setenv("PROJ_DATA", folder.path().c_str(), 1);
    const auto refused = MapOperation::create(place(50.11, 8.68), {.crs = "EPSG:25832"}, 2026);
    ::unsetenv("PROJ_LIB");
    ::unsetenv("PROJ_DATA");
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::Unavailable) << refused.error().message;
    EXPECT_THAT(refused.error().message, HasSubstr("PROJ's database (package proj-data) is missing or cannot be read"));
  }
  EXPECT_TRUE(MapOperation::create(place(50.11, 8.68), {.crs = "EPSG:25832"}, 2026).ok());
}

}  // namespace
}  // namespace hueline::storage
