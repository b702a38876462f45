#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/storage/cloud_files.hpp"
#include "tests/support/temporary_folder.hpp"

// What other programs read of these files is tested by tests/storage/node/read_copc.mjs.
namespace hueline::storage {
namespace {

using test::records_of;
using test::sample_cloud;
using test::sample_origin;
using test::TemporaryFolder;
using test::write_cloud;

/// Small nodes and little memory, so that nodes are written on the way.
LasWriter::Config copc(int threads = 1, std::uint64_t header_every = 1'000'000) {
  LasWriter::Config config;
  config.created = {2026, 3, 1, 12, 0, 0, 0};
  config.format = CloudFormat::Copc;
  config.threads = threads;
  config.header_every = header_every;
  config.node_points = 2000;
  config.octree_bytes = 2u << 20;
  return config;
}

std::vector<std::string> sorted(const Bytes& records) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < records.size(); at += 58)
    out.emplace_back(reinterpret_cast<const char*>(records.data()) + at, 58);
  std::sort(out.begin(), out.end());
  return out;
}

TEST(Copc, HasTheRecordsOfLasInAnotherOrderWhateverTheThreads) {
  const TemporaryFolder folder;
  const CloudBlock cloud = sample_cloud(120'000);
  LasWriter::Config las = copc();
  las.format = CloudFormat::Las;
  write_cloud(folder / "cloud.las", cloud, las);
  write_cloud(folder / "cloud.copc.laz", cloud, copc());
  EXPECT_TRUE(sorted(records_of(folder / "cloud.copc.laz")) == sorted(records_of(folder / "cloud.las")));
  auto from = LasReader::open(folder / "cloud.las"), to = LasReader::open(folder / "cloud.copc.laz");
  ASSERT_TRUE(from && to);
  EXPECT_EQ(to->header().minimum, from->header().minimum);
  EXPECT_EQ(to->header().maximum, from->header().maximum);
  EXPECT_EQ(to->header().points_by_return, from->header().points_by_return);
  EXPECT_EQ(to->wkt(), from->wkt());
  for (const int threads : {2, 3}) {
    write_cloud(folder / "more.copc.laz", cloud, copc(threads));
    EXPECT_TRUE(test::bytes_of(folder / "more.copc.laz") == test::bytes_of(folder / "cloud.copc.laz"));
  }
}

TEST(Copc, AnEmptyCloudReads) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.copc.laz", {sample_origin(), {}}, copc());
  EXPECT_TRUE(records_of(folder / "cloud.copc.laz").empty());
}

TEST(Copc, AKilledWriterLeavesTheNodesBeforeItsLastHeader) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.copc.laz";
  ASSERT_EQ(test::status_of_killed([&] {
              auto writer = LasWriter::create(path, sample_origin(), copc(1, 20'000));
              for (std::size_t i = 0; i < 36; ++i)
                if (!writer->append(sample_cloud(5'000, i * 5'000))) return 1;
              ::_exit(0);  // the writer is not closed
            }),
            0);
  write_cloud(folder / "whole.copc.laz", sample_cloud(180'000), copc());
  const auto whole = sorted(records_of(folder / "whole.copc.laz"));
  const auto read = sorted(records_of(path));
  // 2 MB of nodes and a buffer of 50 000 points wait in memory.
  EXPECT_GE(read.size(), 60'000u);
  EXPECT_TRUE(std::includes(whole.begin(), whole.end(), read.begin(), read.end()));
}

TEST(Copc, ACutFileReadsToItsLastWholeNode) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.copc.laz";
  write_cloud(path, sample_cloud(60'000), copc());
  const Bytes whole = records_of(path);
  const auto size = static_cast<double>(std::filesystem::file_size(path));
  for (const double part : {0.999, 0.7, 0.4, 0.1}) {
    std::filesystem::resize_file(path, static_cast<std::uintmax_t>(part * size));
    Status end;
    const Bytes read = records_of(path, end);
    EXPECT_GE(static_cast<double>(read.size()), (part - 0.1) * static_cast<double>(whole.size())) << part;
    EXPECT_EQ(read.size() == whole.size(), end.ok());
    EXPECT_TRUE(std::equal(read.begin(), read.end(), whole.begin()));
  }
}

TEST(Copc, WhatWasWrittenBeforeARefusedWriteReads) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.copc.laz";
  ASSERT_EQ(test::status_of_killed([&] { return test::write_into_limit(path, copc(2)); }), 0);
  EXPECT_GE(records_of(path).size(), 30'000u * 58);
}

}  // namespace
}  // namespace hueline::storage
