#include "products/cloud_split.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "storage/part_index.hpp"
#include "storage/scan_cloud_writer.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::products {
namespace {

using storage::CloudPart;
using storage::CloudSplit;
using storage::LasPoint;
using storage::LasReader;
using storage::PathStrips;
using storage::write_part_index;
using test::TemporaryFolder;

class Split : public testing::Test {
 protected:
  static constexpr std::size_t kPoints = 60'000;
  void SetUp() override {
    const storage::LasWriter::Config config;
    auto writer = storage::LasWriter::create(folder_ / "cloud.las", test::sample_origin(), config);
    ASSERT_TRUE(writer && writer->append(test::sample_cloud(kPoints)) && writer->close());
    std::filesystem::create_directory(folder_ / "parts");
  }
  SplitCloud split(const std::string& how, const std::vector<GpsTime>& ends = {}, bool is_copc = false) {
    auto done = split_cloud(folder_ / "cloud.las", folder_ / "parts", *CloudSplit::parse(how), ends, is_copc, {});
    EXPECT_TRUE(done) << done.error().message;
    return done ? std::move(*done) : SplitCloud{};
  }
  /// The records of a file. Strips get back what their records were before.
  static std::vector<std::string> records_of(const std::filesystem::path& path, std::uint16_t strip = 0) {
    std::vector<std::string> out;
    auto reader = LasReader::open(path);
    EXPECT_TRUE(reader) << reader.error().message;
    for (std::vector<LasPoint> points; reader && reader->next(points, 7000) && !points.empty();)
      for (const LasPoint& p : points) {
        out.emplace_back(reinterpret_cast<const char*>(p.record.data()), p.record.size());
        if (strip == 0) continue;
        EXPECT_EQ(p.source, strip);
        const std::uint16_t sensor = p.user_data;
        std::memcpy(out.back().data() + 20, &sensor, 2);
        out.back()[17] = 0;
      }
    return out;
  }
  TemporaryFolder folder_;
};

TEST(CloudSplit, ReadsOneGrammar) {
  EXPECT_EQ(CloudSplit::parse("time:60")->size, 60);
  EXPECT_EQ(CloudSplit::parse("time:0.5s")->kind, CloudSplit::Kind::Time);
  EXPECT_EQ(CloudSplit::parse("distance:500m")->kind, CloudSplit::Kind::Distance);
  EXPECT_EQ(CloudSplit::parse("tile:100m")->size, 100);
  for (const char* wrong : {"", "time", "time:", "time:60m", "tile:100s", "tile:-5", "tile:0", "tile:nan", "hour:1",
                            "tile:1e9", "tile:100 m", "tile:100mm"})
    EXPECT_EQ(CloudSplit::parse(wrong).error().code, ErrorCode::Invalid) << wrong;
}

TEST_F(Split, TilesHaveEveryRecordOnceHoweverOftenTheDriveReturns) {
  // The path swings between the tiles, so more than can be open at once have points to come.
  const SplitCloud done = split("tile:20m");
  ASSERT_GT(done.parts.size(), 100u);
  std::vector<std::string> found, wanted = records_of(folder_ / "cloud.las");
  for (const CloudPart& part : done.parts) {
    const auto records = records_of(folder_ / "parts" / part.file);
    EXPECT_EQ(records.size(), part.points);
    found.insert(found.end(), records.begin(), records.end());
    auto reader = LasReader::open(folder_ / "parts" / part.file);
    EXPECT_EQ(std::floor(part.minimum[0] / 20), std::floor(part.maximum[0] / 20)) << part.file;
    EXPECT_EQ(std::floor(part.minimum[1] / 20), std::floor(part.maximum[1] / 20)) << part.file;
    EXPECT_EQ(reader->header().minimum, part.minimum);
    EXPECT_EQ(reader->header().maximum, part.maximum);
    EXPECT_EQ(reader->header().point_count, part.points);
    EXPECT_EQ(std::filesystem::file_size(folder_ / "parts" / part.file), part.bytes);
  }
  ASSERT_EQ(found.size(), kPoints);
  std::sort(found.begin(), found.end());
  std::sort(wanted.begin(), wanted.end());
  EXPECT_TRUE(found == wanted);
}

TEST_F(Split, StripsKeepTheOrderAndTheScanner) {
  const SplitCloud done = split("time:30s");
  // 60 000 points with 2.3 ms between two take 138 s.
  ASSERT_GE(done.parts.size(), 5u);
  ASSERT_LE(done.parts.size(), 6u);
  std::vector<std::string> found;
  GpsTime last{};
  for (const CloudPart& part : done.parts) {
    EXPECT_GT(part.first, last);
    EXPECT_LT(part.last - part.first, std::chrono::seconds(30));
    last = part.last;
    auto reader = LasReader::open(folder_ / "parts" / part.file);
    EXPECT_EQ(reader->header().file_source_id, part.strip);
    const auto records = records_of(folder_ / "parts" / part.file, part.strip);
    found.insert(found.end(), records.begin(), records.end());
  }
  EXPECT_TRUE(found == records_of(folder_ / "cloud.las"));
}

TEST_F(Split, StripsEndWhereTheyAreTold) {
  const GpsTime begin = test::sample_cloud(1).points[0].time;
  const std::vector<GpsTime> ends{begin + std::chrono::seconds(10), begin + std::chrono::seconds(100)};
  const SplitCloud done = split("distance:500m", ends);
  ASSERT_EQ(done.parts.size(), 3u);
  EXPECT_LT(done.parts[0].last, ends[0]);
  EXPECT_GE(done.parts[1].first, ends[0]);
  EXPECT_GE(done.parts[2].first, ends[1]);
  EXPECT_EQ(done.parts[2].strip, 3);
}

TEST_F(Split, PartsCanBeOctrees) {
  const SplitCloud done = split("tile:200m", {}, true);
  std::uint64_t points = 0;
  for (const CloudPart& part : done.parts) {
    EXPECT_TRUE(part.file.string().ends_with("m.copc.laz")) << part.file;
    points += records_of(folder_ / "parts" / part.file).size();
  }
  EXPECT_EQ(points, kPoints);
  EXPECT_EQ(static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_ / "parts"), {})),
            done.parts.size())
      << "nothing is left over";
}

