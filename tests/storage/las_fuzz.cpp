// Reads any bytes as a LAS or LAZ file: no crash, no endless loop. Then it reads a whole cloud with edits, which
// reaches further code.
#include <cstdint>

#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
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
  static const std::string las = small_cloud(false), laz = small_cloud(true);
  std::string file = size && data[0] & 0x80 ? laz : las;
  if (size) test::edit(file, data + 1, size - 1, data[0] % 12u);
  read_all(file);
  read_all(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
