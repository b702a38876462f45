// Runs a recorder on a disk that fails as real disks do, and checks that what the recorder then says of its recording
// is true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_header;
using test::sample_packets;
using test::TemporaryFolder;
using test::time_of;

/// The kernel's disk, except that one numbered call (from 1) of a kind has another answer. The calls after it work
/// again.
struct Answers {
  int append_number = 0, append_answer = 0;
  int sync_number = 0, sync_answer = 0;
  std::uint64_t most_bytes = ~std::uint64_t{0};  ///< that one append() takes
  int appends = 0, syncs = 0;
};

class AnsweringFile final : public DiskFile {
 public:
  AnsweringFile(std::unique_ptr<DiskFile> real, Answers& answers) : real_(std::move(real)), answers_(answers) {}
  std::int64_t append(std::span<const iovec> pieces) override {
    if (++answers_.appends == answers_.append_number) return answers_.append_answer;
    if (pieces.front().iov_len <= answers_.most_bytes) return real_->append(pieces.first(1));
    const iovec part{pieces.front().iov_base, static_cast<std::size_t>(answers_.most_bytes)};
    return real_->append(std::span(&part, 1));
  }
  std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
    return real_->overwrite(offset, bytes);
  }
  int sync() override { return ++answers_.syncs == answers_.sync_number ? answers_.sync_answer : real_->sync(); }
  int truncate(std::uint64_t size) override { return real_->truncate(size); }
  int close() override { return real_->close(); }

 private:
  std::unique_ptr<DiskFile> real_;
  Answers& answers_;
};

class AnsweringDisk final : public Disk {
 public:
  explicit AnsweringDisk(Answers& answers) : answers_(answers) {}
  int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) override {
    std::unique_ptr<DiskFile> real;
    const int answer = Disk::kernel().create(path, if_exists, real);
    if (answer == 0) file = std::make_unique<AnsweringFile>(std::move(real), answers_);
    return answer;
  }

 private:
  Answers& answers_;
};

/// Packets one millisecond apart. Everything is synced at the first packet and every 100 ms.
std::vector<Packet> packets_of_time() {
  auto packets = sample_packets(400);
  for (std::size_t i = 0; i < packets.size(); ++i)
    packets[i].received = host_time_ns(1'000'000'000 + static_cast<std::int64_t>(i) * 1'000'000);
  return packets;
}
JournalWriter::Config synced_often() {
  JournalWriter::Config config;
  config.sync_interval = std::chrono::milliseconds(100);
  return config;
}

std::uint64_t packets_in(const std::filesystem::path& path) {
  auto reader = JournalReader::open(path);
  if (!reader) return 0;
  std::uint64_t count = 0;
  while ((*reader)->next({})) ++count;
  return count;
}

TEST(FailingDisk, ASyncThatFailsOnceLeavesOnlyWhatWasSyncedBefore) {
  for (const int answer : {-EIO, -EROFS, -ENOSPC}) {
    const TemporaryFolder folder;
    Answers answers;
    answers.sync_number = 4;  // one sync happens at the creation, and two succeed on the way
    answers.sync_answer = answer;
    AnsweringDisk disk(answers);
    const auto packets = packets_of_time();
    auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), synced_often(), disk);
    ASSERT_TRUE(writer) << writer.error().message;
    std::size_t taken = 0;
    while (taken < packets.size() && writer->append(packets[taken], time_of(packets[taken]))) ++taken;
    EXPECT_EQ(taken, 300u) << "the sync at 300 ms is the one that fails";
    EXPECT_FALSE(writer->close()) << "although the kernel says of no later sync that anything is wrong";
    EXPECT_GT(answers.syncs, 3);
    EXPECT_EQ(writer->packets_on_medium(), 201u);
    EXPECT_GE(writer->packets_written(), 301u);
  }
}

