#include "storage/scan_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "storage/scan_cloud_writer.hpp"

namespace hueline::storage {
namespace {

namespace fs = std::filesystem;

fs::path file_of(const std::string& name, const std::string& bytes) {
  const fs::path path = fs::path(testing::TempDir()) / name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

/// Returns points that fill several blocks and are exact in float, in millimetres and as text.
std::vector<float> some_points(std::size_t count) {
  std::vector<float> xyz;
  for (std::size_t i = 0; i < 3 * count; ++i)
    xyz.push_back(static_cast<float>(static_cast<int>(i * 7919 % 400'003) - 200'000) / 1024.0f);
  return xyz;
}

template <class T>
std::string bytes_of(const std::vector<float>& xyz, bool big_endian, std::size_t extra) {
  std::string out;
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    char raw[sizeof(T)];
    const T value = xyz[i];
    std::memcpy(raw, &value, sizeof value);
    if (big_endian) std::reverse(raw, raw + sizeof raw);
    out.append(raw, sizeof raw);
    if (i % 3 == 2) out.append(extra, '\7');
  }
  return out;
}

std::string text_of(const std::vector<float>& xyz, const char* separator, const char* more) {
  std::string out;
  char number[32];
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    std::snprintf(number, sizeof number, "%.10g", static_cast<double>(xyz[i]));
    out += number;
    out += i % 3 == 2 ? std::string(more) + "\n" : std::string(separator);
  }
  return out;
}

std::vector<float> all(const ScanFile& scan) {
  std::vector<float> out;
  std::vector<std::byte> scratch;
  for (std::size_t i = 0; i < scan.blocks(); ++i) {
    const auto block = scan.block(i, scratch);
    EXPECT_TRUE(block.ok()) << block.error().message;
    if (block.ok()) out.insert(out.end(), block->begin(), block->end());
  }
  return out;
}

void expect_read(const fs::path& path, const std::vector<float>& wanted, const std::string& words, double within = 0) {
  const auto scan = ScanFile::open(path);
  ASSERT_TRUE(scan.ok()) << scan.error().message;
  EXPECT_NE(scan->layout().words.find(words), std::string::npos) << scan->layout().words;
  const auto got = all(*scan);
  ASSERT_EQ(got.size(), wanted.size()) << path;
  for (std::size_t i = 0; i < got.size(); ++i) ASSERT_NEAR(got[i], wanted[i], within) << path << " value " << i;
}

constexpr std::size_t kPoints = 200'000;

TEST(ScanFile, ReadsEveryFormatBlockByBlock) {
  const auto xyz = some_points(kPoints);
  const std::string count = std::to_string(kPoints);
  expect_read(file_of("a.f32", bytes_of<float>(xyz, false, 0)), xyz, "float32");
  const std::string ply = "element vertex " + count + "\nproperty uchar red\nproperty ";
  const auto vertices = [&](const std::string& encoding, const std::string& type) {
    return "ply\nformat " + encoding + " 1.0\ncomment made here\nelement vertex " + count + "\nproperty " + type +
           " x\nproperty " + type + " y\nproperty " + type +
           " z\nproperty uchar red\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n";
  };
  expect_read(file_of("b.ply", vertices("binary_little_endian", "float") + bytes_of<float>(xyz, false, 1)), xyz,
              "binary_little_endian, float");
  expect_read(file_of("c.ply", vertices("binary_big_endian", "double") + bytes_of<double>(xyz, true, 1)), xyz,
              "binary_big_endian, double");
  expect_read(file_of("d.ply", vertices("ascii", "float32") + text_of(xyz, " ", " 255")), xyz, "ascii");
  const std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " + count +
      "\nHEIGHT 1\nPOINTS " + count + "\nDATA ";
  expect_read(file_of("e.pcd", pcd + "binary\n" + bytes_of<float>(xyz, false, 4)), xyz, "PCD binary");
  expect_read(file_of("f.pcd", pcd + "ascii\n" + text_of(xyz, " ", " 0.5")), xyz, "PCD ascii");
  expect_read(file_of("g.xyz", "x,y,z,intensity\n" + text_of(xyz, ",", ",17")), xyz, "text");
  expect_read(file_of("h.txt", "# a comment\n" + text_of(xyz, "\t", "")), xyz, "text");
}

TEST(ScanFile, ReadsTheLasThatTheWriterWrites) {
  const auto xyz = some_points(kPoints);
  const fs::path path = fs::path(testing::TempDir()) / "w.las";
  auto writer = ScanCloudWriter::create(path, ScanCloudWriter::Format::Las, {1000, 2000, 30}, {2026, 3, 1, 0, 0, 0, 0});
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  const std::vector<double> values(xyz.begin(), xyz.end());
  ASSERT_TRUE(writer->append(std::span(values).first(3 * 77'777)).ok());
  ASSERT_TRUE(writer->append(std::span(values).subspan(3 * 77'777)).ok());
  ASSERT_TRUE(writer->close().ok());
  auto wanted = xyz;
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] += i % 3 == 0 ? 1000.0f : i % 3 == 1 ? 2000.0f : 30.0f;
  expect_read(path, wanted, "LAS 1.4, point format 6", 0.0007);
}

/// A millimetre between points of a map, in each kind of number that can hold it, and one without a return.
TEST(ScanFile, KeepsMillimetresOfAMapFromAnOrigin) {
  constexpr std::array<double, 3> kOrigin{500'000, 5'300'000, 400};
  const auto expect_near = [&](const fs::path& path, bool has_missing) {
    const auto scan = ScanFile::open(path, {}, kOrigin);
    ASSERT_TRUE(scan.ok()) << scan.error().message;
    const auto got = all(*scan);
    ASSERT_EQ(got.size(), has_missing ? 9u : 6u) << path;
    for (const std::size_t i : {0, 1}) {
      EXPECT_NEAR(got[3 * i], 1.001 + 0.001 * static_cast<double>(i), 1e-6) << path;
      EXPECT_NEAR(got[3 * i + 1], -2, 1e-6) << path;
      EXPECT_NEAR(got[3 * i + 2], 0.25, 1e-6) << path;
    }
    if (has_missing) {
      EXPECT_TRUE(std::isnan(got[6]) && std::isnan(got[8])) << path;
    }
  };
  const std::vector<double> places{500001.001, 5299998, 400.25, 500001.002, 5299998, 400.25, 0, 0, 0};
  std::string bytes(reinterpret_cast<const char*>(places.data()), places.size() * sizeof(double));
  expect_near(file_of("map.xyz", "500001.001 5299998 400.25\n500001.002 5299998 400.25\n0 0 0\n"), true);
  const std::string head = "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nPOINTS 3\nDATA ";
  expect_near(file_of("map.pcd", head + "binary\n" + bytes), true);
  std::string packed;  // bytes that stand for themselves, column by column
  const auto put_size = [&](std::uint32_t size) { packed.append(reinterpret_cast<const char*>(&size), sizeof size); };
  put_size(75), put_size(72);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    packed += static_cast<char>(23);
    for (std::size_t i = 0; i < 3; ++i) packed += bytes.substr(8 * (3 * i + axis), 8);
  }
  expect_near(file_of("map_packed.pcd", head + "binary_compressed\n" + packed), true);
  const fs::path las = fs::path(testing::TempDir()) / "map.las";
  auto writer = ScanCloudWriter::create(las, ScanCloudWriter::Format::Las, kOrigin, {2026, 3, 1, 0, 0, 0, 0});
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  ASSERT_TRUE(writer->append(std::vector<double>{1.001, -2, 0.25, 1.002, -2, 0.25}).ok());
  ASSERT_TRUE(writer->close().ok());
  expect_near(las, false);
}

TEST(ScanFile, SaysWhatItCannotRead) {
  const auto why = [](const fs::path& path) {
    const auto scan = ScanFile::open(path);
    return scan.ok() ? std::string() : scan.error().message;
  };
  EXPECT_NE(why(file_of("x.dat", "something")).find("--format"), std::string::npos);
  EXPECT_NE(why(file_of("x.f32", std::string(25, 'a'))).find("25 bytes are no whole number"), std::string::npos);
  EXPECT_NE(why(file_of("x.ply",
                        "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nproperty float "
                        "y\nproperty float z\nend_header\nabc"))
                .find("holds 0 of the 9 points"),
            std::string::npos);
  EXPECT_NE(why(fs::path(testing::TempDir()) / "nowhere.f32").find("nowhere.f32"), std::string::npos);
  const auto broken = ScanFile::open(file_of("broken.xyz", "1 2 3\n4 5 six\n"));
  ASSERT_TRUE(broken.ok());
  std::vector<std::byte> scratch;
  const auto block = broken->block(0, scratch);
  ASSERT_FALSE(block.ok());
  EXPECT_NE(block.error().message.find("byte 6: '4 5 six'"), std::string::npos) << block.error().message;
}

}  // namespace
}  // namespace hueline::storage
