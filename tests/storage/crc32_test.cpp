#include "storage/crc32.hpp"

#include <gtest/gtest.h>

#include "tests/storage/sample_packets.hpp"

namespace hueline::storage {
namespace {

TEST(Crc32, IsTheOneOfIeee8023) { EXPECT_EQ(crc32(0, as_bytes("123456789")), 0xCBF43926u); }

TEST(Crc32, IsNotChangedByNothing) { EXPECT_EQ(crc32(0xCBF43926u, {}), 0xCBF43926u); }

TEST(Crc32, CombinesWithoutTheBytes) {
  const Buffer all = test::pattern_buffer(100'000, 5);
  for (const std::size_t cut : {0u, 1u, 7u, 4096u, 65537u, 99'999u, 100'000u}) {
    const std::uint32_t a = crc32(0, all.bytes().first(cut)), b = crc32(0, all.bytes().subspan(cut));
    EXPECT_EQ(crc32_combine(a, b, all.size() - cut), crc32(0, all.bytes())) << "cut at " << cut;
  }
}

}  // namespace
}  // namespace hueline::storage
