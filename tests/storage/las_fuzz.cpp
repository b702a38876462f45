// Reads any bytes as a LAS or LAZ file: no crash, no endless loop. Then it reads a whole cloud with edits, which
// reaches further code.
#include <cstdint>

#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "storage/laz_format.hpp"
#include "tests/storage/fuzz_file.hpp"
#include "tests/storage/sample_cloud.hpp"

namespace {

using namespace hueline;
using namespace hueline::storage;

std::string small_cloud(bool compress) {
  const test::WrittenFile file;
  LasWriter::Config config;
  config.format = compress ? CloudFormat::Laz : CloudFormat::Las;
  config.header_every = LasWriter::Config::kOnlyAtTheEnd;
  auto writer = LasWriter::create(file.path(), test::sample_origin(), config);
  if (!writer || !writer->append(test::sample_cloud(20)) || !writer->close()) std::abort();
  return file.contents();
}

/// A LAZ file of 300 points in which any byte takes any value, so with all scanner channels where the format has them.
std::string wild_cloud(const LazRecord& kind) {
  Bytes records(300 * kind.size);
  std::uint32_t state = 1;
  for (std::byte& b : records) b = static_cast<std::byte>((state = state * 1664525 + 1013904223) >> 24);
  LasHeader header;
  Bytes records_in_front;
  append_vlr(records_in_front, laz_vlr(kind, kLazChunkPoints));
  header.header_size = kLasHeaderSize14;
  header.vlr_count = 1;
  header.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + records_in_front.size());
  header.point_format = static_cast<std::uint8_t>(kind.format | kLazFlag);
  header.point_size = static_cast<std::uint16_t>(kind.size);
  header.point_count = 300;
  Bytes file = encode_las_header(header);
  append(file, records_in_front);
  const Bytes chunk = encode_laz_chunk(records, kind);
  append(file, std::uint64_t{file.size() + sizeof(std::uint64_t) + chunk.size()});
  append(file, chunk);
  append(file, encode_laz_table({{chunk.size(), 300}}, false));
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

/// This is global, so that the compiler does not leave out the reading.
double read_sum = 0;

void read_all(const std::string& bytes) {
  const test::MemoryFile file(bytes);
  auto reader = LasReader::open(file.path());
  if (!reader) return;
  double sum = 0;
  std::size_t read = 0;
  std::vector<LasPoint> points;
  while (reader->next(points, 1000) && !points.empty()) {
    read += points.size();
    for (const LasPoint& p : points) {
      sum += p.x + p.time.value_or(0);
      for (const LasExtraField& field : reader->extra_fields()) sum += LasReader::extra(p, field);
      if (const auto time = reader->gps_time(p)) sum += static_cast<double>(count_ns(*time));
    }
  }
  // more points than the bytes can hold
  if (!reader->is_compressed() && read * reader->header().point_size > bytes.size()) std::abort();
  read_sum += sum + static_cast<double>(reader->wkt().size());
}

}  // namespace

double fuzz_read_sum() { return read_sum; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string seeds[] = {small_cloud(false), small_cloud(true), wild_cloud({3, 36}), wild_cloud({8, 40})};
  std::string file = seeds[size ? data[0] >> 6 : 0];
  if (size) test::edit(file, data + 1, size - 1, data[0] % 12u);
  read_all(file);
  read_all(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
