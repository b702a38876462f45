#include "core/buffer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <thread>
#include <vector>

namespace hueline {
namespace {

TEST(BufferPool, ReusesBlocksAndCountsWhatIsOut) {
  BufferPool pool(1 << 20);
  const std::byte* first = nullptr;
  {
    MutableBuffer a = pool.acquire(1000);
    ASSERT_TRUE(a);
    EXPECT_EQ(a.size(), 1000u);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a.data()) % 64, 0u);
    EXPECT_EQ(pool.bytes_in_use(), 1024u);
    first = a.data();
    const Buffer shared = std::move(a).share();
    const Buffer again = shared;
    EXPECT_EQ(again.data(), first) << "sharing must not copy";
  }
  EXPECT_EQ(pool.bytes_in_use(), 0u);
  EXPECT_EQ(pool.acquire(900).data(), first) << "a freed block of the class is used again";
}

TEST(BufferPool, RefusesBeyondItsLimitAndRecovers) {
  BufferPool pool(4096);
  MutableBuffer a = pool.acquire(2048), b = pool.acquire(2048);
  ASSERT_TRUE(a && b);
  EXPECT_FALSE(pool.acquire(1));
  a = MutableBuffer();
  EXPECT_TRUE(pool.acquire(300));
}

TEST(BufferPool, IdleBlocksOfOtherSizesGiveWay) {
  BufferPool pool(4096);
  { MutableBuffer small[4] = {pool.acquire(1024), pool.acquire(1024), pool.acquire(1024), pool.acquire(1024)}; }
  EXPECT_TRUE(pool.acquire(4096));
}

TEST(Buffer, PartSharesTheMemoryAndHoldsIt) {
  BufferPool pool(1 << 16);
  Buffer inner;
  {
    MutableBuffer m = pool.acquire(1000);
    m.data()[300] = std::byte{7};
    const Buffer whole = std::move(m).share();
    const Buffer part = whole.part(200, 200);
    EXPECT_EQ(part.data(), whole.data() + 200) << "a part must not copy";
    inner = part.part(100, 5000);
    EXPECT_EQ(inner.size(), 100u) << "clipped to the part it was taken from";
    EXPECT_EQ(whole.part(2000, 1).size(), 0u);
  }
  EXPECT_EQ(inner.bytes()[0], std::byte{7});
  EXPECT_EQ(pool.bytes_in_use(), 1024u) << "the part keeps the block out of the pool";
  inner = Buffer();
  EXPECT_EQ(pool.bytes_in_use(), 0u);
  EXPECT_TRUE(Buffer().part(0, 1).empty());
}

TEST(Buffer, OutlivesItsPoolAndIsSharedByThreads) {
  Buffer shared;
  {
    BufferPool pool(1 << 16);
    MutableBuffer m = pool.acquire(256);
    m.data()[0] = std::byte{42};
    shared = std::move(m).share();
  }
  std::vector<std::jthread> readers;
  for (int i = 0; i < 4; ++i)
    readers.emplace_back([copy = shared] {
      for (int k = 0; k < 1000; ++k) {
        const Buffer mine = copy;
        ASSERT_EQ(mine.bytes()[0], std::byte{42});
      }
    });
}

struct Lender : BufferLender {
  explicit Lender(int& returned) : returned_(returned) {}
  void give_back(const std::byte* data) noexcept override { returned_ += data == memory.data(); }
  std::array<std::byte, 64> memory{};
  int& returned_;
};

TEST(Buffer, LentMemoryIsReadInPlaceAndGivenBackOnceByWhoeverHeldItLast) {
  int returned = 0;
  Buffer part;
  {
    auto lender = std::make_shared<Lender>(returned);
    const std::byte* const memory = lender->memory.data();
    MutableBuffer written = MutableBuffer::lent(lender, lender->memory);
    ASSERT_EQ(written.data(), memory);
    written.data()[40] = std::byte{9};
    written.resize(50);
    const Buffer whole = std::move(written).share();
    EXPECT_EQ(whole.size(), 50u);
    EXPECT_EQ(whole.data(), memory);
    part = whole.part(40, 10);
    const Buffer again = Buffer::lent(lender, lender->memory);
    EXPECT_EQ(again.data(), memory);
  }
  EXPECT_EQ(returned, 1) << "the second loan is over, the part of the first is not";
  std::jthread([last = std::move(part)]() mutable {
    EXPECT_EQ(last.bytes()[0], std::byte{9}) << "the lender went before the buffer";
    last = {};
  }).join();
  EXPECT_EQ(returned, 2);
}

TEST(Buffer, CopyOfEmptyIsEmpty) { EXPECT_TRUE(Buffer::copy_of({}).empty()); }

}  // namespace
}  // namespace hueline
