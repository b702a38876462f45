#include "core/nearest_word.hpp"

#include <gtest/gtest.h>

namespace hueline {
namespace {

const std::vector<std::string> kWords{"position_m", "rotation_deg", "threads", "capture", "calibrate"};

TEST(NearestWord, FindsWhatWasProbablyMeant) {
  EXPECT_EQ(nearest_word("position_mm", kWords), "position_m");
  EXPECT_EQ(nearest_word("thread", kWords), "threads");
  EXPECT_EQ(nearest_word("rotation", kWords), "rotation_deg");
  EXPECT_EQ(nearest_word("cpature", kWords), "capture");
  EXPECT_EQ(nearest_word("calbirate", kWords), "calibrate");
  EXPECT_EQ(did_you_mean("thraeds", kWords), "; did you mean threads?");
}

TEST(NearestWord, GuessesNothingFarAway) {
  EXPECT_EQ(nearest_word("port", kWords), "");
  EXPECT_EQ(nearest_word("", kWords), "");
  EXPECT_EQ(nearest_word("x", {}), "");
  EXPECT_EQ(nearest_word(std::string(100'000, 'c'), kWords), "");
  EXPECT_EQ(did_you_mean("speed", kWords), "");
}

}  // namespace
}  // namespace hueline
