#include "fusion/coded_nearness.hpp"

#include <gtest/gtest.h>

namespace hueline::fusion {
namespace {

TEST(CodedNearness, ErrsByAFourThousandthTowardsFarther) {
  CodedNearness before = 0;
  for (float distance = 1023; distance > 0.02f; distance *= 0.9999f) {
    const float nearness = 1 / distance, back = decoded(coded(nearness));
    ASSERT_LE(back, nearness);
    ASSERT_GE(back, nearness * (1 - 1 / 4096.0f));
    ASSERT_GE(coded(nearness), before);  // codes compare as what they stand for
    before = coded(nearness);
    ASSERT_EQ(coded(back), before);
  }
  EXPECT_GT(before, 0xE000);
}

TEST(CodedNearness, KnowsNothingBeyondAKilometreAndKeepsWhatIsNearest) {
  EXPECT_EQ(coded(0), 0);
  EXPECT_EQ(coded(-0.5f), 0);
  EXPECT_EQ(coded(1 / 1100.0f), 0);
  EXPECT_EQ(decoded(0), 0.0f);
  EXPECT_EQ(coded(1e6f), 0xFFFF);
}

}  // namespace
}  // namespace hueline::fusion
