#include "drivers/message_counter.hpp"

#include <gtest/gtest.h>

namespace hueline::drivers {
namespace {

TEST(MessageCounter, CountsEachName) {
  DecodeCounts counts;
  MessageCounter counter;
  for (int i = 0; i < 3; ++i) counter.add(counts, "data");
  counter.add(counts, "data dual");
  counter.add(counts, "data");
  EXPECT_EQ(counts.messages["data"], 4u);
  EXPECT_EQ(counts.messages["data dual"], 1u);
  EXPECT_EQ(counts.messages.size(), 2u);
}

TEST(MessageCounter, OfACopyCountsInItsOwnCounts) {
  struct Decoder {
    DecodeCounts counts;
    MessageCounter counter;
  } first;
  first.counter.add(first.counts, "data");
  Decoder second = first, third;
  third = first;
  second.counter.add(second.counts, "data");
  third.counter.add(third.counts, "data");
  EXPECT_EQ(first.counts.messages["data"], 1u);
  EXPECT_EQ(second.counts.messages["data"], 2u);
  EXPECT_EQ(third.counts.messages["data"], 2u);
}

}  // namespace
}  // namespace hueline::drivers
