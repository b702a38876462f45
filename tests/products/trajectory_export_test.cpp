#include "products/trajectory_export.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "drivers/trajectory/sbet_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::products {
namespace {

using test::TemporaryFolder;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRadius_m = 50, kTurn = 0.2;  // a circle of 50 m at 10 m/s, clockwise
const Geodetic kCentre{48.1 * kDegree, 11.5 * kDegree, 520};
const GpsTime kBegin = from_gps_week(2400, std::chrono::seconds(604'790));  // the week ends after 10 s

/// The vehicle on the circle, from formulas of its own.
InsSolution solution_at(double seconds) {
  InsSolution s;
  s.time = kBegin + from_seconds(seconds);
  const double angle = kTurn * seconds;  // from north, clockwise
  const Eigen::Vector3d enu(kRadius_m * std::sin(angle), kRadius_m * std::cos(angle), 0.1 * seconds);
  s.position = to_geodetic(ecef_from_enu(kCentre) * Point<Enu>{enu});
  s.velocity_enu =
      Eigen::Vector3d(std::cos(angle), -std::sin(angle), 0) * kRadius_m * kTurn + Eigen::Vector3d(0, 0, 0.1);
  s.attitude = {0.02, -0.01, std::fmod(angle + std::numbers::pi / 2, 2 * std::numbers::pi)};
  s.is_good = true;
  s.sigma = std::array{0.02, 0.03, 0.04, 0.1, 0.1, 0.1, 0.001, 0.002, 0.003};
  return s;
}

std::vector<TrajectoryRow> rows_of(double seconds, TrajectoryRows::Config config, std::uint64_t* missing = nullptr,
                                   double gap_from = 1e9, double gap_to = 1e9) {
  std::vector<TrajectoryRow> out;
  TrajectoryRows rows(config, [&](const TrajectoryRow& row) { out.push_back(row); });
  for (int i = 0; i <= static_cast<int>(seconds * 100); ++i)
    if (const double t = i * 0.01; t < gap_from || t > gap_to) rows.add(solution_at(t));
  rows.finish();
  if (missing) *missing = rows.missing();
  return out;
}

double distance_m(const Geodetic& a, const Geodetic& b) { return (to_ecef(a).xyz - to_ecef(b).xyz).norm(); }

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const std::filesystem::path& path, const std::vector<TrajectoryRow>& rows) {
  auto file = TrajectoryFile::create(path, "street <1> & \"co\"");
  ASSERT_TRUE(file) << file.error().message;
  for (const TrajectoryRow& row : rows) ASSERT_TRUE((*file)->add(row));
  ASSERT_TRUE((*file)->close());
}

TEST(TrajectoryRows, AreTheSolutionsOrLieBetweenThem) {
  const auto all = rows_of(3, {});
  ASSERT_EQ(all.size(), 301u);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const InsSolution want = solution_at(static_cast<double>(i) * 0.01);
    ASSERT_EQ(all[i].time, want.time);
    EXPECT_LT(distance_m(all[i].position, want.position), 1e-6);
    EXPECT_NEAR(all[i].attitude.heading, want.attitude.heading, 1e-6);
    EXPECT_NEAR(all[i].attitude.roll, want.attitude.roll, 1e-6);
    EXPECT_NEAR(all[i].sigma_position.z(), 0.04, 1e-9);
  }
  TrajectoryRows::Config config;
  config.rate_hz = 30;
  const auto some = rows_of(3, config);
  EXPECT_NEAR(static_cast<double>(some.size()), 90, 1.5);
  for (const TrajectoryRow& row : some) {
    EXPECT_EQ(count_ns(row.time) % 33'333'333, 0) << "a whole multiple of the interval";
    const InsSolution want = solution_at(to_seconds(row.time - kBegin));
    EXPECT_LT(distance_m(row.position, want.position), 1e-4);
    EXPECT_LT((row.velocity_enu - want.velocity_enu).norm(), 0.01);
  }
}

TEST(TrajectoryRows, GiveTheLeverArmsPlaceVelocityAndSigma) {
  TrajectoryRows::Config config;
  config.point_body = Point<Body>{{10, 0, 0}};  // to the right: nearer to the centre of the circle
  const auto rows = rows_of(2, config);
  for (const TrajectoryRow& row : rows) {
    const double seconds = to_seconds(row.time - kBegin);
    const InsSolution body = solution_at(seconds);
    const Point<Enu> there{rotation_enu_body(body.attitude) * config.point_body.xyz};
    const Geodetic want = to_geodetic(ecef_from_enu(body.position) * there);
    ASSERT_LT(distance_m(row.position, want), 1e-4);
    // The point goes around on a circle of 40 m.
    EXPECT_NEAR(row.velocity_enu.head<2>().norm(), kTurn * 40, 0.02);
    // 0.003 rad of heading at 10 m across, which is along the way; 0.001 rad of roll, which is up.
    EXPECT_NEAR(row.sigma_position.z(), std::hypot(0.04, 0.001 * 10), 1e-3);
    EXPECT_NEAR(row.sigma_position.norm(),
                std::sqrt(0.02 * 0.02 + 0.03 * 0.03 + 0.04 * 0.04 + 0.03 * 0.03 + 0.01 * 0.01), 1e-3);
  }
}

TEST(TrajectoryRows, LeaveOutWhereSolutionsAreMissing) {
  TrajectoryRows::Config config;
  config.rate_hz = 50;
  std::uint64_t missing = 0;
  const auto rows = rows_of(4, config, &missing, 1.5, 2.5);
  EXPECT_NEAR(static_cast<double>(missing), 50, 2);
  for (const TrajectoryRow& row : rows)
    EXPECT_FALSE(row.time > kBegin + from_seconds(1.51) && row.time < kBegin + from_seconds(2.49));
}

TEST(TrajectoryFile, SbetIsReadBack) {
  const TemporaryFolder folder;
  const auto rows = rows_of(20, {});
  write(folder / "drive.out", rows);
  EXPECT_EQ(std::filesystem::file_size(folder / "drive.out"), rows.size() * 136);
  EXPECT_EQ(std::filesystem::file_size(folder / "drive.smrmsg"), rows.size() * 80);
  auto file = drivers::SbetFile::open((folder / "drive.out").string(), (folder / "drive.smrmsg").string());
  ASSERT_TRUE(file) << file.error().message;
  for (const TrajectoryRow& row : rows) {
    const auto record = file->next();
    ASSERT_TRUE(record) << record.error().message;
    ASSERT_NEAR(record->second, 604'790 + to_seconds(row.time - kBegin), 1e-6) << "goes on beyond the end of the week";
    ASSERT_LT(distance_m(record->position, row.position), 1e-8);
    ASSERT_NEAR(record->roll, row.attitude.roll, 1e-12);
    ASSERT_NEAR(record->pitch, row.attitude.pitch, 1e-12);
    ASSERT_NEAR(record->platform_heading - record->wander, row.attitude.heading, 1e-12);
    ASSERT_TRUE(record->sigma);
    const std::array want{row.sigma_position.x(), row.sigma_position.y(), row.sigma_position.z()};
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_NEAR((*record->sigma)[k], want[k], 1e-9);
      ASSERT_NEAR((*record->sigma)[6 + k], row.sigma_attitude[static_cast<Eigen::Index>(k)], 1e-9);
    }
  }
  EXPECT_EQ(file->next().error().code, ErrorCode::EndOfData);
}

TEST(TrajectoryFile, TextFilesHaveEveryRow) {
  const TemporaryFolder folder;
  const auto rows = rows_of(2, {});
  for (const char* name : {"drive.csv", "drive.gpx", "drive.kml", "drive.geojson"}) write(folder / name, rows);
  const auto count = [&](const char* name, const std::string& what) {
    const std::string text = contents(folder / name);
    std::size_t found = 0;
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  EXPECT_EQ(count("drive.csv", "\n"), rows.size() + 1);
  EXPECT_EQ(count("drive.gpx", "<trkpt"), rows.size());
  EXPECT_EQ(count("drive.kml", "\n"), rows.size() + 5);
  EXPECT_EQ(count("drive.gpx", "<name>street &lt;1&gt; &amp; &quot;co&quot;</name>"), 1u);

  std::istringstream csv(contents(folder / "drive.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(std::count(line.begin(), line.end(), ','), 17);
  std::getline(csv, line);
  EXPECT_EQ(line.rfind("2400,604790.000000,2026-01-10T23:59:32", 0), 0u) << line;
  const auto json = nlohmann::json::parse(contents(folder / "drive.geojson"));
  ASSERT_EQ(json["features"].size(), rows.size());
  EXPECT_EQ(json["name"], "street <1> & \"co\"");
  const auto& place = json["features"][150]["geometry"]["coordinates"];
  EXPECT_NEAR(place[0].get<double>() * kDegree, rows[150].position.longitude, 1e-10);
  EXPECT_NEAR(place[1].get<double>() * kDegree, rows[150].position.latitude, 1e-10);
  EXPECT_NEAR(place[2].get<double>(), rows[150].position.ellipsoidal_height, 1e-3);
}

/// Programs draw a line from 180 to -180 degrees around the whole earth.
TEST(TrajectoryFile, LinesOfKmlEndAtTheDateLine) {
  const TemporaryFolder folder;
  auto rows = rows_of(0.03, {});
  ASSERT_EQ(rows.size(), 4u);
  const double places[][2]{{179.98, -17}, {179.99, -17}, {-179.97, -17.0004}, {179.96, -17}};
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].position = {places[i][1] * kDegree, places[i][0] * kDegree, 3};
  write(folder / "drive.kml", rows);
  std::string text = contents(folder / "drive.kml");
  std::vector<std::string> lines;
  for (std::size_t at = 0; (at = text.find("<coordinates>\n", at)) != std::string::npos;) {
    at += 14;
    lines.push_back(text.substr(at, text.find("</coordinates>", at) - at));
  }
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0], "179.980000000,-17.000000000\n179.990000000,-17.000000000\n180.000000000,-17.000100000\n");
  EXPECT_EQ(lines[1], "-180.000000000,-17.000100000\n-179.970000000,-17.000400000\n-180.000000000,-17.000228571\n");
  EXPECT_EQ(lines[2], "180.000000000,-17.000228571\n179.960000000,-17.000000000\n");
}

TEST(TrajectoryFile, SegmentsOfGpxEndAtTheDateLine) {
  const TemporaryFolder folder;
  auto rows = rows_of(0.03, {});
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i].position = {-17 * kDegree, (i == 2 ? -179.99 : 179.99) * kDegree, 3};
  write(folder / "drive.gpx", rows);
  const std::string text = contents(folder / "drive.gpx");
  std::size_t segments = 0;
  for (std::size_t at = 0; (at = text.find("<trkseg>", at)) != std::string::npos; ++at) ++segments;
  EXPECT_EQ(segments, 3u);
}

