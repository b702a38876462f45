// Parts of recordings, and what is whole of damaged ones, as recordings of their own.
#include "storage/journal_part.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "storage/journal_writer.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/recorded_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_header;
using test::sample_packets;

class JournalParts : public testing::Test {
 protected:
  void write(const std::vector<Packet>& packets) {
    JournalWriter::Config config;
    config.chunk_bytes = 1 << 16;
    config.if_exists = IfExists::Replace;
    auto writer = JournalWriter::create(whole_, sample_header(), config);
    ASSERT_TRUE(writer.ok());
    for (const Packet& packet : packets) ASSERT_TRUE(writer->append(packet, test::time_of(packet)).ok());
    ASSERT_TRUE(writer->close().ok());
  }
  CopiedPart copy(const JournalPart& part) {
    auto journal = JournalReader::open(whole_);
    EXPECT_TRUE(journal.ok());
    const auto copied = copy_part(**journal, "whole.mcap", part, part_);
    EXPECT_TRUE(copied.ok()) << copied.error().message;
    return *copied;
  }
  std::vector<Packet> read() {
    std::vector<Packet> out;
    test::for_each_recorded_packet(part_, [&](const Packet& packet, const JournalHeader& header) {
      EXPECT_EQ(header.sensors, sample_header().sensors);
      EXPECT_EQ(header.files, sample_header().files);
      EXPECT_THAT(header.about.at("part_of"), testing::HasSubstr("whole.mcap"));
      out.push_back(packet);
    });
    return out;
  }
  static bool equal_but_for_sequence(Packet a, const Packet& b) {
    a.sequence = b.sequence;
    return test::same(a, b);
  }

  test::TemporaryFolder folder_;
  const std::filesystem::path whole_ = folder_ / "whole.mcap", part_ = folder_ / "part.mcap";
};

TEST_F(JournalParts, TheWholeIsTheSameWithTheSameGaps) {
  const auto packets = sample_packets(500);
  write(packets);
  const CopiedPart copied = copy({});
  const auto part = read();
  ASSERT_EQ(part.size(), packets.size());
  for (std::size_t i = 0; i < part.size(); ++i) {
    EXPECT_TRUE(equal_but_for_sequence(packets[i], part[i])) << i;
    EXPECT_EQ(part[i].sequence, packets[i].sequence - packets[0].sequence) << i;
  }
  EXPECT_EQ(copied.packets, packets.size());
  EXPECT_TRUE(copied.end.ok());
}

TEST_F(JournalParts, ACopyThatFailsLeavesTheOlderFileOfItsName) {
  write(sample_packets(500));
  copy({.from_s = 0.1, .to_s = 0.2});
  const auto older = read();
  ASSERT_FALSE(older.empty());
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  for (const rlim_t bytes : {rlim_t{100}, rlim_t{4096}}) {  // in the header, and in the packets
    auto journal = JournalReader::open(whole_);
    ASSERT_TRUE(journal.ok());
    const rlimit now{bytes, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &now);
    const auto copied = copy_part(**journal, "whole.mcap", {}, part_);
    ::setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(copied.ok()) << bytes;
    EXPECT_EQ(copied.error().code, ErrorCode::Io);
  }
  const auto left = read();
  ASSERT_EQ(left.size(), older.size());
  for (std::size_t i = 0; i < left.size(); ++i) EXPECT_TRUE(test::same(left[i], older[i])) << i;
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(part_.parent_path()))
    files.push_back(entry.path().filename().string());
  EXPECT_THAT(files, testing::UnorderedElementsAre("whole.mcap", "part.mcap"));
}

