#include "fusion/agreement.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hueline::fusion {
namespace {

constexpr std::array<std::uint8_t, 3> kWall{120, 110, 100}, kLeaf{40, 90, 30}, kSky{180, 200, 240};

Witness witness(std::array<std::uint8_t, 3> colour, float trust = 0.7f, float cost = 0) {
  return {colour, trust, trust / (1 + cost)};
}

TEST(Agreement, ManyImagesOfOneColourWinAgainstANearerOneOfAnother) {
  const std::vector<Witness> witnesses{witness(kLeaf), witness(kWall, 0.7f, 0.3f), witness(kSky, 0.7f, 0.3f),
                                       witness(kWall, 0.7f, 0.4f)};
  EXPECT_EQ(most_agreed(witnesses), 1u);
}

TEST(Agreement, OfImagesThatAllDifferTheMostTrustedIsTaken) {
  EXPECT_EQ(most_agreed(std::vector{witness(kLeaf, 0.7f, 0.2f), witness(kWall, 0.7f, 0.1f), witness(kSky, 0.2f)}), 1u);
  EXPECT_EQ(most_agreed(std::vector{witness(kSky, 0.2f, 2)}), 0u);
  EXPECT_EQ(most_agreed({}), 0u);
}

TEST(Agreement, ImagesInWhichThePointIsHiddenDoNotOutvoteFewThatMaySeeIt) {
  // Two may see it, four are believed to show what is in front, which is not one thing.
  EXPECT_EQ(most_agreed(std::vector{witness(kLeaf, 0.2f), witness(kSky, 0.2f), witness(kLeaf, 0.2f), witness(kWall),
                                    witness(kWall), witness(kSky, 0.2f)}),
            3u);
}

TEST(Agreement, NoiseAndShadeOfOneSurfaceAreNoDisagreement) {
  // The wall three times, a little lighter and darker, against a leaf twice; the nearest image of the wall is taken.
  const auto wall = [](int lighter) {
    return std::array<std::uint8_t, 3>{static_cast<std::uint8_t>(120 + lighter),
                                       static_cast<std::uint8_t>(110 + lighter),
                                       static_cast<std::uint8_t>(100 + lighter)};
  };
  EXPECT_EQ(most_agreed(std::vector{witness(kLeaf), witness(kLeaf), witness(wall(-6), 0.7f, 0.2f), witness(wall(0)),
                                    witness(wall(6), 0.7f, 0.2f)}),
            3u);
}

}  // namespace
}  // namespace hueline::fusion
