#include "object_store/block_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace hueline::object_store {
namespace {

/// A file in memory that notes what is fetched of it. Its bytes are the low bits of their place, by a prime.
class Source {
 public:
  explicit Source(std::uint64_t size) : size_(size) {}
  static std::byte at(std::uint64_t place) { return static_cast<std::byte>(place % 251); }

  BlockReader::Fetch fetch() {
    return [this](std::uint64_t offset, std::span<std::byte> out, const std::stop_token&) -> Status {
      EXPECT_LE(offset + out.size(), size_);
      const std::lock_guard lock(mutex_);
      fetched_.emplace_back(offset, out.size());
      if (failures_ > 0) {
        --failures_;
        return Error{ErrorCode::Io, "the source fails"};
      }
      for (std::size_t i = 0; i < out.size(); ++i) out[i] = at(offset + i);
      return {};
    };
  }
  std::uint64_t bytes() {
    const std::lock_guard lock(mutex_);
    std::uint64_t sum = 0;
    for (const auto& [offset, size] : fetched_) sum += size;
    return sum;
  }
  std::vector<std::pair<std::uint64_t, std::size_t>> fetched() {
    const std::lock_guard lock(mutex_);
    return fetched_;
  }
  void fail(int times) {
    const std::lock_guard lock(mutex_);
    failures_ = times;
  }

 private:
  const std::uint64_t size_;
  std::mutex mutex_;
  std::vector<std::pair<std::uint64_t, std::size_t>> fetched_;
  int failures_ = 0;
};

constexpr BlockReader::Config kSmall{100, 4, 2, 8, 16, 2};

::testing::AssertionResult gives(BlockReader& reader, std::uint64_t offset, std::size_t size) {
  std::vector<std::byte> out(size);
  if (const Status read = reader.read(offset, out); !read.ok())
    return ::testing::AssertionFailure() << read.error().message;
  for (std::size_t i = 0; i < size; ++i)
    if (out[i] != Source::at(offset + i)) return ::testing::AssertionFailure() << "byte " << offset + i << " is wrong";
  return ::testing::AssertionSuccess();
}

TEST(BlockReader, FetchesTheBlocksOfAJumpAndNoOthers) {
  Source source(10'000);
  BlockReader reader(10'000, source.fetch(), kSmall);
  EXPECT_TRUE(gives(reader, 5'050, 10));
  EXPECT_TRUE(gives(reader, 5'070, 30));   // of the same block
  EXPECT_TRUE(gives(reader, 9'950, 50));   // the end
  EXPECT_TRUE(gives(reader, 2'099, 102));  // parts of three blocks come together
  const std::vector<std::pair<std::uint64_t, std::size_t>> expected{{5'000, 100}, {9'900, 100}, {2'000, 300}};
  EXPECT_EQ(source.fetched(), expected);
}

TEST(BlockReader, ReadsTheWholeOnceAndNothingTwice) {
  Source source(10'050);
  BlockReader reader(10'050, source.fetch(), kSmall);
  for (std::uint64_t at = 0; at < 10'050; at += 30)
    ASSERT_TRUE(gives(reader, at, std::min<std::uint64_t>(30, 10'050 - at)));
  EXPECT_EQ(source.bytes(), 10'050u);
  // It read ahead in larger pieces than it was asked for.
  EXPECT_LT(source.fetched().size(), 60u);
}

TEST(BlockReader, KeepsTheHeadThatIsKnown) {
  Source source(1'000);
  std::vector<std::byte> head(100);
  for (std::size_t i = 0; i < head.size(); ++i) head[i] = Source::at(i);
  BlockReader reader(1'000, source.fetch(), kSmall, head);
  EXPECT_TRUE(gives(reader, 0, 100));
  EXPECT_EQ(source.fetched().size(), 0u);
}

TEST(BlockReader, ReadsMoreThanItKeeps) {
  Source source(10'000);
  BlockReader reader(10'000, source.fetch(), kSmall);
  EXPECT_TRUE(gives(reader, 0, 10'000));
  EXPECT_TRUE(gives(reader, 0, 100));
}

TEST(BlockReader, TellsAFailureAndAsksAgain) {
  Source source(1'000);
  BlockReader reader(1'000, source.fetch(), kSmall);
  source.fail(1);
  std::vector<std::byte> out(50);
  const Status read = reader.read(300, out);
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().message, "the source fails");
  EXPECT_TRUE(gives(reader, 300, 50));
}

TEST(BlockReader, ServesSeveralThreads) {
  Source source(100'000);
  BlockReader reader(100'000, source.fetch(), kSmall);
  std::atomic<int> wrong = 0;
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t first = 0; first < 4; ++first)
      threads.emplace_back([&, first] {
        for (std::uint64_t at = first * 7'000; at + 333 <= 100'000; at += 333) wrong += !gives(reader, at, 333);
      });
  }
  EXPECT_EQ(wrong, 0);
}

TEST(BlockReader, EndsWhileItReadsAhead) {
  for (int i = 0; i < 20; ++i) {
    Source source(10'000);
    BlockReader reader(10'000, source.fetch(), kSmall);
    EXPECT_TRUE(gives(reader, 0, 1'000));
  }
}

}  // namespace
}  // namespace hueline::object_store