TEST_F(JournalParts, ACopyThatIsNotClosedOrNotWholeLeavesTheOlderFileOfItsName) {
  const auto packets = sample_packets(500);
  write(packets);
  copy({});
  const auto size = std::filesystem::file_size(part_);
  const auto append_all = [&](JournalWriter& writer) {
    Status done;
    for (const Packet& packet : packets)
      if (Status appended = writer.append(packet, test::time_of(packet)); !appended.ok()) done = appended;
    return done;
  };
  {
    auto writer = JournalWriter::create(part_, sample_header(), JournalWriter::Config::of_copy());
    ASSERT_TRUE(writer.ok());
    EXPECT_TRUE(append_all(*writer).ok());
    EXPECT_TRUE(std::filesystem::exists(part_.string() + ".part"));
  }
  EXPECT_EQ(std::filesystem::file_size(part_), size);
  EXPECT_FALSE(std::filesystem::exists(part_.string() + ".part"));
  // A file that is closed after a failed write lacks packets, or its index.
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  for (const rlim_t most : {size / 2, size - 100}) {
    auto writer = JournalWriter::create(part_, sample_header(), JournalWriter::Config::of_copy());
    ASSERT_TRUE(writer.ok());
    const rlimit now{most, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &now);
    (void)append_all(*writer);
    const Status closed = writer->close();
    ::setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_FALSE(closed.ok()) << most;
    EXPECT_EQ(std::filesystem::file_size(part_), size);
    EXPECT_FALSE(std::filesystem::exists(part_.string() + ".part"));
  }
  EXPECT_EQ(read().size(), packets.size());
}

TEST_F(JournalParts, ABeginIsCheckedWithoutLosingAPacket) {
  const auto packets = sample_packets(500);
  write(packets);
  auto journal = JournalReader::open(whole_);
  ASSERT_TRUE(journal.ok());
  const Status behind = check_begin(**journal, 1000);
  ASSERT_FALSE(behind.ok());
  EXPECT_EQ(behind.error().code, ErrorCode::Invalid);
  EXPECT_THAT(behind.error().message, testing::HasSubstr("whole.mcap has only 0.3 s"));
  EXPECT_TRUE(check_begin(**journal, 0.1).ok());
  for (std::size_t i = 0; i < packets.size(); ++i) {
    if (i == 7) {  // whoever looks in the middle loses nothing either
      ASSERT_TRUE((*journal)->peek().ok());
      EXPECT_TRUE(test::same(packets[i], *(*journal)->peek()));
    }
    const auto packet = (*journal)->next({});
    ASSERT_TRUE(packet.ok()) << i;
    EXPECT_TRUE(test::same(packets[i], *packet)) << i;
  }
  EXPECT_EQ((*journal)->next({}).error().code, ErrorCode::EndOfData);
  ASSERT_TRUE((*journal)->open().ok());
  ASSERT_TRUE((*journal)->peek().ok());
  EXPECT_TRUE(test::same(packets[0], *(*journal)->peek()));
}

TEST_F(JournalParts, TimeIsThatOfTheNewestPacketSoFar) {
  const auto packets = sample_packets(500);
  write(packets);
  const CopiedPart copied = copy({.from_s = 0.1, .to_s = 0.2});
  const auto part = read();
  // The stamps of the sensors overlap by up to 2 ms; one packet comes every 0.7 ms.
  ASSERT_NEAR(static_cast<double>(part.size()), 0.1 / 0.0007, 5);
  EXPECT_EQ(part[0].sequence, 0u);
  const auto first = std::find_if(packets.begin(), packets.end(),
                                  [&](const Packet& packet) { return equal_but_for_sequence(packet, part[0]); });
  ASSERT_NE(first, packets.end());
  EXPECT_EQ(copied.before, first->sequence - packets[0].sequence);
  for (std::size_t i = 0; i < part.size(); ++i) {
    const Packet& old = *(first + static_cast<std::ptrdiff_t>(i));
    EXPECT_TRUE(equal_but_for_sequence(old, part[i])) << i;
    EXPECT_EQ(part[i].sequence, old.sequence - first->sequence) << i;
  }
  EXPECT_TRUE(copied.ends_early);
}

