#include <gtest/gtest.h>

#include "storage/mcap_reader.hpp"
#include "storage/mcap_writer.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::TemporaryFolder;

TEST(McapWriter, CountsWhatItWrites) {
  const TemporaryFolder folder;
  McapWriter::Config config;
  config.chunk_bytes = 10'000;
  config.profile = "test";
  auto writer = McapWriter::create(folder / "a.mcap", config);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add_metadata({"facts", {{"a", "1"}}}));
  ASSERT_TRUE(writer->add_attachment({0, 0, "rig.yaml", "application/yaml", "a: 1\n"}));
  const auto schema = writer->add_schema({0, "S", "jsonschema", "{}"});
  ASSERT_TRUE(schema);
  ASSERT_TRUE(writer->add_channel({3, *schema, "/a", "json", {}}));
  ASSERT_TRUE(writer->add_channel({9, *schema, "/b", "json", {}}));
  EXPECT_EQ(writer->add_channel({9, *schema, "/c", "json", {}}).error().code, ErrorCode::Invalid);
  for (std::uint32_t i = 0; i < 50; ++i)
    ASSERT_TRUE(writer->write({i % 3 ? std::uint16_t{3} : std::uint16_t{9}, i, 1000 - i, 0}, as_bytes("head"),
                              test::pattern_buffer(i * 300, i)));
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(writer->close().error().code, ErrorCode::Invalid);
  EXPECT_FALSE(writer->write({3, 0, 0, 0}, {}));

  auto reader = McapReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->profile(), "test");
  for (std::uint32_t i = 0; i < 50; ++i) {
    const auto message = reader->next();
    ASSERT_TRUE(message) << message.error().message;
    EXPECT_EQ(message->sequence, i);
    EXPECT_EQ(message->log_time, 1000 - i);
    EXPECT_EQ(message->data.size(), 4 + i * 300);
  }
  EXPECT_EQ(reader->next().error().code, ErrorCode::EndOfData);
  ASSERT_TRUE(reader->statistics());
  const McapStatistics& s = *reader->statistics();
  EXPECT_EQ(s.message_count, 50u);
  EXPECT_EQ(s.channel_count, 2u);
  EXPECT_EQ(s.attachment_count, 1u);
  EXPECT_EQ(s.metadata_count, 1u);
  EXPECT_GT(s.chunk_count, 10u);
  EXPECT_EQ(s.message_start_time, 951u);
  EXPECT_EQ(s.message_end_time, 1000u);
  EXPECT_EQ(s.channel_message_counts.at(9), 17u);
  EXPECT_EQ(reader->metadata().at(0).values.at("a"), "1");
  EXPECT_EQ(reader->attachments().at(0).data, "a: 1\n");
}

/// Returns a chunk that claims an unpacked size, but holds nothing that could give it.
std::string hollow_chunk(std::uint64_t unpacked) {
  const auto number = [](auto value) { return std::string(reinterpret_cast<const char*>(&value), sizeof value); };
  const std::string content = number(std::uint64_t{0}) + number(std::uint64_t{0}) + number(unpacked) +
                              number(std::uint32_t{0}) + number(std::uint32_t{4}) + "zstd" + number(std::uint64_t{4}) +
                              "none";
  return "\x06" + number(std::uint64_t{content.size()}) + content;
}

TEST(McapReader, UnpacksNoMoreThanItsLimitsAndNamesThem) {
  const TemporaryFolder folder;
  constexpr std::uint64_t kMiB = 1 << 20;
  std::string bytes("\x89MCAP0\r\n", 8);
  bytes += hollow_chunk(513 * kMiB);
  for (int i = 0; i < 30; ++i) bytes += hollow_chunk(500 * kMiB);
  test::write_file(folder / "bombs.mcap", bytes);
  auto reader = McapReader::open(folder / "bombs.mcap");
  ASSERT_TRUE(reader);
  const auto first = reader->next();
  EXPECT_EQ(first.error().code, ErrorCode::Malformed);
  EXPECT_NE(first.error().message.find("at most 536870912 are read"), std::string::npos) << first.error().message;
  int skipped = 0;
  auto next = reader->next();
  for (; next.error().code == ErrorCode::Malformed; next = reader->next()) ++skipped;
  EXPECT_EQ(skipped, 16) << "as many chunks as fit into 8 GiB";
  EXPECT_EQ(next.error().code, ErrorCode::Unsupported);
  EXPECT_NE(next.error().message.find("unpack to more than 8 GiB"), std::string::npos) << next.error().message;
  EXPECT_EQ(reader->next().error().code, ErrorCode::Unsupported) << "it is told again";
}

TEST(McapWriter, GivesALargeMessageAChunkOfItsOwn) {
  const TemporaryFolder folder;
  McapWriter::Config config;
  config.chunk_bytes = 100'000;
  auto writer = McapWriter::create(folder / "a.mcap", config);
  const auto schema = writer->add_schema({0, "S", "", ""});
  ASSERT_TRUE(writer->add_channel({1, *schema, "/a", "", {}}));
  const Buffer small = test::pattern_buffer(50, 1), large = test::pattern_buffer(200'000, 1);
  for (const auto& payload : {small, large, small, small}) ASSERT_TRUE(writer->write({1, 0, 0, 0}, {}, payload));
  EXPECT_EQ(writer->statistics().chunk_count, 2u) << "small | large";
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(writer->statistics().chunk_count, 3u);
}

TEST(McapWriter, DoesNotHoldAPayloadLongerThanItsChunk) {
  const TemporaryFolder folder;
  BufferPool pool(1 << 20);
  auto writer = McapWriter::create(folder / "a.mcap", {});
  const auto schema = writer->add_schema({0, "S", "", ""});
  ASSERT_TRUE(writer->add_channel({1, *schema, "/a", "", {}}));
  ASSERT_TRUE(writer->write({1, 0, 0, 0}, {}, pool.acquire(1000).share()));
  EXPECT_EQ(pool.bytes_in_use(), 0u) << "a small payload goes back to its pool at once";
  ASSERT_TRUE(writer->write({1, 0, 0, 0}, {}, pool.acquire(60'000).share()));
  EXPECT_GT(pool.bytes_in_use(), 0u) << "a large one is held, not copied";
  ASSERT_TRUE(writer->flush());
  EXPECT_EQ(pool.bytes_in_use(), 0u);
}

}  // namespace
}  // namespace hueline::storage
