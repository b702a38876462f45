#include "products/cloud_export.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::products {
namespace {

using storage::LasPoint;
using storage::LasReader;
using storage::LasWriter;
using test::TemporaryFolder;

void write_cloud(const std::filesystem::path& path, std::size_t points, bool compress = false) {
  LasWriter::Config config;
  config.format = compress ? storage::CloudFormat::Laz : storage::CloudFormat::Las;
  auto writer = LasWriter::create(path, test::sample_origin(), config);
  ASSERT_TRUE(writer && writer->append(test::sample_cloud(points)) && writer->close());
}

std::vector<std::string> records_of(const std::filesystem::path& path) {
  std::vector<std::string> out;
  auto reader = LasReader::open(path);
  EXPECT_TRUE(reader) << reader.error().message;
  for (std::vector<LasPoint> points; reader && reader->next(points, 7000) && !points.empty();)
    for (const LasPoint& p : points) out.emplace_back(reinterpret_cast<const char*>(p.record.data()), p.record.size());
  return out;
}

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ExportLaz, HasTheSameRecordsAndSaysTheSame) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 60'000);
  const auto done = export_laz(folder / "cloud.las", folder / "out.laz", {});
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->points, 60'000u);
  EXPECT_EQ(done->bytes, std::filesystem::file_size(folder / "out.laz"));
  EXPECT_TRUE(records_of(folder / "out.laz") == records_of(folder / "cloud.las"));
  auto from = LasReader::open(folder / "cloud.las"), to = LasReader::open(folder / "out.laz");
  EXPECT_EQ(to->wkt(), from->wkt());
  EXPECT_EQ(to->header().points_by_return, from->header().points_by_return);
  EXPECT_EQ(to->header().minimum, from->header().minimum);
  EXPECT_EQ(to->extra_fields().size(), from->extra_fields().size());

  CloudExport one;
  one.threads = 1;
  ASSERT_TRUE(export_laz(folder / "cloud.las", folder / "one.laz", one));
  EXPECT_TRUE(contents(folder / "one.laz") == contents(folder / "out.laz"));
  ASSERT_TRUE(export_laz(folder / "out.laz", folder / "again.laz", one));
  EXPECT_TRUE(contents(folder / "again.laz") == contents(folder / "out.laz")) << "LAZ made from LAZ";
}

TEST(ExportLaz, WritesWhatIsWholeOfACutCloud) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 1000);
  std::filesystem::resize_file(folder / "cloud.las", std::filesystem::file_size(folder / "cloud.las") - 58 * 100 - 1);
  const auto done = export_laz(folder / "cloud.las", folder / "out.laz", {});
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_TRUE(done->source_was_cut);
  EXPECT_EQ(done->points, 899u);
  EXPECT_EQ(records_of(folder / "out.laz").size(), 899u);
}

TEST(ExportCopc, HasEveryRecordOnceWhateverTheMemoryAndTheThreads) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 30'000);
  CloudExport options;
  options.node_points = 500;
  const auto done = export_copc(folder / "cloud.las", folder / "out.copc.laz", options);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_GT(done->nodes, 60u);
  std::vector<std::string> wanted = records_of(folder / "cloud.las"), found = records_of(folder / "out.copc.laz");
  EXPECT_FALSE(found == wanted) << "the nodes have another order than the drive";
  std::sort(wanted.begin(), wanted.end());
  std::sort(found.begin(), found.end());
  EXPECT_TRUE(found == wanted);

  options.threads = 3;
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "other.copc.laz", options));
  EXPECT_TRUE(contents(folder / "other.copc.laz") == contents(folder / "out.copc.laz"));
  write_cloud(folder / "cloud.laz", 30'000, true);
  ASSERT_TRUE(export_copc(folder / "cloud.laz", folder / "from_laz.copc.laz", options));
  EXPECT_TRUE(records_of(folder / "from_laz.copc.laz") == records_of(folder / "out.copc.laz"));

  options.held_bytes = 4000 * 58;
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "other.copc.laz", options));
  found = records_of(folder / "other.copc.laz");
  std::sort(found.begin(), found.end());
  EXPECT_TRUE(found == wanted);
}

TEST(ExportCopc, TakesPointsThatAllHaveOnePlace) {
  const TemporaryFolder folder;
  CloudBlock cloud = test::sample_cloud(3000);
  for (ColouredPoint& p : cloud.points) p.east = p.north = p.up = 1;
  auto writer = LasWriter::create(folder / "cloud.las", test::sample_origin(), {});
  ASSERT_TRUE(writer->append(cloud) && writer->close());
  CloudExport options;
  options.node_points = 100;
  const auto done = export_copc(folder / "cloud.las", folder / "out.copc.laz", options);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(records_of(folder / "out.copc.laz").size(), 3000u);
}

TEST(Export, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(export_laz(folder / "none.las", folder / "out.laz", {}).error().code, ErrorCode::Io);
  write_cloud(folder / "empty.las", 0);
  EXPECT_EQ(export_copc(folder / "empty.las", folder / "out.laz", {}).error().code, ErrorCode::Invalid);
  write_cloud(folder / "cut.las", 10);
  std::filesystem::resize_file(folder / "cut.las", std::filesystem::file_size(folder / "cut.las") - 9 * 58 - 1);
  EXPECT_EQ(export_copc(folder / "cut.las", folder / "cut.copc.laz", {}).error().code, ErrorCode::Invalid);
  EXPECT_FALSE(std::filesystem::exists(folder / "cut.copc.laz")) << "nothing is written of a cloud without a point";
  write_cloud(folder / "cloud.las", 10);
  EXPECT_EQ(export_laz(folder / "cloud.las", "/nonexistent/out.laz", {}).error().code, ErrorCode::Io);
  std::string bytes = contents(folder / "cloud.las");
  bytes[104] = 3;
  std::ofstream(folder / "old.las", std::ios::binary) << bytes;
  EXPECT_EQ(export_laz(folder / "old.las", folder / "out.laz", {}).error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::products
