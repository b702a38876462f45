#include "storage/pcd_reader.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_data.hpp"

namespace hueline::storage {
namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(Pcd, ReadsAscii) {
  const auto cloud = decode_pcd(bytes_of("# c\nVERSION .7\nFIELDS x n\nSIZE 4 4\nTYPE F F\nCOUNT 1 2\nPOINTS 2\nDATA ascii\n1 2 3\n4 nan 6\n"), "t");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->points(), 2u);
  EXPECT_EQ(cloud->columns.size(), 3u);
  EXPECT_EQ(cloud->column("x")[1], 4);
  EXPECT_TRUE(std::isnan(cloud->column("n")[1]));
  EXPECT_TRUE(cloud->column("intensity").empty());
}

TEST(Pcd, ReadsCompressedColumns) {
  // Two points x = 1, 1 (u8) and y = 7, 8 (u16), as literals: columns, then LZF of control byte n-1.
  std::string text = "FIELDS x y\nSIZE 1 2\nTYPE U U\nPOINTS 2\nDATA binary_compressed\n";
  auto bytes = bytes_of(text);
  for (int b : {7, 0, 0, 0, 6, 0, 0, 0, 5, 1, 1, 7, 0, 8, 0}) bytes.push_back(static_cast<std::byte>(b));
  const auto cloud = decode_pcd(bytes, "t");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->column("x")[1], 1);
  EXPECT_EQ(cloud->column("y")[0], 7);
  EXPECT_EQ(cloud->column("y")[1], 8);
}

TEST(Pcd, EveryTruncationIsAnError) {
  const std::string text = "FIELDS x\nSIZE 4\nTYPE F\nCOUNT 1\nPOINTS 2\nDATA binary\n";
  auto bytes = bytes_of(text);
  bytes.resize(bytes.size() + 8);
  EXPECT_TRUE(decode_pcd(bytes, "t").ok());
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(decode_pcd(std::span(bytes).first(n), "t").ok()) << n;
}

TEST(Pcd, ReadsTheRealCloud) {
  HUELINE_REQUIRE_DATA("lidar_camera/0.pcd");
  const auto cloud = read_pcd(data_file);
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->points(), 78238u);
  EXPECT_NEAR(cloud->column("x")[0], 21.647913, 1e-9);
  EXPECT_EQ(cloud->column("intensity")[0], 11);
}

}  // namespace
}  // namespace hueline::storage
