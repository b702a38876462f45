#include "storage/cloud_parts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::contents;
using test::TemporaryFolder;

/// A disk that counts the files that are open, and of which call number `at` fails, and with it all later ones that
/// would take space.
class WatchedDisk final : public Disk {
 public:
  std::size_t open = 0, most_open = 0;
  std::uint64_t calls = 0, at = UINT64_MAX;

  int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) override {
    if (fails()) return -ENOSPC;
    std::unique_ptr<DiskFile> own;
    if (const int result = kernel().create(path, if_exists, own); result != 0) return result;
    file = std::make_unique<File>(*this, std::move(own));
    return 0;
  }

 private:
  class File final : public DiskFile {
   public:
    File(WatchedDisk& disk, std::unique_ptr<DiskFile> file) : disk_(disk), file_(std::move(file)) {
      disk_.most_open = std::max(disk_.most_open, ++disk_.open);
    }
    ~File() override { --disk_.open; }
    std::int64_t append(std::span<const iovec> pieces) override {
      return disk_.fails() ? -ENOSPC : file_->append(pieces);
    }
    std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
      return disk_.fails_once() ? -EIO : file_->overwrite(offset, bytes);
    }
    int sync() override { return file_->sync(); }
    int truncate(std::uint64_t size) override { return file_->truncate(size); }
    int close() override { return disk_.fails_once() ? -EIO : file_->close(); }

   private:
    WatchedDisk& disk_;
    std::unique_ptr<DiskFile> file_;
  };
  bool fails() { return ++calls >= at; }
  bool fails_once() { return ++calls == at; }
};

class Parts : public testing::Test {
 protected:
  static constexpr std::size_t kPoints = 130'000;

  /// The records of a cloud, and what describes them, as the writer of the cloud gives them.
  struct Cloud {
    LasHeader header;
    std::vector<LasVlr> vlrs;
    std::string records;
  };
  Cloud cloud_of(const CloudBlock& block) {
    Cloud out;
    auto writer = LasWriter::create(folder_ / "cloud.laz", block.origin, [] {
      LasWriter::Config config;
      config.format = CloudFormat::Laz;
      return config;
    }());
    EXPECT_TRUE(writer);
    writer->also_give(
        [&](ByteView records) { out.records.append(reinterpret_cast<const char*>(records.data()), records.size()); });
    EXPECT_TRUE(writer->append(block) && writer->close());
    out.header = writer->header();
    out.vlrs = writer->records();
    return out;
  }
  static CloudParts::Config config_of(const Cloud& cloud, const std::string& split) {
    CloudParts::Config config;
    config.split = *CloudSplit::parse(split);
    config.tile_edge = config.split.size;
    config.header = cloud.header;
    config.records = cloud.vlrs;
    return config;
  }
  /// Writes the parts into a new folder, with the records in pieces. Returns the first error.
  Status write(const Cloud& cloud, const std::string& name, CloudParts::Config config) {
    std::filesystem::create_directory(folder_ / name);
    auto parts = CloudParts::create(folder_ / name, std::move(config));
    if (!parts) return parts.error();
    const ByteView records = as_bytes(cloud.records);
    const std::size_t piece = 7001 * std::size_t{cloud.header.point_size};
    Status first;
    for (std::size_t at = 0; at < records.size(); at += piece)
      if (Status added = parts->add(records.subspan(at, std::min(piece, records.size() - at))); !added && first)
        first = added;
    const Status finished = parts->finish();
    EXPECT_TRUE(first.ok() || !finished.ok()) << "the first error is not repeated";
    parts_ = parts->parts();
    return first ? finished : first;
  }
  std::map<std::string, std::string> files_of(const std::string& name) {
    std::map<std::string, std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / name))
      out[entry.path().filename()] = contents(entry.path());
    return out;
  }
  /// The records in a file, one behind the other. It has to be whole.
  static std::string records_of(const std::filesystem::path& path) {
    std::string out;
    auto reader = LasReader::open(path);
    EXPECT_TRUE(reader) << reader.error().message;
    if (!reader) return out;
    EXPECT_EQ(reader->available(), reader->header().point_count);
    for (std::vector<LasPoint> points; reader->next(points) && !points.empty();)
      for (const LasPoint& p : points) out.append(reinterpret_cast<const char*>(p.record.data()), p.record.size());
    return out;
  }
  /// The records of each tile, in the order of the cloud.
  static std::map<std::pair<double, double>, std::string> tiles_of(const Cloud& cloud, double edge) {
    std::map<std::pair<double, double>, std::string> out;
    for (std::size_t at = 0; at < cloud.records.size(); at += cloud.header.point_size) {
      std::array<std::int32_t, 2> steps;
      std::memcpy(&steps, cloud.records.data() + at, sizeof steps);
      const auto cell = [&](std::size_t k) {
        return std::floor((steps[k] * cloud.header.scale[k] + cloud.header.offset[k]) / edge);
      };
      out[{cell(0), cell(1)}] += cloud.records.substr(at, cloud.header.point_size);
    }
    return out;
  }
  TemporaryFolder folder_;
  std::vector<CloudPart> parts_;
};

