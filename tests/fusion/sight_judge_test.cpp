#include "fusion/sight_judge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "fusion/sight_trees.hpp"
#include "tests/support/each_instruction_set.hpp"

namespace hueline::fusion {
namespace {

using testing::Ge;
using testing::Gt;
using testing::Lt;

float log_odds_of(const SightEvidence& evidence) {
  SightTable table;
  table.add(evidence);
  std::vector<float> log_odds;
  log_odds_of_sights(table, log_odds);
  return log_odds.at(0);
}

/// Ten metres away. Something whose nearness is `ratio` of the place's fills its cell and those around, as a closed
/// surface and as points of it; at the moment itself nothing is known.
float behind(float ratio, float parallax, float agreement) {
  const bool is_before = ratio > 1.02f;
  return log_odds_of({parallax, 10, agreement, ratio, ratio, ratio, is_before ? 9.0f : 0.0f, is_before ? 0.0f : 9.0f});
}

TEST(SightJudge, APlaceBehindNothingIsSeenWhereImagesAgree) {
  for (const float parallax : {0.01f, 0.1f, 0.3f, 0.8f})
    for (const float agreement : {1.0f, 2.0f, 4.0f}) EXPECT_THAT(behind(0.9f, parallax, agreement), Ge(kSeen));
}

TEST(SightJudge, APlaceFarBehindSomethingIsHiddenWhereFewImagesAgree) {
  for (const float parallax : {0.1f, 0.3f, 0.8f})
    for (const float ratio : {1.3f, 2.0f, 4.0f})
      for (const float agreement : {0.0f, 0.3f, 0.6f}) EXPECT_THAT(behind(ratio, parallax, agreement), Lt(kSeen));
}

TEST(SightJudge, WhatTheScannerSawPastHidesLessTheLessItShiftsAgainstThePlace) {
  EXPECT_THAT(behind(1.2f, 0.01f, 1), Gt(behind(1.2f, 0.1f, 1)));
  EXPECT_THAT(behind(1.2f, 0.1f, 1), Gt(behind(1.2f, 0.8f, 1)));
  EXPECT_THAT(behind(1.03f, 0.3f, 1), Gt(behind(1.3f, 0.3f, 1)));
  EXPECT_THAT(behind(1.3f, 0.3f, 1), Gt(behind(3.0f, 0.3f, 1)));
}

TEST(SightJudge, ImagesThatAgreeOutweighAClosedGap) {
  // A gap that was closed: no point in the cell itself, and points of the place's surface in some around.
  const auto in_a_gap = [](float agreement) { return log_odds_of({0.1f, 10, agreement, 2, 0, 2, 2, 3}); };
  EXPECT_THAT(in_a_gap(0), Lt(kSeen));
  EXPECT_THAT(in_a_gap(4), Gt(kSeen));
}

/// The sum of the trees' values as the header describes it.
float sum_of_values(const SightEvidence& evidence) {
  float sum = 0;
  for (const SightTree& tree : kSightTrees) {
    std::size_t answer = 0;
    for (const SightTree::Question& question : tree.questions)
      answer = 2 * answer + (evidence[static_cast<std::size_t>(question.about)] >= question.least ? 1U : 0U);
    sum += tree.values[answer];
  }
  return sum;
}

TEST(SightJudge, EachInstructionSetGivesTheSumOfTheValuesToTheBit) {
  std::mt19937 random(7);
  SightTable table;
  std::vector<SightEvidence> all(101);
  for (SightEvidence& evidence : all) {
    for (float& value : evidence) value = std::uniform_real_distribution<float>(0, 3)(random);
    const std::size_t rows = table.size();
    EXPECT_EQ(table.add(evidence), rows);
  }
  all[40][static_cast<std::size_t>(Evidence::Agreement)] = 2.5f;
  table.set(40, Evidence::Agreement, 2.5f);
  EXPECT_EQ(table[40], all[40]);
  std::vector<float> log_odds;
  test::with_each_instruction_set([&] {
    log_odds_of_sights(table, log_odds);
    ASSERT_EQ(log_odds.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(log_odds[i], sum_of_values(all[i])) << i;
  });
}

TEST(SightJudge, AsksInTheOrderOfTheTrees) {
  SightEvidence evidence{};
  float least = 0, most = 0;
  for (const SightTree& tree : kSightTrees) {
    least += tree.values.front();
    most += tree.values.back();
    for (const SightTree::Question& question : tree.questions) EXPECT_THAT(question.least, Gt(0.0f));
  }
  EXPECT_FLOAT_EQ(log_odds_of(evidence), least);
  evidence.fill(1e9f);
  EXPECT_FLOAT_EQ(log_odds_of(evidence), most);
}

TEST(SightJudge, ATableIsUsedAgain) {
  SightTable table;
  for (int i = 0; i < 40; ++i) table.add({});
  table.clear();
  EXPECT_EQ(table.size(), 0u);
  EXPECT_EQ(table.add({1, 2, 3}), 0u);
  EXPECT_EQ(table[0], (SightEvidence{1, 2, 3}));
  std::vector<float> log_odds;
  log_odds_of_sights(table, log_odds);
  EXPECT_EQ(log_odds.size(), 1u);
}

}  // namespace
}  // namespace hueline::fusion
