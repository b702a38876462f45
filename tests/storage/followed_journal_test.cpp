// A recording that is read while it is written: whenever the reader looks, it comes to the packets that a reader of the
// finished recording finds, and what a ring removed before is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "storage/journal_reader.hpp"
#include "storage/segmented_journal.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_packets;
using test::TemporaryFolder;
using test::time_of;

/// Reads what is there of a recording, and goes on where it was.
struct Follower {
  std::unique_ptr<JournalReader> reader;
  std::vector<Packet> packets;
  std::vector<std::string> troubles;
  ErrorCode end{};

  void read_on(const std::filesystem::path& path) {
    if (!reader) {
      auto opened = JournalReader::open(path);
      if (!opened.ok()) return;  // its header is not whole yet
      reader = std::move(*opened);
    }
    do {
      for (;;) {
        auto packet = reader->next({});
        if (packet.ok()) {
          packets.push_back(*packet);
          continue;
        }
        end = packet.error().code;
        if (end != ErrorCode::Malformed) break;
        troubles.push_back(packet.error().message);
      }
    } while (reader->look_again());
  }
  void expect_same(const std::vector<Packet>& all) const {
    EXPECT_EQ(end, ErrorCode::EndOfData);
    EXPECT_THAT(troubles, testing::IsEmpty());
    ASSERT_EQ(packets.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) ASSERT_TRUE(test::same(packets[i], all[i])) << i;
  }
};

SegmentedJournal::Config in_segments() {
  SegmentedJournal::Config out;
  out.recording = "0123456789abcdef";
  out.segment_bytes = 150'000;
  return out;
}

TEST(FollowedJournal, IsReadWholeFromAnyBytesThatAreThere) {
  TemporaryFolder folder;
  const auto packets = sample_packets(300, 5000);
  const auto whole = folder / "whole.mcap";
  JournalWriter::Config config;
  config.chunk_bytes = 8000;
  auto writer = JournalWriter::create(whole, test::sample_header(), config);
  ASSERT_TRUE(writer.ok());
  for (const Packet& packet : packets) ASSERT_TRUE(writer->append(packet, time_of(packet)).ok());
  ASSERT_TRUE(writer->close().ok());
  const std::string bytes = test::contents(whole);
  for (const unsigned seed : {1u, 2u, 3u}) {
    std::mt19937 random(seed);
    const auto path = folder / ("grows" + std::to_string(seed) + ".mcap");
    std::ofstream out(path, std::ios::binary);
    Follower follower;
    std::size_t steps = 0;
    for (std::size_t at = 0; at < bytes.size(); ++steps) {
      // Small steps too, which end within the head of a record, and within the summary.
      const std::size_t step = std::min<std::size_t>(random() % (seed == 3 ? 50 : 3000) + 1, bytes.size() - at);
      out.write(bytes.data() + at, static_cast<std::streamsize>(step)).flush();
      at += step;
      follower.read_on(path);
      if (follower.reader && at < bytes.size()) {
        ASSERT_EQ(follower.end, ErrorCode::Truncated) << at;
      }
    }
    EXPECT_GT(steps, 100u);
    follower.expect_same(packets);
    EXPECT_TRUE(follower.reader->is_closed());
  }
}

TEST(FollowedJournal, GoesOnInSegmentsThatAreBegunMeanwhile) {
  const auto packets = sample_packets(1500);
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    TemporaryFolder folder;
    std::mt19937 random(seed);
    const auto path = folder / "drive.mcap";
    const SegmentedJournal::Config config = in_segments();
    auto journal = SegmentedJournal::create(path, test::sample_header(), config);
    ASSERT_TRUE(journal.ok());
    Follower follower;
    for (const Packet& packet : packets) {
      ASSERT_TRUE(journal->append(packet, time_of(packet)).ok());
      // A reader that looks often, and readers that are many segments late.
      if (random() % (seed * seed * 20) == 0) follower.read_on(path);
    }
    follower.read_on(path);
    EXPECT_FALSE(follower.reader->is_closed());
    EXPECT_LE(follower.packets.size(), packets.size());
    ASSERT_TRUE(journal->close().ok());
    EXPECT_GT(journal->segment(), 10u);
    follower.read_on(path);
    follower.expect_same(packets);
    EXPECT_TRUE(follower.reader->is_closed());
    EXPECT_EQ(follower.reader->segments_missed(), 0u);
  }
}

TEST(FollowedJournal, TellsWhatARingHasRemovedBefore) {
  TemporaryFolder folder;
  const auto packets = sample_packets(3000);
  const auto path = folder / "drive.mcap";
  SegmentedJournal::Config config = in_segments();
  config.ring_bytes = 600'000;
  auto journal = SegmentedJournal::create(path, test::sample_header(), config);
  ASSERT_TRUE(journal.ok());
  Follower follower;
  std::uint64_t number = 0;
  for (const Packet& packet : packets) {
    ASSERT_TRUE(journal->append(packet, time_of(packet)).ok());
    if (++number % 1000 == 0) follower.read_on(path);
  }
  ASSERT_TRUE(journal->close().ok());
  follower.read_on(path);
  EXPECT_EQ(follower.end, ErrorCode::EndOfData);
  EXPECT_THAT(follower.troubles, testing::IsEmpty());
  EXPECT_GT(follower.reader->segments_missed(), 5u);
  EXPECT_LT(follower.reader->segments_missed(), journal->removed().segments) << "it read some that are gone now";
  EXPECT_LT(follower.packets.size(), packets.size());
  EXPECT_TRUE(test::same(follower.packets.back(), packets.back()));
  EXPECT_TRUE(std::is_sorted(follower.packets.begin(), follower.packets.end(),
                             [](const Packet& a, const Packet& b) { return a.sequence < b.sequence; }));
}

TEST(FollowedJournal, GoesOnBehindASegmentWhoseWriterFailed) {
  TemporaryFolder folder;
  const auto packets = sample_packets(600);
  const auto path = folder / "drive.mcap";
  {
    auto journal = SegmentedJournal::create(path, test::sample_header(), in_segments());
    ASSERT_TRUE(journal.ok());
    for (const Packet& packet : packets) ASSERT_TRUE(journal->append(packet, time_of(packet)).ok());
    ASSERT_TRUE(journal->close().ok());
  }
  // The second segment lost its end, and the third has none of its packets yet.
  const auto second = segment_path(path, 2), third = segment_path(path, 3), beside = folder / "third";
  std::filesystem::resize_file(second, std::filesystem::file_size(second) / 2);
  for (std::uint32_t number = 4; std::filesystem::exists(segment_path(path, number)); ++number)
    std::filesystem::remove(segment_path(path, number));
  std::filesystem::rename(third, beside);
  const std::string bytes = test::contents(beside);
  Follower follower;
  follower.read_on(path);
  const std::size_t before = follower.packets.size();
  EXPECT_EQ(follower.end, ErrorCode::Truncated);
  std::ofstream(third, std::ios::binary).write(bytes.data(), 1000);
  follower.read_on(path);
  EXPECT_EQ(follower.packets.size(), before) << "the second segment may still grow";
  EXPECT_EQ(follower.end, ErrorCode::Truncated);
  std::ofstream(third, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  follower.read_on(path);
  EXPECT_GT(follower.packets.size(), before);
  EXPECT_EQ(follower.end, ErrorCode::EndOfData);
  ASSERT_EQ(follower.troubles.size(), 1u);
  EXPECT_THAT(follower.troubles[0], testing::HasSubstr("goes on behind what is missing"));
}

}  // namespace
}  // namespace hueline::storage