/// XML Schema, which GPX refers to, has no second 60: programs refuse the whole file.
TEST(TrajectoryFile, TimesOfGpxHaveNoLeapSecond) {
  const TemporaryFolder folder;
  auto rows = rows_of(0.02, {});
  ASSERT_EQ(rows.size(), 3u);
  const GpsTime leap = *from_utc({2016, 12, 31, 23, 59, 60, 250'000'000});
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].time = leap + std::chrono::seconds(static_cast<int>(i) - 1);
  write(folder / "drive.gpx", rows);
  write(folder / "drive.csv", rows);
  const std::string text = contents(folder / "drive.gpx");
  for (const char* time : {"2016-12-31T23:59:59.250000Z", "2017-01-01T00:00:00.250000Z"})
    EXPECT_NE(text.find(time), std::string::npos) << time;
  EXPECT_EQ(text.find(":60."), std::string::npos);
  EXPECT_NE(contents(folder / "drive.csv").find("2016-12-31T23:59:60.250000Z"), std::string::npos);
}

/// An export that fails, as by a full disk, leaves what an earlier one wrote.
TEST(TrajectoryFile, TakesThePlaceOfAnotherWhenItIsWhole) {
  const TemporaryFolder folder;
  const auto rows = rows_of(0.05, {});
  for (const char* name : {"drive.out", "drive.csv", "drive.gpx", "drive.kml", "drive.geojson"}) {
    write(folder / name, rows);
    const std::string before = contents(folder / name), sigmas = contents(folder / "drive.smrmsg");
    {
      auto file = TrajectoryFile::create(folder / name, "another");
      ASSERT_TRUE(file);
      ASSERT_TRUE((*file)->add(rows[0]));
    }
    EXPECT_EQ(contents(folder / name), before) << name;
    EXPECT_EQ(contents(folder / "drive.smrmsg"), sigmas);
  }
  for (const auto& one : std::filesystem::directory_iterator(folder.path()))
    EXPECT_NE(one.path().extension(), ".part") << one.path();
}