TEST_F(Split, TheIndexSaysWhereAndWhen) {
  const SplitCloud done = split("tile:100m");
  auto cloud = LasReader::open(folder_ / "cloud.las");
  EXPECT_EQ(*write_part_index(folder_ / "index.geojson", done.parts, cloud->wkt()), 0u);
  const auto index = nlohmann::json::parse(std::ifstream(folder_ / "index.geojson"));
  ASSERT_EQ(index["features"].size(), done.parts.size());
  for (const auto& feature : index["features"]) {
    const auto& ring = feature["geometry"]["coordinates"][0];
    ASSERT_EQ(ring.size(), 5u);
    EXPECT_EQ(ring[0], ring[4]);
    for (const auto& corner : ring) {
      EXPECT_NEAR(corner[0], 11.575, 0.01);
      EXPECT_NEAR(corner[1], 48.137, 0.01);
    }
    EXPECT_TRUE(std::filesystem::exists(folder_ / "parts" / feature["properties"]["file"].get<std::string>()));
    EXPECT_GE(feature["properties"]["last_gps_s"], feature["properties"]["first_gps_s"]);
  }
  // Coordinates from the centre of the Earth are no places on a map either.
  const char* geocentric =
      R"(GEOCCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["metre",1]])";
  for (const char* crs : {"", geocentric}) {
    EXPECT_EQ(*write_part_index(folder_ / "bare.geojson", done.parts, crs), done.parts.size());
    EXPECT_TRUE(nlohmann::json::parse(std::ifstream(folder_ / "bare.geojson"))["features"][0]["geometry"].is_null());
  }
}

/// As of a cloud in millimetres: its CRS has no such place.
TEST_F(Split, APartBeyondTheMapHasNoRectangle) {
  const auto cloud = LasReader::open(folder_ / "cloud.las");
  ASSERT_TRUE(cloud);
  CloudPart here, beyond;
  here.minimum = here.maximum = {691'600, 5'334'700, 500};
  beyond.minimum = beyond.maximum = {1e12, -1e12, 0};
  EXPECT_EQ(*write_part_index(folder_ / "index.geojson", {here, beyond}, cloud->wkt()), 1u);
  const auto index = nlohmann::json::parse(std::ifstream(folder_ / "index.geojson"));
  EXPECT_EQ(index["features"][0]["geometry"]["type"], "Polygon");
  EXPECT_TRUE(index["features"][1]["geometry"].is_null());
}

/// A Mercator map on WGS84's ellipsoid, of the meridian `central`.
std::string mercator(const std::string& geographic, const std::string& central) {
  return "PROJCS[\"a map\"," + geographic + ",PROJECTION[\"Mercator_1SP\"],PARAMETER[\"central_meridian\"," + central +
         "],PARAMETER[\"scale_factor\",1],PARAMETER[\"false_easting\",0],PARAMETER[\"false_northing\",0]," +
         "UNIT[\"metre\",1]]";
}
constexpr const char* kDatum = R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)";

