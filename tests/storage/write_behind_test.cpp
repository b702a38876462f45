// Writing with a thread of its own: the same bytes in the same order, and what could not be written is told.
#include "storage/write_behind.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <span>
#include <vector>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_header;
using test::TemporaryFolder;

constexpr std::size_t kRoom = BlockMemory::kBlock;

int settled(WriteBehind& behind, std::uint64_t expected_missing = 0) {
  std::uint64_t missing = 0;
  const int result = behind.settle(missing);
  EXPECT_EQ(missing, expected_missing);
  EXPECT_TRUE(behind.is_settled());
  return result;
}

/// Takes the bytes of some parts, `most` of them at most, as pwritev() may.
std::vector<std::byte> bytes_of(std::span<const iovec> parts, std::size_t most = SIZE_MAX) {
  std::vector<std::byte> out;
  for (const iovec& part : parts) {
    const auto* from = static_cast<const std::byte*>(part.iov_base);
    out.insert(out.end(), from, from + std::min(part.iov_len, most - out.size()));
  }
  return out;
}

/// Hands over a piece of `size` bytes of this value. Returns false if none is taken any more.
bool put_piece(WriteBehind& behind, std::uint64_t offset, std::size_t size, int value) {
  std::byte* const piece = behind.free_piece();
  if (piece == nullptr) return false;
  std::memset(piece + 7, value, size);
  behind.hand_over(offset, 7, size);
  return true;
}

TEST(WriteBehind, WritesInOrderThroughShortWritesAndInterrupts) {
  std::vector<std::byte> file, expected;
  int calls = 0;
  WriteBehind behind(kRoom, [&](std::uint64_t offset, std::span<const iovec> parts) -> std::int64_t {
    EXPECT_EQ(offset, file.size()) << "in order, without a gap";
    if (++calls % 3 == 0) return -EINTR;
    const auto taken = bytes_of(parts, 1000);
    file.insert(file.end(), taken.begin(), taken.end());
    return static_cast<std::int64_t>(taken.size());
  });
  for (int i = 0; i < 50; ++i) {
    const std::size_t size = 1 + static_cast<std::size_t>(i) * 80;
    ASSERT_TRUE(put_piece(behind, expected.size(), size, i));
    expected.insert(expected.end(), size, static_cast<std::byte>(i));
    if (i % 10 == 9) {
      ASSERT_EQ(settled(behind), 0);
      ASSERT_EQ(file, expected);
    }
  }
}

TEST(WriteBehind, WritesTogetherWhatFollowsAtBlocks) {
  constexpr std::size_t kBlock = BlockMemory::kBlock;
  std::vector<std::byte> file, expected;
  std::vector<std::size_t> calls;  // numbers of parts
  std::mutex mutex;
  std::condition_variable changed;
  bool may_go_on = false;
  std::size_t step = SIZE_MAX;
  WriteBehind behind(4 * kBlock, [&](std::uint64_t offset, std::span<const iovec> parts) -> std::int64_t {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return may_go_on; });
    EXPECT_EQ(offset, file.size());
    std::uint64_t end = offset;
    for (const iovec& part : parts.first(parts.size() - 1)) EXPECT_EQ((end += part.iov_len) % kBlock, 0u);
    calls.push_back(parts.size());
    const auto taken = bytes_of(parts, step);
    file.insert(file.end(), taken.begin(), taken.end());
    return static_cast<std::int64_t>(taken.size());
  });
  const auto put = [&](std::size_t begin, std::size_t size, int value) {
    std::byte* const piece = behind.free_piece();
    ASSERT_NE(piece, nullptr);
    std::memset(piece + begin, value, size);
    behind.hand_over(expected.size(), begin, size);
    expected.insert(expected.end(), size, static_cast<std::byte>(value));
  };
  const auto write_waiting = [&] {
    {
      const std::lock_guard lock(mutex);
      may_go_on = true;
    }
    changed.notify_all();
    EXPECT_EQ(settled(behind), 0);
    const std::lock_guard lock(mutex);
    may_go_on = false;
    EXPECT_EQ(file, expected);
  };
  for (int i = 0; i < 6; ++i) put(0, kBlock, i);
  write_waiting();
  // The thread may have had the first piece before the others came.
  EXPECT_GE(calls.size(), 2u);
  EXPECT_LE(calls.size(), 3u);
  EXPECT_EQ(*std::max_element(calls.begin(), calls.end()), WriteBehind::kMostAtOnce);
  // A piece that does not end at a block is the last of its call; the next one begins within the block.
  calls.clear();
  put(0, kBlock, 10);
  put(0, 2 * kBlock + 100, 11);
  put(100, kBlock - 100, 12);
  put(0, 2 * kBlock, 13);
  put(0, 50, 14);
  write_waiting();
  EXPECT_LE(calls.size(), 4u);
  // What a call leaves is written by the next ones.
  step = 3000;
  put(50, kBlock - 50, 15);
  for (int i = 0; i < 7; ++i) put(0, kBlock * (1 + static_cast<std::size_t>(i) % 3), 16 + i);
  write_waiting();
}

