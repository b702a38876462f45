// Reads any bytes as a recording: no crash, no endless loop, and everything that is returned lies inside the file's
// size.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "storage/crc32.hpp"
#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "storage/packed_rows.hpp"
#include "tests/storage/fuzz_file.hpp"
#include "tests/storage/sample_packets.hpp"

namespace {

using namespace hueline;
using namespace hueline::storage;

/// Returns an edited recording. The fuzzer's bytes would hardly ever form an MCAP file, so they are edits (offset,
/// byte) of a small whole recording. The CRCs of its chunks are then corrected, and that of its summary is left out, so
/// that the edits reach the records inside.
std::string edited(std::string file, const std::uint8_t* data, std::size_t size) {
  if (size) test::edit(file, data + 1, size - 1, data[0] % 12u);
  return file;
}

void mend_crcs(std::string& file) {
  constexpr std::size_t kTail = 4 + kMcapMagic.size();  // the CRC of the summary, and the end mark
  if (file.size() >= kTail) std::fill_n(file.end() - kTail, 4, char{0});
  for (std::size_t at = kMcapMagic.size(); at + kMcapRecordHead <= file.size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, file.data() + at + 1, sizeof length);
    if (length > file.size() - at - kMcapRecordHead) return;
    constexpr std::size_t kCrcAt = kMcapRecordHead + 24,
                          kRecordsAt = kCrcAt + 4 + 4 + 8;  // no compression: an empty name
    if (file[at] == 0x06 && length >= kRecordsAt - kMcapRecordHead) {
      const std::uint32_t crc = crc32(
          0, as_bytes(file).subspan(at + kRecordsAt, static_cast<std::size_t>(length) + kMcapRecordHead - kRecordsAt));
      std::memcpy(file.data() + at + kCrcAt, &crc, sizeof crc);
    }
    at += kMcapRecordHead + static_cast<std::size_t>(length);
  }
}

std::string small_recording(Compression compression) {
  const test::WrittenFile file;
  JournalWriter::Config config;
  config.compression = compression;
  config.chunk_bytes = 8192;
  config.if_exists = IfExists::Replace;
  auto writer = JournalWriter::create(file.path(), test::sample_header(), config);
  for (const Packet& p : test::sample_packets(30, 5000))
    if (!writer || !writer->append(p, test::time_of(p))) std::abort();
  if (!writer->close()) std::abort();
  return file.contents();
}

/// This is global, so that the compiler does not leave out the reading.
std::uint64_t read_bytes = 0;

/// Reads what is asked for: empty, all; else what holds packets of these sensors, by the index.
void read_all(const std::string& bytes, const std::vector<SensorId>& only = {}) {
  const test::MemoryFile file(bytes);
  auto reader = JournalReader::open(file.path());
  if (!reader) return;
  (*reader)->read_only(only);
  std::uint64_t touched = 0, errors = 0;
  while (true) {
    const auto packet = (*reader)->next({});
    if (packet) {
      for (const std::byte b : packet->bytes.bytes()) touched += static_cast<std::uint8_t>(b);
    } else if (packet.error().code != ErrorCode::Malformed || ++errors > bytes.size()) {
      break;
    }
  }
  if (errors > bytes.size()) std::abort();  // each damaged record is reported once
  read_bytes += touched;
}

}  // namespace

std::uint64_t fuzz_read_bytes() { return read_bytes; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string plain = small_recording(Compression::None), packed = small_recording(Compression::Zstd),
                           packed_lz4 = small_recording(Compression::Lz4);
  if (size < 1) return 0;
  std::string file = edited(data[0] % 4 == 0 ? packed : data[0] % 4 == 1 ? packed_lz4 : plain, data + 1, size - 1);
  if (data[0] % 4 == 3) mend_crcs(file);
  read_all(file);
  read_all(file, {1, 3});
  if (const auto image = unpack_rows(std::as_bytes(std::span(data, size))); image.ok())
    for (const std::byte b : image->payload.bytes()) read_bytes += static_cast<std::uint8_t>(b);
  read_all(std::string(reinterpret_cast<const char*>(kMcapMagic.data()), kMcapMagic.size()) +
           std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