TEST_F(Split, TheIndexIsCutAtTheDateLine) {
  CloudPart part;
  part.minimum = {-111.3194908, 0, 0};
  part.maximum = {222.6389816, 111, 0};
  const std::string greenwich = std::string(kDatum) + R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  const auto geometry = [&](const std::string& wkt) {
    EXPECT_EQ(*write_part_index(folder_ / "index.geojson", {part}, wkt), 0u);
    return nlohmann::json::parse(std::ifstream(folder_ / "index.geojson"))["features"][0]["geometry"];
  };
  const auto bounds = [](const nlohmann::json& ring) {
    double least = ring[0][0], most = least;
    for (const auto& place : ring) {
      least = std::min<double>(least, place[0]);
      most = std::max<double>(most, place[0]);
    }
    EXPECT_EQ(ring.size(), 5u);
    EXPECT_EQ(ring.front(), ring.back());
    return std::pair(least, most);
  };
  const auto expect = [&](const nlohmann::json& ring, double least, double most) {
    EXPECT_NEAR(bounds(ring).first, least, 2e-8);
    EXPECT_NEAR(bounds(ring).second, most, 2e-8);
  };
  const auto across = geometry(mercator(greenwich, "180"));
  EXPECT_EQ(across["type"], "MultiPolygon");
  expect(across["coordinates"][0][0], 179.999, 180);
  expect(across["coordinates"][1][0], -180, -179.998);
  part.minimum[0] = 0;
  const auto beside = geometry(mercator(greenwich, "180"));
  EXPECT_EQ(beside["type"], "Polygon");
  expect(beside["coordinates"][0], -180, -179.998);
  part.minimum[0] = -222.6389816;
  part.maximum[0] = -111.3194908;
  expect(geometry(mercator(greenwich, "-180"))["coordinates"][0], 179.998, 179.999);
  // Angles in grads from Paris are degrees from Greenwich here.
  const auto ring = geometry(mercator(
      std::string(kDatum) + R"(PRIMEM["Paris",2.5969213],UNIT["grad",0.015707963267949]])", "100"))["coordinates"][0];
  expect(ring, 90 + 2.33722917 - 0.002, 90 + 2.33722917 - 0.001);
}

TEST_F(Split, RefusesTooManyTilesBeforeItWritesOne) {
  // A cloud over 1100 m x 1100 m without order: its tiles all have points from its begin to its end.
  storage::ScanCloudWriter::Format format = storage::ScanCloudWriter::Format::Las;
  auto writer = storage::ScanCloudWriter::create(folder_ / "wide.las", format, {0, 0, 0}, UtcTime{2026, 1, 1});
  ASSERT_TRUE(writer);
  std::vector<double> places;
  for (int round = 0; round < 2; ++round)
    for (int i = 0; i < 25'000; ++i)
      for (const double one : {0.5 + 7.0 * (i % 158), 0.5 + 7.0 * (i / 158), 0.0}) places.push_back(one);
  ASSERT_TRUE(writer->append(places) && writer->close());
  const auto cut = [&](const char* how) {
    return split_cloud(folder_ / "wide.las", folder_ / "parts", *CloudSplit::parse(how), {}, false, {});
  };
  const auto refused = cut("tile:0.1m");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Invalid);
  EXPECT_EQ(refused.error().message, "there would be more than 20000 tiles: give a greater size than tile:0.1m");
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "parts"));
  const auto written = cut("tile:28m");
  ASSERT_TRUE(written);
  std::uint64_t points = 0;
  for (const CloudPart& part : written->parts) points += part.points;
  EXPECT_EQ(written->parts.size(), 1600u);
  EXPECT_EQ(points, 50'000u);
}

TEST_F(Split, RemovesWhatAKilledRunHasLeft) {
  for (const char* name : {"tile_0_0_20m.part.laz", "tile_0_0_20m.laz.part", "strip_00001_x.part.laz.part",
                           "mine.part.laz", "tile_1_1_20m.laz"})
    test::write_file(folder_ / "parts" / name, "left");
  EXPECT_EQ(split("tile:500m", {}, true).unfinished_removed, 3u);
  std::set<std::string> left;
  for (const auto& one : std::filesystem::directory_iterator(folder_ / "parts"))
    if (std::filesystem::file_size(one) == 4) left.insert(one.path().filename());
  EXPECT_EQ(left, (std::set<std::string>{"mine.part.laz", "tile_1_1_20m.laz"}));
}

TEST_F(Split, SaysWhatIsWrong) {
  const auto error = [&](const char* how) {
    return split_cloud(folder_ / "cloud.las", folder_ / "parts", *CloudSplit::parse(how), {}, false, {});
  };
  EXPECT_EQ(split_cloud(folder_ / "none.las", folder_ / "parts", {}, {}, false, {}).error().code,
            ErrorCode::Unavailable);
  std::filesystem::remove_all(folder_ / "parts");
  EXPECT_EQ(error("tile:100m").error().code, ErrorCode::Io) << "the folder is missing";
}

TEST(PathStrips, CountsThePathAndNotTheNoise) {
  PathStrips path(100);
  InsSolution solution;
  solution.is_good = true;
  const auto add = [&](std::int64_t ms, double height) {
    solution.time += std::chrono::milliseconds(ms);
    solution.position.ellipsoidal_height = height;
    path.add(solution);
  };
  for (int i = 0; i < 5000; ++i) add(5, 0.1 * (i % 3));
  EXPECT_TRUE(path.ends().empty()) << "it stands";
  const GpsTime begin = solution.time;
  for (int i = 0; i <= 3500; ++i) {
    add(10, 0.1 * i);
    solution.is_good = false;
    add(0, 1000);
    solution.is_good = true;
  }
  ASSERT_EQ(path.ends().size(), 3u);
  EXPECT_NEAR(to_seconds(path.ends()[0] - begin), 10, 0.1);
  EXPECT_NEAR(to_seconds(path.ends()[2] - begin), 30, 0.1);
}

}  // namespace
}  // namespace hueline::products
