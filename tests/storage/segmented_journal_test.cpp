// A recording in segments: it is the recording that one file would be, a ring removes nothing that a mark protects, and
// a volume that is full or fails loses nothing if there is a next one.
#include "storage/segmented_journal.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/drive_command.hpp"
#include "storage/journal_part.hpp"
#include "storage/journal_reader.hpp"
#include "storage/recording_config.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/folder_store.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_header;
using test::sample_packets;
using test::TemporaryFolder;
using test::time_of;
using testing::HasSubstr;

/// The kernel's disk without waiting for a medium, and with volumes that are full after a number of bytes.
class SmallDisk final : public Disk {
 public:
  std::map<std::string, std::int64_t> room;  ///< by folder; a folder that is not named has room for ever
  bool tells_its_room = true;                ///< otherwise a full volume shows by a refused write only

  bool creates_nothing = false;

  int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) override {
    if (creates_nothing) return -EDQUOT;
    int fd = -1;
    if (const int result = open_output(path, if_exists, fd); result != 0) return result;
    ::close(fd);
    std::unique_ptr<DiskFile> real;
    if (const int result = Disk::kernel().create(path, IfExists::Replace, real); result != 0) return result;
    file = std::make_unique<File>(std::move(real), left(path));
    return 0;
  }
  std::int64_t free_bytes(const std::filesystem::path& path) override {
    const std::int64_t* bytes = left(path);
    return bytes == nullptr || !tells_its_room ? INT64_MAX : *bytes;
  }

 private:
  class File final : public DiskFile {
   public:
    File(std::unique_ptr<DiskFile> real, std::int64_t* left) : real_(std::move(real)), left_(left) {}
    std::int64_t append(std::span<const iovec> pieces) override {
      iovec first = pieces.front();
      if (left_ != nullptr) {
        if (*left_ <= 0) return -ENOSPC;
        first.iov_len = std::min(first.iov_len, static_cast<std::size_t>(*left_));
      }
      const std::int64_t taken = real_->append(std::span(&first, 1));
      if (left_ != nullptr && taken > 0) *left_ -= taken;
      return taken;
    }
    std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
      return real_->overwrite(offset, bytes);
    }
    int sync() override { return 0; }
    int truncate(std::uint64_t size) override { return real_->truncate(size); }
    int close() override { return real_->close(); }

   private:
    std::unique_ptr<DiskFile> real_;
    std::int64_t* left_;
  };
  std::int64_t* left(const std::filesystem::path& path) {
    for (auto& [folder, bytes] : room)
      if (path.string().starts_with(folder)) return &bytes;
    return nullptr;
  }
};

SegmentedJournal::Config small_segments(std::uint64_t bytes) {
  SegmentedJournal::Config config;
  config.segment.chunk_bytes = 8192;
  config.segment_bytes = bytes;
  config.recording = "0123456789abcdef";
  return config;
}

struct Found {
  std::vector<Packet> packets;
  std::vector<std::string> troubles;
  ErrorCode end{};
};
Found read(const std::filesystem::path& path) {
  Found out;
  auto reader = JournalReader::open(path);
  if (!reader.ok()) {
    ADD_FAILURE() << reader.error().message;
    return out;
  }
  for (;;) {
    auto packet = (*reader)->next({});
    if (packet.ok()) {
      out.packets.push_back(*packet);
      continue;
    }
    out.end = packet.error().code;
    if (out.end == ErrorCode::Malformed) {
      out.troubles.push_back(packet.error().message);
      continue;
    }
    EXPECT_EQ((*reader)->next({}).error().code, out.end) << "the end is repeated";
    return out;
  }
}

void expect_same(const std::vector<Packet>& found, const std::vector<Packet>& packets) {
  ASSERT_EQ(found.size(), packets.size());
  for (std::size_t i = 0; i < packets.size(); ++i) ASSERT_TRUE(test::same(found[i], packets[i])) << i;
}

Result<SegmentedJournal> record(const std::filesystem::path& path, const std::vector<Packet>& packets,
                                const SegmentedJournal::Config& config, Disk& disk) {
  auto journal = SegmentedJournal::create(path, sample_header(), config, disk);
  EXPECT_TRUE(journal.ok()) << journal.error().message;
  for (const Packet& packet : packets) {
    const Status done = journal->append(packet, time_of(packet));
    EXPECT_TRUE(done.ok()) << done.error().message;
  }
  return journal;
}

