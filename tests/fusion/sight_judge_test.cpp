#include "fusion/sight_judge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fusion/sight_trees.hpp"

namespace hueline::fusion {
namespace {

using testing::Ge;
using testing::Gt;
using testing::Lt;

/// Something whose nearness is `ratio` of the place's lies in its cell, as a closed surface and as a point of it; at
/// the moment itself nothing is known.
float behind(float ratio, float parallax, float agreement) {
  return log_odds_of_sight({parallax, ratio, ratio, 0, agreement});
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
  // A gap that was closed: no point in the cell itself.
  const auto in_a_gap = [](float agreement) { return log_odds_of_sight({0.1f, 2, 0, 0, agreement}); };
  EXPECT_THAT(in_a_gap(0), Lt(kSeen));
  EXPECT_THAT(in_a_gap(4), Gt(kSeen));
}

TEST(SightJudge, AsksInTheOrderOfTheTrees) {
  SightEvidence evidence{};
  float least = 0, most = 0;
  for (const SightTree& tree : kSightTrees) {
    least += tree.values.front();
    most += tree.values.back();
    for (const SightTree::Question& question : tree.questions) EXPECT_THAT(question.least, Gt(0.0f));
  }
  EXPECT_FLOAT_EQ(log_odds_of_sight(evidence), least);
  evidence.fill(1e9f);
  EXPECT_FLOAT_EQ(log_odds_of_sight(evidence), most);
}

}  // namespace
}  // namespace hueline::fusion
