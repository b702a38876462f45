#include "fusion/pixel_sampler.hpp"

#include <gtest/gtest.h>

#include "fusion/pixel_mask.hpp"
#include "tests/fusion/drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;

Rgb sample_at(const Image& image, double u, double v) {
  const int x = static_cast<int>(std::floor(u)), y = static_cast<int>(std::floor(v));
  return sample(view_of(image), x, y, static_cast<float>(u - x), static_cast<float>(v - y));
}

/// The slopes are chosen so that each pixel's value is a whole number, and the ramp in memory is exact.
double ramp(double x, double y, int channel) {
  return channel == 0 ? 10 + 2 * x + y : channel == 1 ? 200 - x - 2 * y : 40 + 3 * x - y;
}

class AllFormats : public testing::TestWithParam<PixelFormat> {};
INSTANTIATE_TEST_SUITE_P(Format, AllFormats,
                         testing::Values(PixelFormat::Mono8, PixelFormat::BayerRG8, PixelFormat::BayerBG8,
                                         PixelFormat::BayerGR8, PixelFormat::BayerGB8, PixelFormat::Rgb8),
                         [](const auto& test) { return name(test.param); });

TEST_P(AllFormats, ColourRampsAreExactAtEverySubPixel) {
  const bool is_mono = GetParam() == PixelFormat::Mono8;
  const Image image = make_image(40, 36, GetParam(), ramp);
  for (double u = 2.0; u <= 37.0; u += 0.13) {
    for (double v = 2.0; v <= 33.0; v += 0.17) {
      const Rgb c = sample_at(image, u, v);
      EXPECT_NEAR(c.red, ramp(u, v, is_mono ? 1 : 0), 2e-3) << u << ' ' << v;
      EXPECT_NEAR(c.green, ramp(u, v, 1), 2e-3) << u << ' ' << v;
      EXPECT_NEAR(c.blue, ramp(u, v, is_mono ? 1 : 2), 2e-3) << u << ' ' << v;
    }
  }
}

TEST_P(AllFormats, WholePixelsOfTheirOwnColourAreReadUnchanged) {
  const Image image = make_image(
      16, 16, GetParam(), [](std::uint32_t x, std::uint32_t y, int c) { return (x * 37 + y * 101 + c * 53) % 256; });
  const RawView view = view_of(image);
  for (int y = 2; y < 14; ++y) {
    for (int x = 2; x < 14; ++x) {
      const Rgb c = sample(view, x, y, 0, 0);
      const int step = GetParam() == PixelFormat::Rgb8 ? 3 : 1;
      const float stored = view.data[y * static_cast<int>(view.stride) + x * step];
      EXPECT_TRUE(c.red == stored || c.green == stored || c.blue == stored) << x << ' ' << y;
    }
  }
}

TEST(PixelSampler, ReadsNothingFartherThanItsReach) {
  // An image of exactly 5 x 5: all reads at the centre pixel must stay inside (AddressSanitizer checks it).
  for (const PixelFormat format : {PixelFormat::BayerRG8, PixelFormat::BayerBG8, PixelFormat::BayerGR8,
                                   PixelFormat::BayerGB8, PixelFormat::Mono8, PixelFormat::Rgb8}) {
    const Image image = make_image(5, 5, format, [](std::uint32_t, std::uint32_t, int) { return 77.0; });
    const Rgb c = sample_at(image, 2.0, 2.0);
    EXPECT_FLOAT_EQ(c.red + c.green + c.blue, 231.0f);
  }
}

TEST(PixelSampler, AnImageThatLiesAboutItsSizeHasNoView) {
  Image image = make_image(16, 16, PixelFormat::BayerRG8, ramp);
  EXPECT_NE(view_of(image).data, nullptr);
  image.height = 17;
  EXPECT_EQ(view_of(image).data, nullptr);
  image.height = 16;
  image.pixel_offset = 1;
  EXPECT_EQ(view_of(image).data, nullptr);
  image.pixel_offset = 100000;
  EXPECT_EQ(view_of(image).data, nullptr);
  image.pixel_offset = 0;
  image.stride = 8;
  EXPECT_EQ(view_of(image).data, nullptr);
}

TEST(PixelMask, PolygonsAndTheirMargin) {
  const std::vector<Polygon> square{{{10, 10}, {20, 10}, {20, 15}, {10, 15}}};
  const PixelMask mask(square, 130, 40, 2);
  EXPECT_TRUE(mask.covers(15, 12));
  EXPECT_TRUE(mask.covers(8, 12));  // two pixels beside it
  EXPECT_FALSE(mask.covers(7, 12));
  EXPECT_TRUE(mask.covers(22, 12));
  EXPECT_FALSE(mask.covers(23, 12));
  EXPECT_FALSE(mask.covers(15, 20));
  EXPECT_FALSE(mask.covers(129, 39));
  EXPECT_TRUE(PixelMask({}, 100, 100, 2).is_empty());
  // A frame: even-odd between two outlines, and a polygon that leaves the image.
  const PixelMask beyond({{{-50, -50}, {500, -50}, {500, 5}, {-50, 5}}}, 130, 40, 0);
  EXPECT_TRUE(beyond.covers(0, 0));
  EXPECT_TRUE(beyond.covers(129, 4));
  EXPECT_FALSE(beyond.covers(129, 6));
}

}  // namespace
}  // namespace hueline::fusion
