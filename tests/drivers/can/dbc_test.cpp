// DBC files: multiplexed signals, names of values, floating point, and files that are wrong in parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>

#include "drivers/can/dbc.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

Dbc fixture() {
  std::ifstream in(test::source_dir() / "tests/drivers/can/multiplexed.dbc");
  return read_dbc(std::string(std::istreambuf_iterator<char>(in), {}));
}

std::map<std::string, double> values(const Dbc& dbc, std::uint32_t id, bool is_extended,
                                     const std::vector<std::uint8_t>& data) {
  std::map<std::string, double> out;
  for (const DbcValue& value : decode(*dbc.find(id, is_extended), data)) out[value.signal->name] = value.value;
  return out;
}

TEST(Dbc, ReadsTheWholeFixture) {
  const Dbc dbc = fixture();
  EXPECT_TRUE(dbc.troubles.empty());
  ASSERT_EQ(dbc.messages.size(), 3u);
  EXPECT_EQ(dbc.find(352, true)->name, "Nested");
  EXPECT_EQ(dbc.find(352, false), nullptr);
}

TEST(Dbc, OnlySelectedSignalsAreThere) {
  const Dbc dbc = fixture();
  EXPECT_THAT(values(dbc, 100, false, {0, 0xFE, 0xFF, 0, 0, 0, 0, 9}),
              ElementsAre(Pair("Always", 9), Pair("Selector", 0), Pair("Zero", -4)));
  EXPECT_THAT(values(dbc, 100, false, {2, 0, 0, 0, 0, 0, 0, 9}), ElementsAre(Pair("Always", 9), Pair("Selector", 2)));
  EXPECT_THAT(values(dbc, 100, false, {0, 1, 0}), ElementsAre(Pair("Selector", 0), Pair("Zero", -2.5)));  // short
}

TEST(Dbc, SelectorsMayBeSelectedAndHaveRanges) {
  const Dbc dbc = fixture();
  std::vector<std::uint8_t> data(64);
  const auto names = [&](std::uint8_t first) {
    data[0] = first;
    std::string out;
    for (const auto& [name, value] : values(dbc, 352, true, data)) out += name + " ";
    return out;
  };
  EXPECT_EQ(names(0x21), "Deep Far Inner Outer ");
  EXPECT_EQ(names(0x11), "Far Inner Outer ");
  EXPECT_EQ(names(0x20), "Far Outer ");  // the inner selector is not there, whatever its bits are
  EXPECT_EQ(names(0x04), "Far Outer Range ");
  EXPECT_EQ(names(0x09), "Far Outer Range ");
  EXPECT_EQ(names(0x06), "Far Outer ");
}

