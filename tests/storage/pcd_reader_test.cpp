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
  const auto cloud = decode_pcd(
      bytes_of("# c\nVERSION .7\nFIELDS x n\nSIZE 4 4\nTYPE F F\nCOUNT 1 2\nPOINTS 2\nDATA ascii\n1 2 3\n4 nan 6\n"),
      "t");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->points(), 2u);
  EXPECT_EQ(cloud->columns.size(), 3u);
  EXPECT_EQ(cloud->column("x")[1], 4);
  EXPECT_TRUE(std::isnan(cloud->column("n")[1]));
  EXPECT_TRUE(cloud->column("intensity").empty());
}

TEST(Pcd, ReadsCompressedColumns) {
  // Two points with x = 1, 1 (u8) and y = 7, 8 (u16), stored by columns, as LZF literals with control byte n - 1.
  std::string text = "FIELDS x y\nSIZE 1 2\nTYPE U U\nPOINTS 2\nDATA binary_compressed\n";
  auto bytes = bytes_of(text);
  for (int b : {7, 0, 0, 0, 6, 0, 0, 0, 5, 1, 1, 7, 0, 8, 0}) bytes.push_back(static_cast<std::byte>(b));
  const auto cloud = decode_pcd(bytes, "t");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->column("x")[1], 1);
  EXPECT_EQ(cloud->column("y")[0], 7);
  EXPECT_EQ(cloud->column("y")[1], 8);
}

/// PCL writes such a header for a structure with gaps: x y z, 4 bytes of padding, intensity, 0 bytes of padding, ring,
/// 6 bytes of padding.
constexpr const char* kPadded =
    "VERSION 0.7\nFIELDS x y z _ intensity _ ring _\nSIZE 4 4 4 1 4 1 2 1\nTYPE F F F U F U U U\nCOUNT 1 1 1 4 1 0 1 "
    "6\n";

template <class T>
void put(std::vector<std::byte>& bytes, T value) {
  for (const std::byte byte : std::as_bytes(std::span(&value, 1))) bytes.push_back(byte);
}

void expect_padded(const Result<PcdCloud>& cloud) {
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->fields, (std::vector<std::string>{"x", "y", "z", "intensity", "ring"}));
  ASSERT_EQ(cloud->points(), 2u);
  EXPECT_EQ(cloud->column("x")[1], 11);
  EXPECT_EQ(cloud->column("z")[0], 3);
  EXPECT_EQ(cloud->column("intensity")[1], 14.5);
  EXPECT_EQ(cloud->column("ring")[0], 5);
  EXPECT_EQ(cloud->column("ring")[1], 15);
}

TEST(Pcd, PassesOverPaddingOfRows) {
  auto bytes = bytes_of(std::string(kPadded) + "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary\n");
  for (const float base : {0.0F, 10.0F}) {
    for (const float axis : {1.0F, 2.0F, 3.0F}) put(bytes, base + axis);
    put(bytes, std::uint32_t{0xDEADBEEF});
    put(bytes, base + 4.5F);
    put(bytes, static_cast<std::uint16_t>(base + 5));
    for (int i = 0; i < 6; ++i) put(bytes, std::uint8_t{0xEE});
  }
  expect_padded(decode_pcd(bytes, "t"));
}

TEST(Pcd, PassesOverPaddingOfCompressedColumns) {
  std::vector<std::byte> columns;
  for (const float axis : {1.0F, 11.0F, 2.0F, 12.0F, 3.0F, 13.0F}) put(columns, axis);
  for (int i = 0; i < 8; ++i) put(columns, std::uint8_t{0xEE});
  for (const float value : {4.5F, 14.5F}) put(columns, value);
  for (const std::uint16_t ring : {std::uint16_t{5}, std::uint16_t{15}}) put(columns, ring);
  for (int i = 0; i < 12; ++i) put(columns, std::uint8_t{0xEE});
  std::vector<std::byte> packed;  // only literals, in runs of at most 32
  for (std::size_t at = 0; at < columns.size(); at += 32) {
    const auto run = std::span(columns).subspan(at, std::min<std::size_t>(32, columns.size() - at));
    packed.push_back(static_cast<std::byte>(run.size() - 1));
    packed.insert(packed.end(), run.begin(), run.end());
  }
  auto bytes = bytes_of(std::string(kPadded) + "POINTS 2\nDATA binary_compressed\n");
  put(bytes, static_cast<std::uint32_t>(packed.size()));
  put(bytes, static_cast<std::uint32_t>(columns.size()));
  bytes.insert(bytes.end(), packed.begin(), packed.end());
  expect_padded(decode_pcd(bytes, "t"));
}

