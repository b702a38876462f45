#include "runtime/outputs.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "core/calendar.hpp"
#include "storage/las_reader.hpp"
#include "storage/mcap_reader.hpp"

namespace hueline::runtime {
namespace {

/// A drive's folder that is removed with the test.
struct Folder {
  std::filesystem::path path;
  Folder() {
    char name[] = "/tmp/hueline_outputs_XXXXXX";
    path = mkdtemp(name);
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

config::Rig rig() {
  return config::parse_rig(
      "rig: r\nsensors:\n  - {name: pps, driver: pps, device: /dev/pps0}\n"
      "  - {name: pos, driver: novatel, tcp: {host: h, port: 3001}, logs: {}}\ncolouring: {method: lens}\n",
      "rig");
}

InsSolution solution(double seconds) {
  InsSolution s;
  s.sensor = 2;
  s.time = from_gps_week(2400, from_seconds(seconds));
  s.position = {0.84, 0.2, 570};
  s.is_good = true;
  return s;
}

TEST(Outputs, TheViewBeginsWithTheFirstPoseAndKnowsWhatWasSaidBefore) {
  Folder folder;
  auto outputs = Outputs::create(rig(), folder.path, [](const std::string& trouble) { FAIL() << trouble; });
  ASSERT_TRUE(outputs.ok());
  Outputs& out = **outputs;
  out.on_fault({2, FaultKind::Disconnected, {}, 1, "no route"});
  out.on_sync_state({}, 1, SyncState::Acquiring);
  out.on_origin(solution(100).position);
  for (int i = 0; i < 5; ++i) out.on_solution(solution(100 + i));
  // no point was coloured
  ASSERT_TRUE(out.finish().ok());

  auto reader = storage::McapReader::open(folder.path / "view.mcap");
  ASSERT_TRUE(reader.ok());
  std::map<std::string, int> messages;
  std::uint64_t earliest = ~std::uint64_t{0};
  for (;;) {
    auto message = reader->next();
    if (!message.ok()) break;
    ++messages[reader->channels().at(message->channel).topic];
    earliest = std::min(earliest, message->log_time);
  }
  EXPECT_EQ(messages["/pose"], 5);
  EXPECT_EQ(messages["/log"], 2);
  EXPECT_GT(earliest, 1'600'000'000'000'000'000u) << "something was shown in 1980";
}

/// A disk with this much free space.
class DiskWith final : public storage::Disk {
 public:
  int create(const std::filesystem::path&, storage::IfExists, std::unique_ptr<storage::DiskFile>&) override {
    return -1;
  }
  std::int64_t free_bytes(const std::filesystem::path&) override { return left; }
  std::int64_t left = INT64_MAX;
};

TEST(DiskReserve, FitsTheRecordingsRateAndItsFileSystemOnly) {
  Folder folder;
  DiskWith disk;
  const auto recording = folder.path / "drive.mcap", product = folder.path / "cloud.las";
  for (const auto& file : {recording, product}) std::ofstream(file).put('x');
  DiskReserve reserve(recording, disk);
  EXPECT_EQ(reserve.bytes(), DiskReserve::kLeastBytes);
  reserve.note(6'000'000, 0.5);
  EXPECT_EQ(reserve.bytes(), DiskReserve::kLeastBytes + 30'000'000) << "a burst at the beginning is no rate";
  reserve.note(36'000'000'000, 3600);
  EXPECT_EQ(reserve.bytes(), DiskReserve::kLeastBytes + 3'000'000'000);
  disk.left = 3'064'000'000;
  EXPECT_TRUE(reserve.check(product).ok());
  --disk.left;
  EXPECT_FALSE(reserve.check(product).ok());
  EXPECT_TRUE(reserve.check("/proc/self/status").ok()) << "another file system's space is not the recording's";
}

TEST(Outputs, TheCloudLeavesTheDisksLastSpaceToTheRecording) {
  Folder folder;
  DiskWith disk;
  std::ofstream(folder.path / "drive.mcap").put('x');
  DiskReserve reserve(folder.path / "drive.mcap", disk);
  std::vector<std::string> told;
  auto outputs = Outputs::create(rig(), folder.path, [&](const std::string& trouble) { told.push_back(trouble); });
  ASSERT_TRUE(outputs.ok());
  Outputs& out = **outputs;
  out.keep(reserve);
  out.on_origin(solution(100).position);
  const auto block = [&](double at_s) {
    CloudBlock cloud;
    cloud.origin = solution(100).position;
    cloud.points.resize(100);
    for (auto& point : cloud.points) point.time = solution(at_s).time;
    return cloud;
  };
  const fusion::Trajectory path({});
  out.on_cloud(block(101), path);
  disk.left = 1000;
  out.on_cloud(block(102), path);
  disk.left = INT64_MAX;
  // There is room again, but a file with a gap would not be the beginning of a replay's file.
  out.on_cloud(block(103), path);
  ASSERT_EQ(told.size(), 1u) << "once, when it happens";
  EXPECT_NE(told[0].find("the raw recording goes on"), std::string::npos) << told[0];
  const Status finished = out.finish();
  ASSERT_FALSE(finished.ok());
  EXPECT_NE(finished.error().message.find("a replay makes them whole"), std::string::npos) << finished.error().message;
  auto cloud = storage::LasReader::open(folder.path / "cloud.las");
  ASSERT_TRUE(cloud.ok());
  EXPECT_EQ((*cloud).header().point_count, 100u);
  EXPECT_EQ(out.summary().points(), 300u);
  const std::string said = out.summary().text();
  EXPECT_NE(said.find("200 points not written: left out to keep the disk's last space for the recording"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("ends early"), std::string::npos) << said;
}

TEST(Outputs, TheSummaryOfAnEarlierRunGoesWithItsCloud) {
  Folder folder;
  const auto begin = [&] {
    auto outputs = Outputs::create(rig(), folder.path, [](const std::string& trouble) { FAIL() << trouble; });
    EXPECT_TRUE(outputs.ok());
    return std::move(*outputs);
  };
  const auto summary = folder.path / "summary.json";
  CloudBlock cloud;
  cloud.origin = solution(100).position;
  cloud.points.resize(100);
  for (auto& point : cloud.points) point.time = solution(101).time;
  auto first = begin();
  first->on_cloud(cloud, fusion::Trajectory({}));
  EXPECT_TRUE(first->finish().ok());
  first.reset();
  EXPECT_TRUE(std::filesystem::exists(summary));
  auto second = begin();
  EXPECT_TRUE(std::filesystem::exists(summary)) << "the earlier cloud is still there";
  second->on_cloud(cloud, fusion::Trajectory({}));
  EXPECT_FALSE(std::filesystem::exists(summary)) << "of a cloud that is not there any more";
  EXPECT_TRUE(second->finish().ok());
  EXPECT_TRUE(std::filesystem::exists(summary));
}

TEST(Outputs, PointsThatAreNotWrittenHaveTheReasonOfTheCloud) {
  Folder folder;
  config::Rig wrong = rig();
  wrong.map.crs = "EPSG:99999";  // a capture goes on with it
  std::vector<std::string> told;
  auto outputs = Outputs::create(wrong, folder.path, [&](const std::string& trouble) { told.push_back(trouble); });
  ASSERT_TRUE(outputs.ok());
  Outputs& out = **outputs;
  out.on_origin(solution(100).position);
  CloudBlock cloud;
  cloud.origin = solution(100).position;
  cloud.points.resize(100);
  for (auto& point : cloud.points) point.time = solution(101).time;
  out.on_cloud(cloud, fusion::Trajectory({}));
  EXPECT_FALSE(out.finish().ok());
  ASSERT_EQ(told.size(), 1u);
  const std::string said = out.summary().text(), count = "100 points not written: ";
  const auto at = said.find(count);
  ASSERT_NE(at, std::string::npos) << said;
  const std::string reason = said.substr(at + count.size(), said.find('\n', at) - at - count.size());
  EXPECT_NE(reason.find("EPSG:99999"), std::string::npos) << said;
  EXPECT_NE(told[0].find(reason), std::string::npos) << told[0];
}

/// A rig whose cloud is also written in parts.
config::Rig rig_with_parts(const std::string& split) {
  return config::parse_rig(
      "rig: r\nsensors:\n  - {name: pps, driver: pps, device: /dev/pps0}\n"
      "  - {name: pos, driver: novatel, tcp: {host: h, port: 3001}, logs: {}}\ncolouring: {method: lens}\n"
      "cloud: {split: '" +
          split + "'}\n",
      "rig");
}

/// A point at that time, so many metres east of the origin.
CloudBlock point_at(double seconds, double east_m) {
  CloudBlock block{solution(100).position, std::vector<ColouredPoint>(1)};
  block.points[0].time = solution(seconds).time;
  block.points[0].east = east_m;
  return block;
}

TEST(Outputs, StripsByDistanceEndWhereTheVehicleHasDrivenSoFar) {
  Folder folder;
  auto outputs =
      Outputs::create(rig_with_parts("distance:100m"), folder.path, [](const auto& said) { FAIL() << said; });
  ASSERT_TRUE(outputs.ok());
  Outputs& out = **outputs;
  out.on_origin(solution(100).position);
  const fusion::Trajectory path({});
  for (int s = 0; s <= 25; ++s) {  // 10 m/s to the north
    InsSolution here = solution(100 + s);
    here.position.latitude += 10 * s / 6.37e6;
    out.on_solution(here);
    if (s > 0) out.on_cloud(point_at(100 + s - 0.5, 0), path);
  }
  ASSERT_TRUE(out.finish().ok());
  const auto& parts = out.summary().parts();
  ASSERT_TRUE(parts);
  EXPECT_EQ(parts->files, 3u);
  EXPECT_EQ(parts->points, 25u);
  EXPECT_EQ(parts->missing, 0u);
  EXPECT_TRUE(std::filesystem::exists(folder.path / "parts" / "index.geojson"));
  std::uint64_t points = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path / "parts")) {
    if (entry.path().extension() != ".laz") continue;
    auto reader = storage::LasReader::open(entry.path());
    ASSERT_TRUE(reader.ok());
    points += reader->header().point_count;
    if (reader->header().file_source_id == 2) {
      EXPECT_EQ(reader->header().point_count, 10u);
    }
  }
  EXPECT_EQ(points, 25u);
  // The next run into the same folder has none.
  outputs->reset();
  auto again = Outputs::create(rig(), folder.path, [](const auto& said) { FAIL() << said; });
  ASSERT_TRUE(again.ok() && (*again)->finish().ok());
  EXPECT_FALSE(std::filesystem::exists(folder.path / "parts"));
}

TEST(Outputs, PartsLeaveTheDisksLastSpaceToTheRecordingToo) {
  Folder folder;
  DiskWith disk;
  std::ofstream(folder.path / "drive.mcap").put('x');
  DiskReserve reserve(folder.path / "drive.mcap", disk);
  std::vector<std::string> told;
  auto outputs =
      Outputs::create(rig_with_parts("tile:10m"), folder.path, [&](const auto& said) { told.push_back(said); });
  ASSERT_TRUE(outputs.ok());
  Outputs& out = **outputs;
  out.keep(reserve);
  out.on_origin(solution(100).position);
  const fusion::Trajectory path({});
  for (int i = 0; i < 4; ++i) {
    if (i == 2) disk.left = 1000;
    out.on_cloud(point_at(101 + i, 20.0 * i), path);
  }
  disk.left = INT64_MAX;
  EXPECT_FALSE(out.finish().ok());
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("cloud.las, parts, view.mcap"), std::string::npos) << told[0];
  EXPECT_EQ(out.summary().parts()->files, 2u);
  EXPECT_EQ(out.summary().parts()->missing, 2u);
  const std::string said = out.summary().text();
  EXPECT_NE(said.find("2 points are not in them: a replay makes them whole"), std::string::npos) << said;
}

}  // namespace
}  // namespace hueline::runtime