TEST(Dbc, WordsAndFloatingPoint) {
  const Dbc dbc = fixture();
  const auto one = decode(*dbc.find(100, false), std::vector<std::uint8_t>{1, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_NE(one[0].word, nullptr);
  EXPECT_EQ(*one[0].word, "one; or more");
  std::vector<std::uint8_t> data(12);
  const float single = -1.5f;
  const double twice = 0.25;
  std::memcpy(data.data(), &single, 4);
  std::memcpy(data.data() + 4, &twice, 8);
  EXPECT_THAT(values(dbc, 101, false, data), ElementsAre(Pair("Single", -1.5), Pair("Twice", 1.5)));
}

TEST(Dbc, WhatIsWrongIsToldAndTheRestIsRead) {
  const Dbc dbc = read_dbc(
      "BO_ 1 A: 8 X\n SG_ bad : 0|99@1+ (1,0) [0|0] \"\" X\n SG_ good : 0|8@1+ (1,0) [0|0] \"\" X\n"
      "BO_ two B: 8 X\n SG_ lost : 0|8@1+ (1,0) [0|0] \"\" X\nBO_ 3 C: 8 X\n SG_ a mX : 0|8@1+ (1,0) [0|0] \"\" X\n"
      "CM_ \"never ends\nBO_ 4 D: 8 X\n SG_ b : 0|8@1+ (1,0) [0|0] \"\" X\n");
  ASSERT_EQ(dbc.troubles.size(), 4u);
  EXPECT_THAT(dbc.troubles[0], HasSubstr("line 2: bad"));
  EXPECT_THAT(dbc.troubles[1], HasSubstr("line 4"));
  EXPECT_THAT(dbc.troubles[2], HasSubstr("line 5"));  // a signal of no message does not fall to the one before
  EXPECT_THAT(dbc.troubles[3], HasSubstr("line 7"));
  ASSERT_EQ(dbc.messages[0].signals.size(), 1u);
  EXPECT_EQ(dbc.messages[0].signals[0].name, "good");
  ASSERT_NE(dbc.find(4, false), nullptr);
  EXPECT_EQ(dbc.find(4, false)->signals.size(), 1u);
}

TEST(Dbc, AnIdOfMoreThan11BitsIsExtended) {
  const Dbc dbc = read_dbc("BO_ 13274 A: 5 X\n SG_ a : 0|8@1+ (1,0) [0|1.84467e+19] \"\" X\nVAL_ 13274 a 1 \"on\" ;\n");
  ASSERT_NE(dbc.find(13274, true), nullptr);
  EXPECT_EQ(dbc.find(13274, true)->signals.at(0).words.at(1), "on");
}

/// As an editor of DBC files writes the limits of a signal with many bits.
TEST(Dbc, LimitsBeyondThoseOfADoubleAreLimits) {
  const Dbc dbc = read_dbc(
      "BO_ 1 A: 8 X\n SG_ a : 0|8@1+ (1,0) [0|4.446241647709404462001681407E+481] \"\" X\n"
      " SG_ b : 8|8@1- (1,0) [-1e999|1e-999] \"\" X\n SG_ c : 16|8@1+ (1,0) [0|] \"\" X\n");
  ASSERT_EQ(dbc.troubles.size(), 1u);
  EXPECT_THAT(dbc.troubles[0], HasSubstr("line 4: [min|max]"));
  const auto& signals = dbc.find(1, false)->signals;
  ASSERT_EQ(signals.size(), 2u);
  EXPECT_EQ(signals[0].signal.max, std::numeric_limits<double>::max());
  EXPECT_EQ(signals[1].signal.min, std::numeric_limits<double>::lowest());
  EXPECT_EQ(signals[1].signal.max, 0);
  EXPECT_THAT(values(dbc, 1, false, {7, 0xFF, 0, 0, 0, 0, 0, 0}), ElementsAre(Pair("a", 7), Pair("b", -1)));
}

TEST(Dbc, AMessageInsideACommentIsNone) {
  const Dbc dbc = read_dbc(
      "CM_ \"goes on\nBO_ 9 NotAMessage: 8 A\n SG_ a : 0|8@1+ (1,0) [0|0] \\\"\\\" B\n\";\n"
      "BO_ 1 A: 8 X\n SG_ a : 0|8@1+ (1,0) [0|0] \"\" X\n");
  EXPECT_TRUE(dbc.troubles.empty());
  EXPECT_EQ(dbc.find(9, false), nullptr);
  EXPECT_EQ(dbc.find(1, false)->signals.size(), 1u);
}

TEST(Dbc, SelectorsInACircleEnd) {
  const Dbc dbc = read_dbc(
      "BO_ 1 A: 8 X\n SG_ a m0M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ b m0M : 8|8@1+ (1,0) [0|0] \"\" X\n"
      "SG_MUL_VAL_ 1 a b 0-0;\nSG_MUL_VAL_ 1 b a 0-0;\n");
  EXPECT_TRUE(decode(dbc.messages.at(0), std::vector<std::uint8_t>(8)).empty());
}

}  // namespace
}  // namespace hueline::drivers
