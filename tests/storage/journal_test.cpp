#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "storage/raw_packet.hpp"
#include "storage_proto/hueline/RawPacket.pb.h"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::same;
using test::sample_header;
using test::sample_packets;
using test::TemporaryFolder;
using test::time_of;

void record(const std::filesystem::path& path, const std::vector<Packet>& packets, JournalWriter::Config config = {}) {
  auto writer = JournalWriter::create(path, sample_header(), config);
  ASSERT_TRUE(writer) << writer.error().message;
  for (const Packet& p : packets) ASSERT_TRUE(writer->append(p, time_of(p)));
  const Status closed = writer->close();
  ASSERT_TRUE(closed) << closed.error().message;
  EXPECT_EQ(writer->packets_written(), packets.size());
  EXPECT_EQ(writer->bytes_written(), std::filesystem::file_size(path));
}

class Journal : public ::testing::TestWithParam<Compression> {};

TEST_P(Journal, GivesBackEveryPacketInOrder) {
  const TemporaryFolder folder;
  const auto path = folder / "drive.mcap";
  const auto packets = sample_packets(400);
  JournalWriter::Config config;
  config.compression = GetParam();
  config.chunk_bytes = 64 * 1024;
  record(path, packets, config);
  auto reader = JournalReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ((*reader)->header(), sample_header());
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE((*reader)->open());
    for (std::size_t i = 0; i < packets.size(); ++i) {
      const auto packet = (*reader)->next({});
      ASSERT_TRUE(packet) << i << ": " << packet.error().message;
      ASSERT_TRUE(same(*packet, packets[i])) << "packet " << i;
    }
    for (int again = 0; again < 2; ++again) {
      const auto end = (*reader)->next({});
      ASSERT_FALSE(end);
      EXPECT_EQ(end.error().code, ErrorCode::EndOfData) << end.error().message;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Compressions, Journal,
                         ::testing::Values(Compression::None, Compression::Lz4, Compression::Zstd),
                         [](const auto& named) {
                           return named.param == Compression::None ? "none" : mcap_name(named.param);
                         });

TEST(JournalBytes, AreTheSameForTheSamePackets) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", sample_packets(100));
  record(folder / "b.mcap", sample_packets(100));
  EXPECT_EQ(test::contents(folder / "a.mcap"), test::contents(folder / "b.mcap"));
}

TEST(JournalWriter, RefusesAnUnknownSensorAndCountsTheRest) {
  const TemporaryFolder folder;
  auto writer = JournalWriter::create(folder / "drive.mcap", sample_header());
  ASSERT_TRUE(writer);
  auto packets = sample_packets(14);
  for (const Packet& p : packets) ASSERT_TRUE(writer->append(p, time_of(p)));
  packets[0].sensor = 4;
  EXPECT_EQ(writer->append(packets[0], {}).error().code, ErrorCode::Invalid);
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(writer->counts()[0].packets, 2u);
  EXPECT_EQ(writer->packets_written(), 14u);
}

TEST(JournalWriter, NeverOverwritesARecording) {
  const TemporaryFolder folder;
  record(folder / "drive.mcap", sample_packets(5));
  const auto second = JournalWriter::create(folder / "drive.mcap", sample_header());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("never overwritten"), std::string::npos) << second.error().message;
}

TEST(JournalWriter, SaysWhichSettingIsWrong) {
  const TemporaryFolder folder;
  JournalWriter::Config config;
  config.chunk_bytes = 5;
  const auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), config);
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("chunk_bytes"), std::string::npos);
  auto twice = sample_header();
  twice.sensors.push_back(twice.sensors[1]);
  EXPECT_FALSE(JournalWriter::create(folder / "drive.mcap", twice));
}

TEST(JournalReader, SaysThatAnotherFileIsNoRecording) {
  const TemporaryFolder folder;
  test::write_file(folder / "text.mcap", "this is a text, not a recording");
  EXPECT_EQ(JournalReader::open(folder / "text.mcap").error().code, ErrorCode::Malformed);
  EXPECT_EQ(JournalReader::open(folder / "absent.mcap").error().code, ErrorCode::Io);
  auto mcap = McapWriter::create(folder / "other.mcap", {});
  ASSERT_TRUE(mcap && mcap->close());
  EXPECT_EQ(JournalReader::open(folder / "other.mcap").error().code, ErrorCode::Unsupported);
  EXPECT_EQ(JournalReader::open(folder.path()).error().code, ErrorCode::Io);
}