TEST_F(Parts, MemoryAndThreadsDoNotChangeTheBytesOfADriveThatReturns) {
  const Cloud cloud = cloud_of(test::sample_cloud(kPoints));
  WatchedDisk disk;
  auto roomy = config_of(cloud, "tile:100m");
  ASSERT_TRUE(write(cloud, "roomy", roomy));
  auto tight = roomy;
  tight.held_bytes = 1 << 20;  // 18 000 points
  tight.threads = 3;
  tight.disk = &disk;
  ASSERT_TRUE(write(cloud, "tight", tight));
  EXPECT_EQ(disk.most_open, 1u);
  EXPECT_GT(disk.calls, 5 * parts_.size()) << "the last chunks were made again and again";
  EXPECT_TRUE(files_of("tight") == files_of("roomy"));
  const auto tiles = tiles_of(cloud, 100);
  ASSERT_EQ(parts_.size(), tiles.size());
  ASSERT_GT(tiles.size(), 10u);
  for (const auto& [cell, records] : tiles) {
    const auto name = "tile_" + std::to_string(std::lround(cell.first * 100)) + "_" +
                      std::to_string(std::lround(cell.second * 100)) + "_100m.laz";
    EXPECT_TRUE(records_of(folder_ / "tight" / name) == records) << name;
  }
}

TEST_F(Parts, APartOfSeveralChunksGoesOnWhereItsLastChunkWasNotFull) {
  const Cloud cloud = cloud_of(test::sample_cloud(kPoints));
  auto config = config_of(cloud, "tile:100000m");
  ASSERT_TRUE(write(cloud, "roomy", config));
  ASSERT_EQ(parts_.size(), 1u);
  config.held_bytes = 1 << 19;
  ASSERT_TRUE(write(cloud, "tight", config));
  EXPECT_TRUE(files_of("tight") == files_of("roomy"));
  EXPECT_TRUE(records_of(folder_ / "tight" / parts_[0].file) == cloud.records);
}