/// The devices stamp a day ahead and back again, or all the same.
TEST(FailingDisk, SyncsGoByTheRecordersClockAndNotByStamps) {
  int tame = 0;
  for (const bool is_wild : {false, true}) {
    const TemporaryFolder folder;
    Answers answers;
    AnsweringDisk disk(answers);
    auto packets = packets_of_time();
    auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), synced_often(), disk);
    ASSERT_TRUE(writer);
    const int before = answers.syncs, appended = answers.appends;
    for (std::size_t i = 0; i < packets.size(); ++i) {
      const nanoseconds now = time_of(packets[i]);
      packets[i].received = is_wild && i % 2 ? host_time_ns(std::numeric_limits<std::int64_t>::max()) : host_time_ns(0);
      ASSERT_TRUE(writer->append(packets[i], now));
    }
    EXPECT_EQ(answers.syncs - before, 3) << "at 100, 200 and 300 ms";
    if (!is_wild) tame = answers.appends - appended;
    EXPECT_LE(answers.appends - appended, tame + 10) << "as many chunks";
    EXPECT_EQ(writer->packets_on_medium(), 301u);
    EXPECT_TRUE(writer->close());
  }
}

TEST(FailingDisk, WhatWaitsIsWrittenInTimeThoughNoPacketComes) {
  const TemporaryFolder folder;
  Answers answers;
  AnsweringDisk disk(answers);
  const auto packets = packets_of_time();
  JournalWriter::Config config;
  config.chunk_time = std::chrono::milliseconds(80);
  config.sync_interval = std::chrono::seconds(2);
  auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), config, disk);
  ASSERT_TRUE(writer);
  const int syncs = answers.syncs;
  const nanoseconds begin = time_of(packets[0]);
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(writer->append(packets[i], time_of(packets[i])));
  int after_ms = 20;
  const auto rest_until = [&](int end_ms) {
    for (; after_ms < end_ms; after_ms += 20)
      ASSERT_TRUE(writer->write_due(begin + std::chrono::milliseconds(after_ms)));
  };
  rest_until(80);
  EXPECT_EQ(packets_in(folder / "drive.mcap"), 0u) << "too early: it would be a chunk for each packet";
  rest_until(100);
  EXPECT_EQ(packets_in(folder / "drive.mcap"), 3u) << "a kill after 0.1 s loses nothing";
  rest_until(2000);
  EXPECT_EQ(answers.syncs, syncs) << "too early";
  rest_until(2020);
  EXPECT_EQ(answers.syncs, syncs + 1);
  EXPECT_EQ(writer->packets_on_medium(), 3u);
  const int appends = answers.appends;
  rest_until(10'000);
  EXPECT_EQ(answers.syncs, syncs + 1) << "there is nothing that a disk could be woken for";
  EXPECT_EQ(answers.appends, appends);
}

TEST(FailingDisk, AFullDiskKeepsWhatIsWholeOnTheMedium) {
  const TemporaryFolder folder;
  const auto packets = packets_of_time();
  int in_all = 0;
  for (const bool is_full : {false, true}) {
    Answers answers;
    answers.append_number = is_full ? in_all / 2 : 0;
    answers.append_answer = -ENOSPC;
    AnsweringDisk disk(answers);
    JournalWriter::Config config = synced_often();
    config.if_exists = IfExists::Replace;
    auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), config, disk);
    ASSERT_TRUE(writer);
    for (const Packet& packet : packets)
      if (!writer->append(packet, time_of(packet))) break;
    const Status closed = writer->close();
    in_all = answers.appends;
    if (!is_full) continue;
    ASSERT_FALSE(closed);
    EXPECT_NE(closed.error().message.find("the disk is full"), std::string::npos) << closed.error().message;
    EXPECT_GT(writer->packets_on_medium(), 0u);
    EXPECT_LT(writer->packets_on_medium(), packets.size());
    EXPECT_EQ(writer->packets_on_medium(), writer->packets_written());
    EXPECT_EQ(writer->packets_on_medium(), packets_in(folder / "drive.mcap"));
  }
}

TEST(FailingDisk, ShortWritesAndInterruptsAreNoFailure) {
  const TemporaryFolder folder;
  Answers answers;
  answers.most_bytes = 1000;
  answers.append_number = 7;
  answers.append_answer = -EINTR;
  AnsweringDisk disk(answers);
  const auto packets = packets_of_time();
  auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), synced_often(), disk);
  ASSERT_TRUE(writer);
  for (const Packet& packet : packets) ASSERT_TRUE(writer->append(packet, time_of(packet)));
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(writer->packets_on_medium(), packets.size());
  EXPECT_EQ(packets_in(folder / "drive.mcap"), packets.size());
}