TEST(WriteBehind, WritesNothingBehindWhatFailed) {
  for (const std::int64_t answer : {std::int64_t{-ENOSPC}, std::int64_t{0}}) {
    std::size_t written = 0;
    bool is_full = true;
    WriteBehind behind(kRoom, [&](std::uint64_t offset, std::span<const iovec> parts) -> std::int64_t {
      if (is_full && offset == 200) return answer;
      const std::size_t size = bytes_of(parts).size();
      written += size;
      return static_cast<std::int64_t>(size);
    });
    int taken = 0;
    while (taken < 20 && put_piece(behind, static_cast<std::uint64_t>(taken) * 100, 100, taken)) ++taken;
    EXPECT_GE(taken, 3);
    EXPECT_LE(taken, 11) << "eight pieces wait at most";
    EXPECT_EQ(settled(behind, static_cast<std::uint64_t>(taken) * 100 - 200), answer == 0 ? -EIO : -ENOSPC);
    EXPECT_EQ(written, 200u);
    EXPECT_FALSE(put_piece(behind, 300, 100, 1)) << "until somebody has cut the file back";
    behind.forget();
    is_full = false;
    EXPECT_TRUE(put_piece(behind, 200, 100, 1));
    EXPECT_EQ(settled(behind), 0);
    EXPECT_EQ(written, 300u);
  }
}

/// The files of this process have this many bytes at most while it lives.
class FileLimit {
 public:
  explicit FileLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit now{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FileLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FileLimit(const FileLimit&) = delete;
  FileLimit& operator=(const FileLimit&) = delete;

 private:
  rlimit before_{};
};

/// The kernel refuses the middle of an image that the recorder has taken already.
TEST(WriteBehind, AJournalOfImagesSaysWhatIsInItWhenTheKernelRefusesLate) {
  std::vector<Packet> packets;
  for (std::uint32_t i = 0; i < 8; ++i) {
    Packet p;
    p.sensor = 2;
    p.sequence = i;
    p.received = host_time_ns(static_cast<std::int64_t>(i) * 1'000'000);
    p.bytes = test::pattern_buffer(5'300'001 + i, i);
    packets.push_back(p);
  }
  const TemporaryFolder folder;
  for (rlim_t limit = 1'000'000; limit < 50'000'000; limit += 1'700'000) {
    SCOPED_TRACE(limit);
    JournalWriter::Config config;
    config.if_exists = IfExists::Replace;
    auto writer = JournalWriter::create(folder / "drive.mcap", sample_header(), config);
    ASSERT_TRUE(writer);
    std::size_t taken = 0;
    Status closed;
    {
      const FileLimit full(limit);
      while (taken < packets.size() && writer->append(packets[taken], test::time_of(packets[taken]))) ++taken;
      closed = writer->close();
    }
    const bool has_room = limit > 42'500'000;
    EXPECT_EQ(closed.ok(), has_room) << (closed.ok() ? "" : closed.error().message);
    EXPECT_EQ(writer->packets_written() + writer->packets_lost(), taken);
    EXPECT_EQ(writer->packets_on_medium(), writer->packets_written());
    EXPECT_EQ(writer->packets_written(), std::min<std::uint64_t>(limit / 5'300'500, packets.size()));
    auto reader = JournalReader::open(folder / "drive.mcap");
    ASSERT_TRUE(reader.ok());
    std::size_t read = 0;
    for (; auto packet = (*reader)->next({}); ++read) EXPECT_TRUE(test::same(*packet, packets[read]));
    EXPECT_EQ(read, writer->packets_written());
  }
}

}  // namespace
}  // namespace hueline::storage