TEST(SegmentedJournal, SegmentsReadAsTheOneFileThatTheyWouldBe) {
  TemporaryFolder folder;
  SmallDisk disk;
  const auto packets = sample_packets(2000);
  const auto whole = folder / "whole.mcap", split = folder / "drive.mcap";
  ASSERT_TRUE(record(whole, packets, {}, disk)->close().ok());
  auto journal = record(split, packets, small_segments(200'000), disk);
  ASSERT_TRUE(journal->close().ok());
  EXPECT_EQ(journal->packets_on_medium(), packets.size());
  const auto segments = find_segments(split).value();
  ASSERT_GT(segments.size(), 20u);
  std::uint64_t bytes = 0;
  for (const Segment& one : segments) {
    EXPECT_LT(std::filesystem::file_size(one.path), 200'000u + 10'000) << "with its summary";
    bytes += std::filesystem::file_size(one.path);
  }
  EXPECT_EQ(journal->bytes_written(), bytes);
  const test::FolderStore store(folder.path());
  for (const std::filesystem::path& place : {split, std::filesystem::path("s3://here/drive.mcap")}) {
    const Found found = read(place);
    EXPECT_EQ(found.end, ErrorCode::EndOfData);
    EXPECT_THAT(found.troubles, testing::IsEmpty());
    expect_same(found.packets, packets);
  }

  // A copy of the whole is one file with the same bytes, whether it comes from one or from many.
  for (const auto& [from, to] : {std::pair(whole, "a.mcap"), std::pair(split, "b.mcap")}) {
    auto reader = JournalReader::open(from);
    ASSERT_TRUE(reader.ok());
    ASSERT_TRUE(copy_part(**reader, "the drive", {}, folder / to).ok());
  }
  EXPECT_EQ(test::contents(folder / "a.mcap"), test::contents(folder / "b.mcap"));
}

TEST(SegmentedJournal, ANamedSegmentIsReadFromThereOn) {
  TemporaryFolder folder;
  SmallDisk disk;
  const auto packets = sample_packets(500);
  ASSERT_TRUE(record(folder / "drive.mcap", packets, small_segments(100'000), disk)->close().ok());
  const Found found = read(folder / "drive.000004.mcap");
  EXPECT_EQ(found.end, ErrorCode::EndOfData);
  EXPECT_THAT(found.troubles, testing::IsEmpty());
  ASSERT_LT(found.packets.size(), packets.size());
  expect_same(found.packets, {packets.end() - static_cast<std::ptrdiff_t>(found.packets.size()), packets.end()});
}

TEST(SegmentedJournal, SegmentsEndByTimeToo) {
  TemporaryFolder folder;
  SmallDisk disk;
  SegmentedJournal::Config config = small_segments(0);
  config.segment_time = std::chrono::milliseconds(100);
  const auto packets = sample_packets(1000);  // 0.7 s
  ASSERT_TRUE(record(folder / "drive.mcap", packets, config, disk)->close().ok());
  EXPECT_NEAR(static_cast<double>(find_segments(folder / "drive.mcap")->size()), 7, 1);
  expect_same(read(folder / "drive.mcap").packets, packets);
}

TEST(SegmentedJournal, SaysWhatIsMissingBetweenSegments) {
  TemporaryFolder folder;
  SmallDisk disk;
  const auto packets = sample_packets(1000);
  ASSERT_TRUE(record(folder / "drive.mcap", packets, small_segments(100'000), disk)->close().ok());
  const auto third = folder / "drive.000003.mcap", fifth = folder / "drive.000005.mcap";
  const std::string whole = test::contents(fifth);
  std::filesystem::remove(third);
  test::write_file(fifth, whole.substr(0, whole.size() / 2));
  const Found found = read(folder / "drive.mcap");
  EXPECT_EQ(found.end, ErrorCode::EndOfData);
  ASSERT_EQ(found.troubles.size(), 2u);
  EXPECT_THAT(found.troubles[0], HasSubstr("missing: copy them beside the others"));
  EXPECT_THAT(found.troubles[1], HasSubstr("000006.mcap goes on behind what is missing"));
  EXPECT_LT(found.packets.size(), packets.size());
  EXPECT_TRUE(test::same(found.packets.back(), packets.back()));

  // A segment of another recording, and one that a kill left without a header.
  SegmentedJournal::Config other = small_segments(100'000);
  other.recording = "fedcba9876543210";
  TemporaryFolder elsewhere;
  ASSERT_TRUE(record(elsewhere / "drive.mcap", packets, other, disk)->close().ok());
  std::filesystem::copy_file(elsewhere / "drive.000003.mcap", third);
  const Found mixed = read(folder / "drive.mcap");
  ASSERT_GE(mixed.troubles.size(), 1u);
  EXPECT_THAT(mixed.troubles[0], HasSubstr("another recording"));
  const auto segments = find_segments(folder / "drive.mcap").value();
  test::write_file(segment_path(folder / "drive.mcap", segments.back().number + 1), "");
  EXPECT_EQ(read(folder / "drive.mcap").end, ErrorCode::Truncated);
}

TEST(SegmentedJournal, AFileThatLooksLikeASegmentIsNotReadAsOne) {
  TemporaryFolder folder;
  SmallDisk disk;
  const auto packets = sample_packets(50);
  ASSERT_TRUE(record(folder / "drive.mcap", packets, {}, disk)->close().ok());
  ASSERT_TRUE(record(folder / "drive.000002.mcap", packets, {}, disk)->close().ok());
  expect_same(read(folder / "drive.mcap").packets, packets);
  expect_same(read(folder / "drive.000002.mcap").packets, packets);
}

TEST(SegmentedJournal, ARingOfAThousandWrapsKeepsWhatMarksProtect) {
  constexpr std::uint64_t kSegment = 6'000, kRing = 100'000;
  constexpr int kPackets = 15'000;
  TemporaryFolder folder;
  SmallDisk disk;
  SegmentedJournal::Config config = small_segments(kSegment);
  config.segment.chunk_bytes = 1024;
  config.ring_bytes = kRing;
  config.mark_before = std::chrono::milliseconds(60);
  config.mark_after = std::chrono::milliseconds(30);
  JournalHeader header = sample_header();
  header.files.clear();
  auto journal = SegmentedJournal::create(folder / "drive.mcap", header, config, disk);
  ASSERT_TRUE(journal.ok());
  std::mt19937 random(7);
  std::vector<HostTime> marks, stamps;
  std::uint64_t protected_bytes = 0;  // more than what a mark can protect: its time, and a segment at both ends
  for (int i = 0; i < kPackets; ++i) {
    Packet packet;
    packet.sensor = 1;
    packet.sequence = static_cast<std::uint64_t>(i);
    packet.received = host_time_ns(1'000'000'000 + std::int64_t{i} * 1'000'000 - static_cast<int>(random() % 500'000));
    packet.bytes = test::pattern_buffer(200 + random() % 200, static_cast<std::uint32_t>(i));
    if (i % 3000 == 2000) {
      packet.sensor = kSystemSensor;
      packet.kind = PacketKind::Command;
      packet.bytes = Buffer::copy_of(encode_command({DriveCommand::Kind::Mark, "here"}));
      marks.push_back(packet.received);
      protected_bytes += 95 * 1500 + 2 * kSegment;  // with the head of each segment
    }
    stamps.push_back(packet.received);
    ASSERT_TRUE(journal->append(packet, nanoseconds(std::int64_t{i} * 1'000'000)).ok());
    ASSERT_LE(journal->bytes_kept(), kRing + kSegment + protected_bytes) << i;
  }
  ASSERT_TRUE(journal->close().ok());
  const RemovedSegments removed = journal->removed();
  EXPECT_GT(removed.segments, 1000u);
  const auto news = journal->take_news();
  ASSERT_EQ(news.size(), 1u) << "it is told once";
  EXPECT_THAT(news[0].text, HasSubstr("the ring is full"));
  EXPECT_FALSE(news[0].is_trouble);
  std::uint64_t bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder.path())) bytes += file.file_size();
  EXPECT_EQ(bytes, journal->bytes_kept());
  const Found found = read(folder / "drive.mcap");
  EXPECT_EQ(found.end, ErrorCode::EndOfData);
  EXPECT_THAT(found.troubles, testing::IsEmpty()) << "what the ring has removed is no error";
  EXPECT_EQ(found.packets.size() + journal->removed().packets, static_cast<std::size_t>(kPackets));
  std::vector<bool> is_there(kPackets);
  for (const Packet& packet : found.packets) is_there[packet.sequence] = true;
  for (std::size_t i = 0; i < stamps.size(); ++i)
    for (const HostTime mark : marks)
      if (stamps[i] >= mark - config.mark_before && stamps[i] <= mark + config.mark_after) {
        ASSERT_TRUE(is_there[i]) << i;
      }
  EXPECT_TRUE(is_there.front() && is_there.back());

  // The recording itself says what was removed, also when a kill has left a last segment without a header.
  const auto expect_told = [&] {
    auto reader = JournalReader::open(folder / "drive.mcap");
    ASSERT_TRUE(reader.ok());
    const RemovedSegments told = (*reader)->removed();
    EXPECT_EQ(told.segments, removed.segments);
    EXPECT_EQ(told.packets, removed.packets);
    EXPECT_EQ(told.bytes, removed.bytes);
  };
  expect_told();
  test::write_file(segment_path(folder / "drive.mcap", journal->segment() + 1), "");
  expect_told();
  EXPECT_THAT(read(folder / "drive.mcap").troubles, testing::IsEmpty());
}

TEST(SegmentedJournal, ASplitThatFailsIsToldOnceAndTriedAgain) {
  TemporaryFolder folder;
  SmallDisk disk;
  const auto packets = sample_packets(1000, 3000);
  auto journal = SegmentedJournal::create(folder / "drive.mcap", sample_header(), small_segments(100'000), disk);
  ASSERT_TRUE(journal.ok());
  for (std::size_t i = 0; i < packets.size(); ++i) {
    disk.creates_nothing = i >= 200 && i < 600;
    const Status done = journal->append(packets[i], std::chrono::milliseconds(100 * i));
    ASSERT_TRUE(done.ok()) << i << ' ' << done.error().message;
  }
  ASSERT_TRUE(journal->close().ok());
  EXPECT_NEAR(static_cast<double>(journal->failed_splits()), 38, 2) << "each second of 40 s, once the segment is full";
  const auto news = journal->take_news();
  ASSERT_EQ(news.size(), 1u);
  EXPECT_TRUE(news[0].is_trouble);
  EXPECT_THAT(news[0].text, HasSubstr("next segment cannot be begun"));
  EXPECT_THAT(journal->take_news(), testing::IsEmpty());
  const Found found = read(folder / "drive.mcap");
  EXPECT_THAT(found.troubles, testing::IsEmpty());
  expect_same(found.packets, packets);
  EXPECT_GT(journal->segment(), 4u) << "it is split again";
}

TEST(SegmentedJournal, SegmentsOfAnotherDriveAreNotMixedWithThisOne) {
  TemporaryFolder folder;
  SmallDisk disk;
  test::write_file(folder / "drive.000007.mcap", "of a drive whose first file was moved away");
  const auto refused = SegmentedJournal::create(folder / "drive.mcap", sample_header(), small_segments(100'000), disk);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("drive.000007.mcap is a segment of another recording"));
  EXPECT_FALSE(std::filesystem::exists(folder / "drive.mcap"));
  EXPECT_TRUE(SegmentedJournal::create(folder / "drive.mcap", sample_header(), {}, disk).ok()) << "it is never split";
}

TEST(SegmentedJournal, AVolumeThatIsNotThereIsNotMade) {
  TemporaryFolder folder, second;
  EXPECT_THAT(volume_trouble(folder / "nothing", second.path()), HasSubstr("is its disk mounted?"));
  EXPECT_THAT(volume_trouble(folder.path(), second.path()), HasSubstr("lies on the same disk"));
  EXPECT_EQ(volume_trouble("/dev/shm", "/proc"), "");
  SmallDisk disk;
  disk.room = {{folder.path().string(), 300'000}};
  SegmentedJournal::Config config = small_segments(0);
  config.volumes = {folder / "unmounted", second.path()};
  auto journal = SegmentedJournal::create(folder / "drive.mcap", sample_header(), config, disk);
  ASSERT_TRUE(journal.ok());
  const auto packets = sample_packets(500, 3000);
  for (std::size_t i = 0; i < packets.size(); ++i)
    ASSERT_TRUE(journal->append(packets[i], std::chrono::milliseconds(100 * i)).ok());
  EXPECT_TRUE(journal->close().ok());
  EXPECT_FALSE(std::filesystem::exists(folder / "unmounted"));
  expect_same(read(folder / "drive.mcap").packets, packets);
}

class FullVolumes : public testing::TestWithParam<bool> {};

TEST_P(FullVolumes, TheRecordingGoesOnOnTheNextOne) {
  TemporaryFolder folder, second, third;
  SmallDisk disk;
  disk.tells_its_room = GetParam();
  disk.room = {{folder.path().string(), 300'000}, {second.path().string(), 500'000}};
  SegmentedJournal::Config config = small_segments(0);
  config.volumes = {second.path(), third.path()};
  config.volume_reserve = 100'000;
  const auto packets = sample_packets(1000, 3000);
  // Its clock runs so fast that the room is looked at often.
  auto journal = SegmentedJournal::create(folder / "drive.mcap", sample_header(), config, disk);
  ASSERT_TRUE(journal.ok());
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const Status done = journal->append(packets[i], std::chrono::milliseconds(100 * i));
    ASSERT_TRUE(done.ok()) << i << ' ' << done.error().message;
  }
  const Status closed = journal->close();
  EXPECT_TRUE(closed.ok()) << closed.error().message;
  EXPECT_EQ(journal->volume(), 2u);
  const auto news = journal->take_news();
  ASSERT_EQ(news.size(), 2u);
  EXPECT_THAT(news[0].text, HasSubstr(second.path().string()));
  EXPECT_THAT(news[1].text, HasSubstr(third.path().string()));
  const Found found = read(folder / "drive.mcap");
  EXPECT_EQ(found.end, ErrorCode::EndOfData);
  EXPECT_THAT(found.troubles, testing::IsEmpty());
  expect_same(found.packets, packets);
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "drive.000002.mcap"));
}
INSTANTIATE_TEST_SUITE_P(ForeseenOrNot, FullVolumes, testing::Bool());

TEST(SegmentedJournal, WithoutANextVolumeTheErrorIsThatOfTheDisk) {
  TemporaryFolder folder;
  SmallDisk disk;
  disk.room = {{folder.path().string(), 300'000}};
  auto journal = SegmentedJournal::create(folder / "drive.mcap", sample_header(), small_segments(100'000), disk);
  ASSERT_TRUE(journal.ok());
  Status done;
  const auto packets = sample_packets(1000, 3000);
  for (std::size_t i = 0; i < packets.size() && done.ok(); ++i) done = journal->append(packets[i], time_of(packets[i]));
  ASSERT_FALSE(done.ok());
  EXPECT_THAT(done.error().message, HasSubstr("disk is full"));
  EXPECT_FALSE(journal->close().ok());
  const Found found = read(folder / "drive.mcap");
  EXPECT_EQ(found.packets.size(), journal->packets_on_medium());
  EXPECT_GT(found.packets.size(), 100u);
}

TEST(SegmentedJournal, SaysWhichSettingIsWrong) {
  SegmentedJournal::Config config = small_segments(1000);
  config.recording.clear();
  EXPECT_THAT(config.validate(), HasSubstr("name of its own"));
  RecordingConfig keys;
  EXPECT_TRUE(keys.validate().empty());
  keys.ring_gb = 1;
  EXPECT_THAT(keys.validate().text(), HasSubstr("segment_mb"));
  keys.segment_mb = 600;
  EXPECT_THAT(keys.validate().text(), HasSubstr("room for two segments"));
  keys.segment_mb = 0.5;
  EXPECT_THAT(keys.validate().text(), HasSubstr("segment_mb"));
  keys.segment_mb = 500;
  EXPECT_EQ(keys.validate().text(), "");
}

}  // namespace
}  // namespace hueline::storage