TEST_F(JournalParts, APacketAtTheTimeOfACutIsInTheSecondPartAlone) {
  // A receiver's log whose times are whole seconds: a cut between two of them is the exception.
  auto packets = sample_packets(10);
  for (std::size_t i = 0; i < packets.size(); ++i) packets[i].received = packets[0].received + std::chrono::seconds(i);
  write(packets);
  EXPECT_EQ(copy({.from_s = 0, .to_s = 4}).packets, 4u);
  copy({.from_s = 4});
  const auto part = read();
  ASSERT_EQ(part.size(), 6u);
  EXPECT_TRUE(equal_but_for_sequence(packets[4], part[0]));
}

TEST_F(JournalParts, ADamageOfACopyCostsASecondWhereFewBytesCome) {
  auto packets = sample_packets(10);
  const std::string mark = "the bytes that the disk will damage";
  packets[5].bytes = Buffer::copy_of(std::as_bytes(std::span(mark)));
  for (std::size_t i = 0; i < packets.size(); ++i) packets[i].received = packets[0].received + std::chrono::seconds(i);
  write(packets);
  ASSERT_EQ(copy({}).packets, 10u);
  {
    std::fstream file(part_, std::ios::binary | std::ios::in | std::ios::out);
    const std::string all{std::istreambuf_iterator<char>(file), {}};
    const std::size_t at = all.find(mark);
    ASSERT_NE(at, std::string::npos);
    file.seekp(static_cast<std::streamoff>(at));
    file.put('T');
    ASSERT_TRUE(file.good());
  }
  auto journal = JournalReader::open(part_);
  ASSERT_TRUE(journal.ok());
  const auto recovered = copy_part(**journal, "part.mcap", {}, folder_ / "recovered.mcap");
  ASSERT_TRUE(recovered.ok()) << recovered.error().message;
  EXPECT_EQ(recovered->damages, 1u);
  EXPECT_EQ(recovered->packets, 9u);
}

TEST_F(JournalParts, SensorsThatAreLeftOutAreNoGaps) {
  const auto packets = sample_packets(300);
  write(packets);
  const CopiedPart copied = copy({.left_out = {false, false, true}});
  const auto part = read();
  std::uint64_t gaps = 0, old_gaps = 0;
  for (std::size_t i = 1; i < part.size(); ++i) gaps += part[i].sequence - part[i - 1].sequence - 1;
  for (std::size_t i = 1; i < packets.size(); ++i) old_gaps += packets[i].sequence - packets[i - 1].sequence - 1;
  for (const Packet& packet : part) EXPECT_NE(packet.sensor, 2);
  EXPECT_EQ(gaps, old_gaps) << "those that the capture lost";
  EXPECT_EQ(part.size() + copied.of_others, packets.size());
  EXPECT_GT(copied.of_others, 90u);
}

TEST_F(JournalParts, LedgersAreKeptWhereTheSequenceIs) {
  auto packets = sample_packets(300);
  for (std::size_t i = 0; i < packets.size(); ++i) packets[i].sequence = i;
  for (const std::size_t i : {100u, 299u}) packets[i].kind = PacketKind::Ledger;
  write(packets);
  const auto ledgers = [](const std::vector<Packet>& read) {
    return std::ranges::count(read, PacketKind::Ledger, &Packet::kind);
  };
  (void)copy({});
  EXPECT_EQ(ledgers(read()), 2);
  for (const JournalPart& part : {JournalPart{.from_s = 0.02, .to_s = {}, .left_out = {}},
                                  JournalPart{.from_s = 0, .to_s = {}, .left_out = {false, true}}}) {
    (void)copy(part);
    const auto kept = read();
    EXPECT_EQ(ledgers(kept), 0);
    ASSERT_GT(kept.size(), 100u);
    for (std::size_t i = 0; i < kept.size(); ++i) ASSERT_EQ(kept[i].sequence, i) << "what is left out leaves no gap";
  }
}

