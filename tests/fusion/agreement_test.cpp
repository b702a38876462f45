#include "fusion/agreement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace hueline::fusion {
namespace {

using testing::FloatEq;
using testing::Gt;

constexpr std::array<std::uint8_t, 3> kWall{120, 110, 100}, kLeaf{40, 90, 30}, kSky{180, 200, 240};

std::vector<float> agreement(const std::vector<Witness>& witnesses) {
  std::vector<float> out{7, 7, 7};  // is replaced
  weigh_agreement(witnesses, out);
  return out;
}

TEST(Agreement, ImagesOfOneColourAgreeByTheTrustOfTheOthers) {
  const auto of = agreement({{kWall, 0.7f}, {kWall, 0.25f}, {kWall, 1.0f}});
  ASSERT_EQ(of.size(), 3u);
  EXPECT_THAT(of[0], FloatEq(1.25f));
  EXPECT_THAT(of[1], FloatEq(1.7f));
  EXPECT_THAT(of[2], FloatEq(0.95f));
}

TEST(Agreement, AnImageAloneHasNone) {
  EXPECT_THAT(agreement({{kSky, 1.0f}}), testing::ElementsAre(0.0f));
  EXPECT_TRUE(agreement({}).empty());
}

TEST(Agreement, ManyImagesOfOneColourAgreeMoreThanThoseOfManyColours) {
  const auto of = agreement({{kLeaf, 0.7f}, {kWall, 0.7f}, {kSky, 0.7f}, {kWall, 0.7f}});
  EXPECT_THAT(of[1], Gt(10 * of[0]));
  EXPECT_THAT(of[3], Gt(10 * of[2]));
}

TEST(Agreement, NoiseAndShadeOfOneSurfaceAreNoDisagreement) {
  const std::array<std::uint8_t, 3> lighter{126, 116, 106}, darker{114, 104, 94};
  const auto of = agreement({{lighter, 1}, {kWall, 1}, {darker, 1}, {kLeaf, 1}, {kLeaf, 1}});
  EXPECT_THAT(of[1], Gt(1.2f));
  EXPECT_THAT(of[1], Gt(of[3]));
}

}  // namespace
}  // namespace hueline::fusion
