// Reads any bytes as a cloud: PCD, PLY, PTX, rows of floats and of text, and as a scan of each format. No crash, no
// endless loop, and no more points than the bytes can hold. Then whole files of each kind with edits, which reach
// further code.
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "storage/cloud_file.hpp"
#include "storage/pcd_reader.hpp"
#include "storage/scan_file.hpp"
#include "storage/text_cloud.hpp"
#include "tests/storage/fuzz_file.hpp"
#include "tests/storage/small_e57.hpp"

namespace {

using namespace hueline;
using namespace hueline::storage;

template <class T>
void put(std::string& file, T value) {
  file.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// An E57, whose edits are found by its check sums: of what has a right one, e57_test.cpp has the kinds of damage.
std::string small_e57() {
  test::SmallE57 out;
  const std::string place = test::SmallE57::numbers<double>({1, 2});
  const std::uint64_t at = out.section({test::SmallE57::packet({place, place, place})});
  return out.file("<e57Root><data3D><vectorChild><points fileOffset=\"" + std::to_string(at) +
                  "\" recordCount=\"2\"><prototype><cartesianX type=\"Float\"/><cartesianY type=\"Float\"/>"
                  "<cartesianZ type=\"Float\"/></prototype></points></vectorChild></data3D></e57Root>");
}

/// Small files of each kind.
std::vector<std::string> small_files() {
  const std::string pcd_fields = "VERSION 0.7\nFIELDS x y z intensity ring\nSIZE 4 4 4 4 2\nTYPE F F F F U\n";
  const std::string ply_fields =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nend_header\n";
  std::string rows;
  for (int i = 0; i < 3; ++i) {
    for (const float value : {1.0f, 2.0f, 3.0f, 0.5f}) put(rows, value + static_cast<float>(i));
    put(rows, static_cast<std::uint16_t>(i));
  }
  std::string packed;  // bytes that stand for themselves, each up to 32 of them behind their number less one
  for (std::size_t at = 0; at < rows.size(); at += 32) {
    const std::string piece = rows.substr(at, 32);
    packed += static_cast<char>(piece.size() - 1);
    packed += piece;
  }
  std::string sizes;
  put(sizes, static_cast<std::uint32_t>(packed.size()));
  put(sizes, static_cast<std::uint32_t>(rows.size()));
  std::string vertices;
  for (int i = 0; i < 3; ++i) {
    for (const float value : {1.0f, 2.0f, 3.0f}) put(vertices, value);
    vertices += 'r';
  }
  return {pcd_fields + "WIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n1 2 3 0.5 0\n2 nan 4 1 1\n3 4 5 2 2\n",
          pcd_fields + "POINTS 3\nDATA binary\n" + rows,
          pcd_fields + "POINTS 3\nDATA binary_compressed\n" + sizes + packed,
          "ply\nformat ascii 1.0\n" + ply_fields + "1 2 3 4\n2 3 4 5\n3 4 5 6\n",
          "ply\nformat binary_little_endian 1.0\n" + ply_fields + vertices,
          "ply\nformat binary_big_endian 1.0\n" + ply_fields + vertices,
          "//X Y Z I\n3\n1 2 3 4\n2.5 3 4 5\n-3 4e1 5 6\n",
          "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n7 8 9 1\n1 2 3 0.5\n0 0 0 0.5\n",
          small_e57()};
}

void require(bool holds) {
  if (!holds) std::abort();
}

/// A value of any kind takes a byte at least, and one of a packed file a 264th: LZF repeats up to 264 bytes by three.
void check(const Result<PcdCloud>& cloud, std::size_t bytes) {
  if (!cloud.ok()) return require(!cloud.error().message.empty());
  for (const std::vector<double>& column : cloud->columns) require(column.size() == cloud->points());
  require(cloud->types.size() == cloud->columns.size() && cloud->fields.size() == cloud->columns.size());
  require(cloud->points() * cloud->columns.size() <= 264 * bytes);
}

void check_scan(const std::filesystem::path& path, std::optional<ScanFormat> format, std::size_t bytes) {
  const auto scan = ScanFile::open(path, format);
  if (!scan.ok()) return require(!scan.error().message.empty());
  std::vector<std::byte> scratch;
  std::size_t points = 0;
  for (std::size_t i = 0; i < scan->blocks(); ++i) {
    const auto block = scan->block(i, scratch);
    if (!block.ok()) break;
    require(block->size() % 3 == 0);
    points += block->size() / 3;
  }
  require(points <= 264 * bytes);
}

void read_all(const std::string& file) {
  const auto bytes = std::as_bytes(std::span(file));
  check(decode_pcd(bytes, "fuzz"), bytes.size());
  check(decode_ply(bytes, "fuzz"), bytes.size());
  check(decode_float_rows(bytes, "fuzz"), bytes.size());
  check(decode_npy(bytes, "fuzz"), bytes.size());
  check(decode_text_cloud(file, "fuzz"), bytes.size());
  for (const PtxFrame frame : {PtxFrame::Scanner, PtxFrame::File}) check(decode_ptx(file, "fuzz", frame), bytes.size());
  const test::MemoryFile in_memory(file);
  check_scan(in_memory.path(), {}, bytes.size());
  for (const ScanFormat format : {ScanFormat::Text, ScanFormat::Float32, ScanFormat::Las, ScanFormat::E57})
    check_scan(in_memory.path(), format, bytes.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::string> files = small_files();
  read_all(std::string(reinterpret_cast<const char*>(data), size));
  if (size == 0) return 0;
  std::string file = files[data[0] % files.size()];
  test::edit(file, data + 1, size - 1, data[0] / files.size() % 8);
  read_all(file);
  return 0;
}