TEST_F(Parts, StripsAreNumberedFromTheEarliestOfTheFirstPoints) {
  CloudBlock block = test::sample_cloud(60'000);
  // The first point of the second scanner is half a second late, and lies before the border of two strips.
  const auto minute = [](GpsTime time) { return count_ns(time) / 60'000'000'000; };
  const GpsTime border = gps_time_ns((minute(block.points[0].time) + 1) * 60'000'000'000);
  const auto shift = border - block.points[0].time;
  for (ColouredPoint& point : block.points) point.time += shift;
  block.points[200].time = border - std::chrono::milliseconds(1);
  const Cloud cloud = cloud_of(block);
  ASSERT_TRUE(write(cloud, "live", config_of(cloud, "time:60s")));
  ASSERT_GE(parts_.size(), 3u);
  EXPECT_EQ(parts_[0].points, 1u);
  EXPECT_EQ(parts_[0].strip, 1);
  EXPECT_EQ(parts_[1].strip, 2);
  auto known = config_of(cloud, "time:60s");
  known.earliest = from_las_time(to_las_time(block.points[200].time));
  ASSERT_TRUE(write(cloud, "known", known));
  EXPECT_TRUE(files_of("live") == files_of("known"));
}

/// Whatever call of the disk fails: it is told, every file is whole, and holds the beginning of what belongs there.
TEST_F(Parts, AfterAFailureTheFilesHoldTheBeginningOfTheirPoints) {
  const Cloud cloud = cloud_of(test::sample_cloud(kPoints));
  auto config = config_of(cloud, "tile:300m");
  config.held_bytes = 1 << 20;
  WatchedDisk disk;
  config.disk = &disk;
  ASSERT_TRUE(write(cloud, "whole", config));
  const std::uint64_t calls = disk.calls;
  ASSERT_GT(calls, 40u);
  const auto tiles = tiles_of(cloud, 300);
  for (std::uint64_t at = 1; at <= calls; at += 7) {
    disk.calls = 0;
    disk.at = at;
    const std::string name = "failed" + std::to_string(at);
    EXPECT_FALSE(write(cloud, name, config)) << at;
    EXPECT_EQ(disk.open, 0u);
    std::uint64_t points = 0;
    for (const auto& [file, bytes] : files_of(name)) {
      ASSERT_TRUE(file.ends_with("m.laz")) << at << " " << file;
      const std::string records = records_of(folder_ / name / file);
      EXPECT_TRUE(std::ranges::any_of(tiles, [&](const auto& tile) { return tile.second.starts_with(records); }))
          << at << " " << file;
      points += records.size() / cloud.header.point_size;
    }
    std::uint64_t told = 0;
    for (const CloudPart& part : parts_) told += part.points;
    EXPECT_EQ(told, points) << at;
    EXPECT_LT(points, at < calls ? kPoints : kPoints + 1) << at;
    std::filesystem::remove_all(folder_ / name);
  }
}

TEST_F(Parts, SayWhatTheyCannotDo) {
  const Cloud cloud = cloud_of(test::sample_cloud(1000));
  auto config = config_of(cloud, "time:60s");
  config.header.global_encoding &= static_cast<std::uint16_t>(~kLasAdjustedTime);
  EXPECT_EQ(write(cloud, "weeks", config).error().code, ErrorCode::Invalid);
  config = config_of(cloud, "time:0.1s");
  config.earliest = gps_time_ns(0);
  EXPECT_EQ(write(cloud, "strips", config).error().code, ErrorCode::Invalid) << "more than 65535 strips";
}

TEST_F(Parts, AnEarlierRunsPartsAreRemovedAndNothingElse) {
  const auto parts = folder_ / "parts";
  EXPECT_EQ(*remove_parts(parts, EarlierParts::All), 0u) << "there are none";
  std::filesystem::create_directory(parts);
  for (const char* file : {"tile_1_2_100m.laz", "tile_1_3_100m.laz.part", "strip_00001.laz.part", "index.geojson",
                           "tile_1_4_100m.part.laz", "tile_1_2_100m.copc.laz", "mine.laz.part", "notes.txt"})
    std::ofstream(parts / file) << "x";
  EXPECT_EQ(*remove_parts(parts, EarlierParts::Unfinished), 3u);
  auto left = files_of("parts");
  EXPECT_EQ(left.size(), 5u);
  EXPECT_TRUE(left.contains("tile_1_2_100m.laz") && left.contains("index.geojson"));
  EXPECT_EQ(*remove_parts(parts, EarlierParts::All), 2u);
  left = files_of("parts");
  EXPECT_EQ(left.size(), 3u);
  EXPECT_TRUE(left.contains("notes.txt") && left.contains("mine.laz.part") && left.contains("tile_1_2_100m.copc.laz"));
  std::ofstream(parts / "tile_1_5_100m.laz") << "x";
  std::filesystem::create_directories(parts / "tile_1_6_100m.laz" / "other");
  EXPECT_EQ(remove_parts(parts, EarlierParts::All).error().code, ErrorCode::Io) << "a folder of another has this name";
}

}  // namespace
}  // namespace hueline::storage
