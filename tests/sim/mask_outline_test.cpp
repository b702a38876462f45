#include "sim/mask_outline.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hueline::sim {
namespace {

bool holds(const std::vector<TruePixel>& p, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, j = p.size() - 1; i < p.size(); j = i++)
    if ((p[i].v > y) != (p[j].v > y) && x < (p[j].u - p[i].u) * (y - p[i].v) / (p[j].v - p[i].v) + p[i].u)
      inside = !inside;
  return inside;
}

TEST(MaskOutline, HoldsEachMarkedPixelInFewCorners) {
  constexpr int kWidth = 120, kHeight = 100;
  // A wavy roof on the lower border, and a separate disk.
  std::vector<std::uint8_t> mask(kWidth * kHeight);
  int marked = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool roof = y > 70 + 8 * std::sin(x * 0.07), disk = std::hypot(x - 40, y - 25) < 14;
      mask[static_cast<std::size_t>(y * kWidth + x)] = roof || disk;
      marked += roof || disk;
    }
  const auto outlines = mask_outline(mask, kWidth, kHeight, 3, 1.5);
  ASSERT_EQ(outlines.size(), 2u);
  int held = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool in = holds(outlines[0], x, y) || holds(outlines[1], x, y);
      held += in;
      EXPECT_TRUE(in || !mask[static_cast<std::size_t>(y * kWidth + x)]) << x << " " << y;
    }
  EXPECT_LT(held, marked * 1.25);
  EXPECT_LT(outlines[0].size() + outlines[1].size(), 40u);
}

TEST(MaskOutline, KeepsAHoleAsItsOwnLoopAndNothingOfAnEmptyMask) {
  std::vector<std::uint8_t> ring(7 * 7);
  for (int y = 1; y < 6; ++y)
    for (int x = 1; x < 6; ++x) ring[static_cast<std::size_t>(7 * y + x)] = !(x == 3 && y == 3);
  const auto outlines = mask_outline(ring, 7, 7, 0, 0.0);
  ASSERT_EQ(outlines.size(), 2u);
  const auto covered = [&](double x, double y) { return holds(outlines[0], x, y) != holds(outlines[1], x, y); };
  EXPECT_TRUE(covered(1, 1));
  EXPECT_FALSE(covered(3, 3));
  EXPECT_FALSE(covered(0, 3));
  EXPECT_TRUE(mask_outline(std::vector<std::uint8_t>(49), 7, 7, 2, 1).empty());
}

}  // namespace
}  // namespace hueline::sim