TEST_F(JournalParts, WhatIsWholeOfADamagedRecordingIsRecovered) {
  const auto packets = sample_packets(500);
  write(packets);
  std::string bytes = test::contents(whole_);
  const std::string before = bytes;
  for (const std::size_t at : {bytes.size() / 3, bytes.size() / 2}) bytes[at] = static_cast<char>(~bytes[at]);
  bytes.resize(bytes.size() * 4 / 5);
  test::write_file(whole_, bytes);
  const CopiedPart copied = copy({});
  EXPECT_EQ(copied.damages, 2u);
  EXPECT_FALSE(copied.first_damage.empty());
  EXPECT_EQ(copied.end.error().code, ErrorCode::Truncated);
  EXPECT_EQ(test::contents(whole_), bytes) << "the old one is only read";
  const auto part = read();  // whole
  EXPECT_EQ(part.size(), copied.packets);
  EXPECT_GT(part.size(), packets.size() / 2);
  EXPECT_LT(part.size(), packets.size());
  std::size_t at = 0;
  for (const Packet& packet : part) {
    while (at < packets.size() && !equal_but_for_sequence(packets[at], packet)) ++at;
    ASSERT_LT(at, packets.size()) << "a packet that was never recorded";
    EXPECT_EQ(packet.sequence, packets[at].sequence - packets[0].sequence);
  }
}

/// Whoever seeks gets the same packets as whoever reads all, without reading what lies before: by the index, and by the
/// heads of the chunks where a crash has cut it off.
TEST_F(JournalParts, SeekingGivesWhatIsThere) {
  const auto packets = sample_packets(3000);
  write(packets);
  const JournalPart part{.from_s = 1};
  std::vector<Packet> expected;
  PartChoice all(part);
  for (Packet packet : packets) {
    if (all.judge(packet) != PartChoice::Fate::Keep) continue;
    packet.sequence = all.sequence_of(packet);
    expected.push_back(packet);
  }
  ASSERT_GT(expected.size(), 500u);
  for (const bool has_index : {true, false}) {
    if (!has_index) std::filesystem::resize_file(whole_, std::filesystem::file_size(whole_) - 1);
    const CopiedPart copied = copy(part);
    EXPECT_EQ(copied.end.ok(), has_index);
    const auto found = read();
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_TRUE(test::same(found[i], expected[i])) << i;

    auto journal = JournalReader::open(whole_);
    ASSERT_TRUE(journal.ok());
    EXPECT_EQ((*journal)->has_index(), has_index);
    std::uint64_t read_in_all = 0;
    for (auto packet = (*journal)->next({}); packet.ok(); packet = (*journal)->next({}))
      if (read_in_all++ == 0) (*journal)->skip_before(packet->received + from_seconds(part.from_s));
    EXPECT_LT(read_in_all, packets.size() * 3 / 4);
  }
}

/// An index that somebody has damaged is not believed: its summary has a CRC.
TEST_F(JournalParts, ADamagedIndexIsNotUsed) {
  const auto packets = sample_packets(3000);
  write(packets);
  std::string bytes = test::contents(whole_);
  bytes[bytes.size() - 300] = static_cast<char>(~bytes[bytes.size() - 300]);
  test::write_file(whole_, bytes);
  auto journal = JournalReader::open(whole_);
  ASSERT_TRUE(journal.ok());
  EXPECT_FALSE((*journal)->has_index());
}

TEST_F(JournalParts, TheNewestPacketIsFoundWithAndWithoutASummary) {
  const auto packets = sample_packets(500);
  write(packets);
  HostTime newest{};
  for (const Packet& packet : packets) newest = std::max(newest, packet.received);
  auto journal = JournalReader::open(whole_);
  ASSERT_TRUE(journal.ok());
  EXPECT_EQ((*journal)->newest(), newest);
  // Cut by a crash: the heads of the chunks that are left say it.
  std::filesystem::resize_file(whole_, std::filesystem::file_size(whole_) / 2);
  journal = JournalReader::open(whole_);
  ASSERT_TRUE(journal.ok());
  HostTime left{};
  for (auto packet = (*journal)->next({}); packet.ok(); packet = (*journal)->next({}))
    left = std::max(left, packet->received);
  EXPECT_LT(left, newest);
  EXPECT_EQ((*journal)->newest(), left);
}

}  // namespace
}  // namespace hueline::storage