TEST(RawPacket, IsWhatProtobufWrites) {
  for (const Packet& p : sample_packets(40)) {
    Bytes bytes;
    append_raw_packet_head(bytes, p, p.bytes.size());
    append(bytes, p.bytes.bytes());
    ::hueline::RawPacket theirs;
    ASSERT_TRUE(theirs.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    EXPECT_EQ(theirs.sequence(), p.sequence);
    EXPECT_EQ(theirs.received_ns(), count_ns(p.received));
    EXPECT_EQ(theirs.kind(), static_cast<int>(p.kind));
    EXPECT_EQ(theirs.shed(), p.shed);
    EXPECT_EQ(theirs.sensor(), p.sensor);
    EXPECT_EQ(theirs.payload().size(), p.bytes.size());
    // The same is checked the other way round; protobuf leaves out fields that are zero.
    const std::string encoded = theirs.SerializeAsString();
    const auto back = decode_raw_packet(Buffer::copy_of(as_bytes(encoded)));
    ASSERT_TRUE(back);
    EXPECT_TRUE(same(*back, p));
  }
}

TEST(JournalReader, ReadsZeroCopyFromItsChunk) {
  const TemporaryFolder folder;
  const auto packets = sample_packets(60, 300'000);
  record(folder / "drive.mcap", packets);
  auto reader = JournalReader::open(folder / "drive.mcap");
  ASSERT_TRUE(reader);
  std::vector<Packet> kept;
  while (auto packet = (*reader)->next({})) kept.push_back(*packet);
  reader->reset();  // packets outlive the reader
  ASSERT_EQ(kept.size(), packets.size());
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_TRUE(same(kept[i], packets[i]));
}

TEST(JournalReader, ReadsOnlyChunksOfTheSensorsThatAreWanted) {
  const TemporaryFolder folder;
  const auto path = folder / "drive.mcap";
  const auto packets = sample_packets(400, 50'000);  // sensor 2 sends images
  JournalWriter::Config config;
  config.chunk_bytes = 20'000;
  record(path, packets, config);
  const auto without_images = [&] {
    std::vector<Packet> out;
    for (const Packet& packet : packets)
      if (packet.sensor != 2 || packet.bytes.size() < 50'000) out.push_back(packet);
    return out;
  }();
  ASSERT_LT(without_images.size(), packets.size() - 100);
  // A byte of an image is damaged, which nobody sees who does not read it.
  {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    const auto& image = *std::find_if(packets.begin() + 200, packets.end(),
                                      [](const Packet& one) { return one.bytes.size() == 50'000; });
    const std::string bytes = test::contents(path);
    const std::string_view pixels(reinterpret_cast<const char*>(image.bytes.bytes().data()), image.bytes.size());
    const std::size_t at = bytes.find(pixels);
    ASSERT_NE(at, std::string::npos);
    file.seekp(static_cast<std::streamoff>(at + 100)).put(static_cast<char>(pixels[100] ^ 1));
  }
  auto reader = JournalReader::open(path);
  ASSERT_TRUE(reader);
  const auto read = [&](std::vector<ErrorCode>& ends) {
    std::vector<Packet> out;
    for (;;) {
      if (auto packet = (*reader)->next({})) {
        out.push_back(*packet);
        continue;
      } else if (ends.push_back(packet.error().code); ends.back() != ErrorCode::Malformed) {
        return out;
      }
    }
  };
  std::vector<ErrorCode> ends;
  (*reader)->read_only({1, 3});
  const auto some = read(ends);
  ASSERT_EQ(some.size(), without_images.size());
  for (std::size_t i = 0; i < some.size(); ++i) ASSERT_TRUE(same(some[i], without_images[i])) << i;
  EXPECT_EQ(ends, std::vector{ErrorCode::EndOfData});
  (*reader)->read_only({});
  ASSERT_TRUE((*reader)->open());
  EXPECT_EQ(read(ends).size(), packets.size() - 1) << "all are read again, and the damaged one is left out";
  // Of a recording that was cut, all is read.
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 100);
  reader = JournalReader::open(path);
  ASSERT_TRUE(reader);
  (*reader)->read_only({1, 3});
  EXPECT_EQ(read(ends).size(), packets.size() - 1);
}

}  // namespace
}  // namespace hueline::storage
