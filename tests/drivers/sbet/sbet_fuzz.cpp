// Reads any bytes as an SBET with any bytes as its SMRMSG, and small files with edits: no crash, no endless loop,
// records in order of time, and each byte of the file counted once.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "drivers/trajectory/sbet_file.hpp"
#include "tests/storage/fuzz_file.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

void require(bool holds) {
  if (!holds) std::abort();
}

void put(std::string& file, double value) { file.append(reinterpret_cast<const char*>(&value), sizeof value); }

constexpr int kRecords = 6;

std::string small_sbet() {
  std::string file;
  for (int i = 0; i < kRecords; ++i)
    for (const double value : {302400.0 + 0.005 * i, 0.84, 0.2, 500.0 + i, 10.0, 0.0, 0.0, 0.01, 0.02, 1.5, 0.1, 0.0,
                               0.0, 9.8, 0.0, 0.0, 0.1})
      put(file, value);
  return file;
}

std::string small_smrmsg() {
  std::string file;
  for (int i = 0; i < kRecords; ++i)
    for (const double value : {302400.0 + 0.005 * i, 0.02, 0.02, 0.03, 0.01, 0.01, 0.01, 0.5, 0.5, 1.0})
      put(file, value);
  return file;
}

void read_all(const std::string& sbet, const std::string& smrmsg) {
  const test::MemoryFile poses(sbet), accuracies(smrmsg);
  auto file = SbetFile::open(poses.path().string(), accuracies.path().string());
  if (!file.ok()) return require(!file.error().message.empty());
  std::uint64_t records = 0;
  double last = -INFINITY;
  for (;;) {
    const auto record = file->next();
    if (!record.ok()) {
      require(!record.error().message.empty());
      if (record.error().code != ErrorCode::EndOfData) return;
      break;
    }
    ++records;
    require(record->second > last);
    last = record->second;
    if (record->sigma)
      for (const double sigma : *record->sigma) require(!(sigma < 0));
  }
  const SbetFile::Counts& counts = file->counts();
  require(counts.records == records);
  require((counts.records + counts.out_of_order + counts.impossible) * kSbetBytes + counts.bytes_at_end == sbet.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string whole_sbet = small_sbet(), whole_smrmsg = small_smrmsg();
  const std::string any(reinterpret_cast<const char*>(data), size);
  read_all(any, any.substr(size / 2));
  read_all(whole_sbet, any);
  if (size == 0) return 0;
  std::string sbet = whole_sbet, smrmsg = whole_smrmsg;
  test::edit(sbet, data + 1, size - 1, data[0] % 8);
  test::edit(smrmsg, data + size / 2, size - size / 2, data[0] / 8 % 8);
  sbet.resize(sbet.size() - (data[0] / 64) * 50u);  // the end is cut off
  read_all(sbet, smrmsg);
  return 0;
}
