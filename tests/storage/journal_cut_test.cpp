// Recordings that ended badly: the program was killed, the file was cut at any byte, or it is damaged in the middle.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::contents;
using test::same;
using test::sample_header;
using test::sample_packets;
using test::TemporaryFolder;
using test::time_of;
using test::write_file;

struct Recording {
  std::string bytes;
  std::vector<Packet> packets;
  // First byte behind the chunk record, number of packets up to it.
  std::vector<std::pair<std::size_t, std::size_t>> chunks;
};

/// Makes a recording with small chunks. The flushes show where the chunks end, not the reader under test.
Recording make_recording(const std::filesystem::path& path) {
  Recording r;
  r.packets = sample_packets(21, 4200);
  JournalWriter::Config config;
  config.chunk_bytes = 1 << 20;
  config.chunk_time = std::chrono::hours(1);
  auto writer = JournalWriter::create(path, sample_header(), config);
  EXPECT_TRUE(writer);
  std::uint64_t before = writer->bytes_written();
  for (std::size_t i = 0; i < r.packets.size(); ++i) {
    EXPECT_TRUE(writer->append(r.packets[i], time_of(r.packets[i])));
    if (i % 3 != 2) continue;
    EXPECT_TRUE(writer->flush());
    const std::string so_far = contents(path);
    std::uint64_t length = 0;
    std::memcpy(&length, so_far.data() + before + 1, 8);
    r.chunks.emplace_back(before + 9 + length, i + 1);
    before = writer->bytes_written();
  }
  EXPECT_TRUE(writer->close());
  r.bytes = contents(path);
  return r;
}

TEST(CutJournal, GivesAllWholeChunksWhereverItIsCut) {
  const TemporaryFolder folder;
  const Recording r = make_recording(folder / "whole.mcap");
  ASSERT_GT(r.chunks.size(), 5u);
  const auto path = folder / "cut.mcap";
  write_file(path, r.bytes);
  std::size_t unopened = 0;
  for (std::size_t size = r.bytes.size(); size-- > 0;) {
    std::filesystem::resize_file(path, size);
    std::size_t expected = 0;
    for (const auto& [end, packets] : r.chunks)
      if (size >= end) expected = packets;
    auto reader = JournalReader::open(path);
    if (!reader) {
      ASSERT_EQ(expected, 0u) << "cut at " << size << ": " << reader.error().message;
      ASSERT_EQ(reader.error().code, ErrorCode::Truncated) << "cut at " << size << ": " << reader.error().message;
      ++unopened;
      continue;
    }
    std::size_t read = 0;
    while (true) {
      const auto packet = (*reader)->next({});
      if (!packet) {
        // Behind the last chunk all packets are there, and the missing end is still reported.
        ASSERT_EQ(packet.error().code, ErrorCode::Truncated) << "cut at " << size << ": " << packet.error().message;
        break;
      }
      ASSERT_TRUE(same(*packet, r.packets[read])) << "cut at " << size << ", packet " << read;
      ++read;
    }
    ASSERT_GE(read, expected) << "cut at " << size;
    if (size < r.chunks.back().first) {
      ASSERT_EQ(read, expected) << "cut at " << size;
    }
  }
  EXPECT_LT(unopened, 4096u) << "only a cut inside the header may prevent opening";
}

TEST(CutJournal, TellsADamagedChunkAndGoesOnBehindIt) {
  const TemporaryFolder folder;
  const Recording r = make_recording(folder / "whole.mcap");
  std::string bytes = r.bytes;
  bytes[r.chunks[2].first - 100] = static_cast<char>(bytes[r.chunks[2].first - 100] ^ 0x10);
  write_file(folder / "damaged.mcap", bytes);
  auto reader = JournalReader::open(folder / "damaged.mcap");
  ASSERT_TRUE(reader);
  std::size_t read = 0, damaged = 0;
  while (true) {
    const auto packet = (*reader)->next({});
    if (packet) {
      if (read == r.chunks[1].second) read = r.chunks[2].second;
      ASSERT_TRUE(same(*packet, r.packets[read]));
      ++read;
    } else if (packet.error().code == ErrorCode::Malformed) {
      EXPECT_NE(packet.error().message.find("wrong CRC"), std::string::npos) << packet.error().message;
      ++damaged;
    } else {
      EXPECT_EQ(packet.error().code, ErrorCode::EndOfData) << packet.error().message;
      break;
    }
  }
  EXPECT_EQ(damaged, 1u);
  EXPECT_EQ(read, r.packets.size());
}

TEST(CutJournal, NoticesAnyFlippedByte) {
  const TemporaryFolder folder;
  const Recording r = make_recording(folder / "whole.mcap");
  const auto path = folder / "damaged.mcap";
  for (std::size_t at = 0; at < r.bytes.size(); at += 131) {
    std::string bytes = r.bytes;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x40);
    write_file(path, bytes);
    auto reader = JournalReader::open(path);
    bool noticed = !reader;
    int told = 0;
    while (reader) {
      const auto packet = (*reader)->next({});
      if (packet) continue;
      if (packet.error().code == ErrorCode::EndOfData) break;
      noticed = true;
      if (packet.error().code == ErrorCode::Truncated) break;
      ASSERT_LT(++told, 10) << "damage must be told once, not for ever; byte " << at;
    }
    EXPECT_TRUE(noticed) << "byte " << at << " of " << r.bytes.size();
  }
}

TEST(CutJournal, ReadsWhatAKilledWriterLeft) {
  const TemporaryFolder folder;
  const auto packets = sample_packets(50);
  const auto path = folder / "killed.mcap";
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    JournalWriter::Config config;
    config.chunk_bytes = 32 * 1024;
    auto writer = JournalWriter::create(path, sample_header(), config);
    for (const Packet& p : packets)
      if (!writer->append(p, time_of(p))) ::_exit(1);
    ::_exit(writer->flush() ? 0 : 1);  // without close(), as SIGKILL leaves it
  }
  int result = 0;
  ASSERT_EQ(::waitpid(child, &result, 0), child);
  ASSERT_EQ(result, 0);
  auto reader = JournalReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  for (const Packet& p : packets) {
    const auto packet = (*reader)->next({});
    ASSERT_TRUE(packet) << packet.error().message;
    EXPECT_TRUE(same(*packet, p));
  }
  const auto end = (*reader)->next({});
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::Truncated);
  EXPECT_NE(end.error().message.find("byte " + std::to_string(std::filesystem::file_size(path))), std::string::npos)
      << end.error().message;
}

}  // namespace
}  // namespace hueline::storage