TEST(Pcd, PassesOverPaddingOfLines) {
  expect_padded(decode_pcd(
      bytes_of(std::string(kPadded) +
               "POINTS 2\nDATA ascii\n1 2 3 0 0 0 0 4.5 5 0 0 0 0 0 0\n11 12 13 9 9 9 9 14.5 15 9 9 9 9 9 nan\n"),
      "t"));
}

TEST(Pcd, ReadsEveryTypeThatTheFormatHas) {
  auto bytes = bytes_of(
      "FIELDS a b c d e f g h i j\nSIZE 1 2 4 8 1 2 4 8 4 8\nTYPE I I I I U U U U F F\nWIDTH 1\nHEIGHT 1\nDATA "
      "binary\n");
  put(bytes, std::int8_t{-1}), put(bytes, std::int16_t{-2}), put(bytes, std::int32_t{-3}), put(bytes, std::int64_t{-4});
  put(bytes, std::uint8_t{255}), put(bytes, std::uint16_t{65535}), put(bytes, std::uint32_t{4'000'000'000}),
      put(bytes, std::uint64_t{1} << 50);
  put(bytes, 0.5F), put(bytes, 0.1);
  const auto cloud = decode_pcd(bytes, "t");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  ASSERT_EQ(cloud->points(), 1u);
  const double wanted[] = {-1, -2, -3, -4, 255, 65535, 4e9, 1125899906842624.0, 0.5, 0.1};
  for (std::size_t i = 0; i < std::size(wanted); ++i) EXPECT_EQ(cloud->columns[i][0], wanted[i]) << cloud->fields[i];
}

/// A file is refused for what its header says, not for the memory that is free or the time that it would take.
TEST(Pcd, RefusesMoreThanItsLimitsAndNamesThem) {
  const auto said = [](const std::string& text) {
    const auto cloud = decode_pcd(bytes_of(text), "t");
    return cloud.ok() ? std::string("read") : cloud.error().message;
  };
  std::string fields = "FIELDS", sizes = "SIZE", types = "TYPE";
  for (int i = 0; i < 5000; ++i) fields += " a", sizes += " 1", types += " U";
  EXPECT_NE(said(fields + "\n" + sizes + "\n" + types + "\nPOINTS 0\nDATA binary\n")
                .find("5000 columns; clouds of at most 4096 are read"),
            std::string::npos);
  EXPECT_NE(said("FIELDS" + std::string(16'000'000, ' ') + "x\n").find("no DATA line within its first 64 kB"),
            std::string::npos);
  EXPECT_NE(said("FIELDS x\nSIZE 4\nTYPE F\nCOUNT 5000\nPOINTS 1\nDATA binary\n")
                .find("COUNT is '5000'; allowed: a whole number from 0 to 4096"),
            std::string::npos);
  EXPECT_NE(said("FIELDS x\nSIZE 4\nTYPE F\nPOINTS 1900000000\nDATA ascii\n").find("at most 500000000 values are read"),
            std::string::npos);
  EXPECT_NE(said("FIELDS x y\nSIZE 4\nTYPE F F\nPOINTS 1\nDATA ascii\n")
                .find("FIELDS names 2 fields, SIZE has 1, TYPE 2 and COUNT 2"),
            std::string::npos);
  EXPECT_NE(said("FIELDS x\nSIZE 3\nTYPE F\nPOINTS 1\nDATA ascii\n").find("field x: type F of 3 bytes"),
            std::string::npos);
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