TEST(PlaceOfAFile, IsToldWhenSomebodyElseTakesItAway) {
  TemporaryFolder dir;
  const auto path = dir / "drive.mcap";
  const auto begun = [&] {
    std::filesystem::remove(path);
    auto writer = JournalWriter::create(path, sample_header());
    EXPECT_TRUE(writer.ok());
    for (const Packet& packet : sample_packets(50))
      EXPECT_TRUE(writer->append(packet, packet.received.time_since_epoch()).ok());
    EXPECT_TRUE(writer->flush().ok());
    EXPECT_TRUE(writer->check_place().ok());
    return std::move(*writer);
  };
  {
    JournalWriter deleted = begun();
    std::filesystem::remove(path);
    const Status place = deleted.check_place();
    ASSERT_FALSE(place.ok());
    EXPECT_EQ(place.error().code, ErrorCode::Unavailable);
    EXPECT_NE(place.error().message.find("was deleted"), std::string::npos) << place.error().message;
    // The command in the message does save the recording.
    const std::size_t from = place.error().message.find("/proc/");
    ASSERT_NE(from, std::string::npos);
    const std::string reached = place.error().message.substr(from, place.error().message.find(' ', from) - from);
    for (const Packet& packet : sample_packets(50))
      EXPECT_TRUE(deleted.append(packet, packet.received.time_since_epoch()).ok()) << "it goes on";
    EXPECT_TRUE(deleted.flush().ok());
    std::filesystem::copy_file(reached, dir / "saved.mcap");
    EXPECT_EQ(packets_in(dir / "saved.mcap"), 100u);
  }
  {
    JournalWriter moved = begun();
    std::filesystem::rename(path, dir / "moved.mcap");
    EXPECT_EQ(moved.check_place().error().code, ErrorCode::Unavailable);
    std::filesystem::copy_file(dir / "saved.mcap", path);
    const Status place = moved.check_place();
    ASSERT_FALSE(place.ok());
    EXPECT_NE(place.error().message.find("moved or replaced"), std::string::npos) << place.error().message;
    EXPECT_TRUE(moved.close().ok());
    EXPECT_EQ(packets_in(dir / "moved.mcap"), 50u);
  }
  {
    JournalWriter cut = begun();
    EXPECT_TRUE(cut.sync().ok());
    std::filesystem::resize_file(path, 1000);
    const Status place = cut.check_place();
    ASSERT_FALSE(place.ok());
    EXPECT_EQ(place.error().code, ErrorCode::Truncated);
    EXPECT_EQ(cut.packets_on_medium(), 0u) << "nothing is certain any more";
    EXPECT_FALSE(cut.append(sample_packets(1).front(), nanoseconds(0)).ok());
    EXPECT_FALSE(cut.close().ok());
    EXPECT_EQ(std::filesystem::file_size(path), 1000u) << "no end behind a hole";
  }
}

/// Pieces of all sizes, below and above what goes past the page cache, with odd beginnings, and cut back in between.
TEST(KernelDisk, HasTheSameBytesWhicheverWayTheyWereWritten) {
  const TemporaryFolder folder;
  auto file = FileWriter::create(folder / "file.bin", IfExists::Refuse);
  ASSERT_TRUE(file) << file.error().message;
  std::vector<std::byte> expected;
  std::uint32_t state = 1;
  const auto draw = [&](std::uint32_t below) { return (state = state * 1664525U + 1013904223U) / 65536U % below; };
  for (int call = 0; call < 40; ++call) {
    std::vector<std::vector<std::byte>> pieces(1 + draw(4));
    std::vector<ByteView> views;
    for (auto& piece : pieces) {
      piece.resize(call % 4 < 2 ? draw(60'000) * 100 : draw(9'000));
      for (std::byte& byte : piece) byte = static_cast<std::byte>(draw(256));
      views.emplace_back(piece);
      expected.insert(expected.end(), piece.begin(), piece.end());
    }
    ASSERT_TRUE(call % 3 == 0 ? file->write(views) : file->write_behind(views));
    EXPECT_EQ(file->size(), expected.size());
    EXPECT_TRUE(file->check_place());
    if (call % 9 == 8) {
      expected.resize(expected.size() - std::min<std::size_t>(expected.size(), 5000));
      ASSERT_TRUE(file->cut_back(expected.size()));
    }
  }
  ASSERT_TRUE(file->close());
  std::ifstream in(folder / "file.bin", std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  ASSERT_EQ(text.size(), expected.size());
  EXPECT_EQ(std::memcmp(text.data(), expected.data(), expected.size()), 0);
}

}  // namespace
}  // namespace hueline::storage