/// A line across a tunnel without solutions would show a road that nobody drove.
TEST(TrajectoryFile, LinesAreBrokenAtGaps) {
  const TemporaryFolder folder;
  for (const double rate_hz : {0.0, 10.0, 0.1}) {
    const auto count_gaps = [](const auto& rows) { return std::ranges::count_if(rows, &TrajectoryRow::is_behind_gap); };
    EXPECT_EQ(count_gaps(rows_of(20, {{}, rate_hz, {}}, nullptr, 8, 9)), 0) << "too short to matter";
    const auto rows = rows_of(40, {{}, rate_hz, {}}, nullptr, 20, 23.5);
    const auto behind = count_gaps(rows);
    EXPECT_EQ(behind, rate_hz == 0.1 ? 0 : 1) << rate_hz << " Hz";
    for (const char* name : {"drive.gpx", "drive.kml"}) {
      write(folder / name, rows);
      const std::string text = contents(folder / name), end = name[6] == 'g' ? "</trkseg>" : "</LineString>";
      std::int64_t lines = 0;
      for (std::size_t at = 0; (at = text.find(end, at)) != std::string::npos; ++at) ++lines;
      EXPECT_EQ(lines, behind + 1) << name;
    }
  }
}

TEST(TrajectoryFile, SaysWhichEndingsThereAre) {
  const TemporaryFolder folder;
  const auto file = TrajectoryFile::create(folder / "drive.txt", "drive");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::Invalid);
  EXPECT_NE(file.error().message.find(".geojson"), std::string::npos);
  EXPECT_EQ(TrajectoryFile::create("/nonexistent/drive.csv", "drive").error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace hueline::products
