#include "fusion/pixel_sampler.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "fusion/pixel_mask.hpp"
#include "tests/fusion/drive.hpp"
#include "tests/support/each_instruction_set.hpp"

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
  for (double u = kSampleReach; u <= 39.0 - kSampleReach; u += 0.13) {
    for (double v = kSampleReach; v <= 35.0 - kSampleReach; v += 0.17) {
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
  for (int y = kSampleReach; y < 16 - kSampleReach; ++y) {
    for (int x = kSampleReach; x < 16 - kSampleReach; ++x) {
      const Rgb c = sample(view, x, y, 0, 0);
      const int step = GetParam() == PixelFormat::Rgb8 ? 3 : 1;
      const float stored = view.data[y * static_cast<int>(view.stride) + x * step];
      EXPECT_TRUE(c.red == stored || c.green == stored || c.blue == stored) << x << ' ' << y;
    }
  }
}

TEST_P(AllFormats, ManyPlacesAreSampledAsSingleOnesAre) {
  std::mt19937 random(5);
  const Image image = make_image(
      41, 37, GetParam(), [&](std::uint32_t, std::uint32_t, int) { return static_cast<double>(random() % 256); });
  const RawView view = view_of(image);
  with_each_instruction_set([&] {
    for (std::size_t count = 0; count < 70; ++count) {
      ImagePlaces places;
      for (std::size_t i = 0; i < count; ++i) {
        places.x.push_back(kSampleReach + static_cast<int>(random() % (41 - 2 * kSampleReach)));
        places.y.push_back(kSampleReach + static_cast<int>(random() % (37 - 2 * kSampleReach)));
        places.fx.push_back(static_cast<float>(random() % 1000) / 1000);
        places.fy.push_back(static_cast<float>(random() % 1000) / 1000);
      }
      std::vector<Rgb> out(count);
      sample_each(view, places, out.data());
      for (std::size_t i = 0; i < count; ++i) {
        const Rgb one = sample(view, places.x[i], places.y[i], places.fx[i], places.fy[i]);
        ASSERT_TRUE(out[i].red == one.red && out[i].green == one.green && out[i].blue == one.blue)
            << i << " of " << count;
      }
    }
  });
}

TEST(PixelSampler, ReadsNothingFartherThanItsReach) {
  // An image of exactly so many pixels: all reads at the centre pixel must stay inside (AddressSanitizer checks it).
  constexpr std::uint32_t kSize = 2 * kSampleReach + 1;
  for (const PixelFormat format : {PixelFormat::BayerRG8, PixelFormat::BayerBG8, PixelFormat::BayerGR8,
                                   PixelFormat::BayerGB8, PixelFormat::Mono8, PixelFormat::Rgb8}) {
    const Image image = make_image(kSize, kSize, format, [](std::uint32_t, std::uint32_t, int) { return 77.0; });
    const Rgb c = sample_at(image, kSampleReach, kSampleReach);
    EXPECT_FLOAT_EQ(c.red + c.green + c.blue, 231.0f);
    Rgb again;
    sample_each(view_of(image), {{kSampleReach}, {kSampleReach}, {0.0f}, {0.0f}}, &again);
    EXPECT_FLOAT_EQ(again.red + again.green + again.blue, 231.0f);
    constexpr std::uint32_t kSmall = 2 * kPixelReach + 1;
    const Image small = make_image(kSmall, kSmall, format, [](std::uint32_t, std::uint32_t, int) { return 77.0; });
    const Rgb alone = sample_pixel(view_of(small), kPixelReach, kPixelReach);
    EXPECT_FLOAT_EQ(alone.red + alone.green + alone.blue, 231.0f);
  }
}

TEST_P(AllFormats, APixelAloneHasItsColourInARamp) {
  const bool is_mono = GetParam() == PixelFormat::Mono8;
  const Image image = make_image(20, 18, GetParam(), ramp);
  for (int y = kPixelReach; y < 18 - kPixelReach; ++y)
    for (int x = kPixelReach; x < 20 - kPixelReach; ++x) {
      const Rgb c = sample_pixel(view_of(image), x, y);
      EXPECT_FLOAT_EQ(c.red, static_cast<float>(ramp(x, y, is_mono ? 1 : 0))) << x << ' ' << y;
      EXPECT_FLOAT_EQ(c.green, static_cast<float>(ramp(x, y, 1))) << x << ' ' << y;
      EXPECT_FLOAT_EQ(c.blue, static_cast<float>(ramp(x, y, is_mono ? 1 : 2))) << x << ' ' << y;
    }
}

TEST_P(AllFormats, APixelAloneHasNothingOfWhatLiesBeyondItsReach) {
  for (int y = 4; y < 6; ++y)
    for (int x = 4; x < 6; ++x) {
      const auto is_near = [&](std::uint32_t i, std::uint32_t j) {
        return std::abs(static_cast<int>(i) - x) <= kPixelReach && std::abs(static_cast<int>(j) - y) <= kPixelReach;
      };
      const Image image = make_image(10, 10, GetParam(), [&](std::uint32_t i, std::uint32_t j, int c) {
        return is_near(i, j) ? 60.0 + 50 * (c == 1) : 255.0;
      });
      const Rgb c = sample_pixel(view_of(image), x, y), flat{60, 110, 60};
      const float others = GetParam() == PixelFormat::Mono8 ? flat.green : flat.red;
      EXPECT_TRUE(c.red == others && c.green == flat.green && c.blue == others) << x << ' ' << y;
    }
}

TEST(PixelSampler, AGreyEdgeStaysGrey) {
  // White frames before dark panes, at any angle: colours that are interpolated one by one would get fringes.
  for (const double slope : {0.0, 0.4, 1.0, 3.0}) {
    const auto edge = [slope](double x, double y, int) { return x + slope * y < 20 + 18 * slope ? 40.0 : 200.0; };
    const Image image = make_image(40, 36, PixelFormat::BayerRG8, edge);
    double sum = 0, most = 0;
    int count = 0;
    for (double u = 12; u <= 27; u += 0.31)
      for (double v = 12; v <= 23; v += 0.29) {
        const Rgb c = sample_at(image, u, v);
        const double tint = std::max({c.red, c.green, c.blue}) - std::min({c.red, c.green, c.blue});
        const double across = std::abs(u + slope * v - 20 - 18 * slope) / std::hypot(1, slope);
        if (across > 2) {
          EXPECT_LT(tint, across > 3.5 ? 0.01 : 60) << u << ' ' << v << ", slope " << slope;
          continue;
        }
        sum += tint;
        most = std::max(most, tint);
        ++count;
      }
    EXPECT_LT(sum / count, 40) << slope;
    EXPECT_LT(most, 130) << slope;
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
