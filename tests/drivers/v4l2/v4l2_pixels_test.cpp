#include "drivers/v4l2/v4l2_pixels.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tests/drivers/v4l2/v4l2_packets.hpp"

namespace hueline::drivers {
namespace {

using test::bytes_of;
using testing::ElementsAre;

std::vector<int> converted(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height, std::uint32_t stride,
                           const std::vector<std::byte>& in, const YcbcrCoding& coding = {}) {
  const V4l2Format* format = find_v4l2_format(fourcc);
  EXPECT_NE(format, nullptr);
  EXPECT_GE(in.size(), format->image_bytes(width, height, stride));
  std::vector<std::byte> out(std::size_t{width} * height * converted_pixel_bytes(format->image));
  convert_v4l2_pixels(*format, coding, width, height, stride, in, out.data());
  std::vector<int> numbers;
  for (const std::byte b : out) numbers.push_back(std::to_integer<int>(b));
  return numbers;
}

TEST(V4l2Pixels, EachFormatIsListedOnceAndFoundByItsCode) {
  std::set<std::uint32_t> codes;
  std::set<std::string> words;
  for (const V4l2Format& format : v4l2_formats()) {
    EXPECT_TRUE(codes.insert(format.fourcc).second);
    EXPECT_TRUE(words.insert(fourcc_text(format.fourcc)).second);
    EXPECT_EQ(find_v4l2_format(format.fourcc), &format);
  }
  EXPECT_EQ(find_v4l2_format(V4L2_PIX_FMT_H264), nullptr);
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Y10), "Y10");
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_SRGGB10P), "pRAA");
  EXPECT_EQ(fourcc_text(0x01414243), "CBA?");
}

TEST(V4l2Pixels, BayerFormatsKeepTheirOrder) {
  // The kernel's names say the first two pixels of the first row, then of the second.
  EXPECT_EQ(find_v4l2_format(V4L2_PIX_FMT_SGRBG10P)->image, PixelFormat::BayerGR8);
  EXPECT_EQ(find_v4l2_format(V4L2_PIX_FMT_SBGGR16)->image, PixelFormat::BayerBG8);
  EXPECT_EQ(find_v4l2_format(V4L2_PIX_FMT_SGBRG12)->image, PixelFormat::BayerGB8);
  EXPECT_EQ(find_v4l2_format(V4L2_PIX_FMT_SRGGB14P)->image, PixelFormat::BayerRG8);
}

TEST(V4l2Pixels, WordsGiveTheirHighBits) {
  // 1023, 4, 3, and 512 of 10 bits; each row has two bytes of filling, which are not read.
  const auto ten = bytes_of({0xFF, 0x03, 0x04, 0x00, 0xEE, 0xEE, 0x03, 0x00, 0x00, 0x02});
  EXPECT_THAT(converted(V4L2_PIX_FMT_SRGGB10, 2, 2, 6, ten), ElementsAre(255, 1, 0, 128));
  EXPECT_THAT(converted(V4L2_PIX_FMT_Y12, 2, 1, 4, bytes_of({0xFF, 0x0F, 0x10, 0x00})), ElementsAre(255, 1));
  EXPECT_THAT(converted(V4L2_PIX_FMT_SBGGR14, 2, 1, 4, bytes_of({0xFF, 0x3F, 0x40, 0x00})), ElementsAre(255, 1));
  EXPECT_THAT(converted(V4L2_PIX_FMT_Y16, 2, 1, 4, bytes_of({0xFF, 0xFF, 0xFF, 0x01})), ElementsAre(255, 1));
  // Bits that the format does not have do not wrap around.
  EXPECT_THAT(converted(V4L2_PIX_FMT_Y10, 1, 1, 2, bytes_of({0x00, 0x04})), ElementsAre(255));
}

TEST(V4l2Pixels, PackedRowsGiveTheirHighBytes) {
  const auto ten = bytes_of({1, 2, 3, 4, 0xFF, 5, 6, 7, 8, 0xFF});
  EXPECT_THAT(converted(V4L2_PIX_FMT_SRGGB10P, 8, 1, 10, ten), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(converted(V4L2_PIX_FMT_Y10P, 5, 1, 10, ten), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(converted(V4L2_PIX_FMT_SGRBG12P, 4, 1, 6, bytes_of({1, 2, 0xFF, 3, 4, 0xFF})), ElementsAre(1, 2, 3, 4));
  const auto fourteen = bytes_of({1, 2, 3, 4, 0xFF, 0xFF, 0xFF, 5, 6, 7, 8, 0xFF, 0xFF, 0xFF});
  EXPECT_THAT(converted(V4L2_PIX_FMT_SGBRG14P, 8, 1, 14, fourteen), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(V4l2Pixels, ColourDifferencesFindTheirPlaces) {
  // Luminances 81 and 145; blue difference 90, red difference 240: a full red, and a lighter one.
  const auto red = ElementsAre(254, 0, 0, 255, 74, 74);
  EXPECT_THAT(converted(V4L2_PIX_FMT_YUYV, 2, 1, 4, bytes_of({81, 90, 145, 240})), red);
  EXPECT_THAT(converted(V4L2_PIX_FMT_YVYU, 2, 1, 4, bytes_of({81, 240, 145, 90})), red);
  EXPECT_THAT(converted(V4L2_PIX_FMT_UYVY, 2, 1, 4, bytes_of({90, 81, 240, 145})), red);
  EXPECT_THAT(converted(V4L2_PIX_FMT_VYUY, 2, 1, 4, bytes_of({240, 81, 90, 145})), red);
  // Two rows share the differences of the plane behind them.
  const auto both = ElementsAre(254, 0, 0, 255, 74, 74, 255, 74, 74, 254, 0, 0);
  EXPECT_THAT(converted(V4L2_PIX_FMT_NV12, 2, 2, 3, bytes_of({81, 145, 0, 145, 81, 0, 90, 240})), both);
  EXPECT_THAT(converted(V4L2_PIX_FMT_NV21, 2, 2, 3, bytes_of({81, 145, 0, 145, 81, 0, 240, 90})), both);
  EXPECT_THAT(converted(V4L2_PIX_FMT_BGR24, 2, 1, 6, bytes_of({1, 2, 3, 4, 5, 6})), ElementsAre(3, 2, 1, 6, 5, 4));
}

TEST(V4l2Pixels, ColoursAreThoseOfTheStandards) {
  const std::array codings{YcbcrCoding{}, YcbcrCoding{0.299, 0.114, true}, YcbcrCoding{0.2126, 0.0722, false},
                           YcbcrCoding{0.2627, 0.0593, true}};
  std::mt19937 random(7);
  std::uniform_int_distribution<int> any(0, 255);
  for (const YcbcrCoding& coding : codings)
    for (int i = 0; i < 2000; ++i) {
      const int y = any(random), b = any(random), r = any(random);
      const auto got = converted(V4L2_PIX_FMT_YUYV, 1, 1, 4, bytes_of({y, b, y, r}), coding);
      // ITU-R BT.601, 709, 2020, solved for the primaries.
      const double luminance = coding.is_full_range ? y / 255.0 : (y - 16) / 219.0;
      const double pb = (b - 128) / (coding.is_full_range ? 255.0 : 224.0);
      const double pr = (r - 128) / (coding.is_full_range ? 255.0 : 224.0);
      const double red = luminance + pr * 2 * (1 - coding.red_weight);
      const double blue = luminance + pb * 2 * (1 - coding.blue_weight);
      const double green = (luminance - coding.red_weight * red - coding.blue_weight * blue) /
                           (1 - coding.red_weight - coding.blue_weight);
      const std::array wanted{red, green, blue};
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(got[c], std::clamp(wanted[c] * 255, 0.0, 255.0), 0.51) << y << " " << b << " " << r;
    }
}

TEST(V4l2Pixels, TheCodingIsWhatTheDriverSaysOrTheKernelsDefault) {
  const auto plain = ycbcr_coding(V4L2_COLORSPACE_SRGB, V4L2_YCBCR_ENC_DEFAULT, V4L2_QUANTIZATION_DEFAULT);
  EXPECT_EQ(plain.red_weight, 0.299);
  EXPECT_FALSE(plain.is_full_range);
  EXPECT_TRUE(ycbcr_coding(V4L2_COLORSPACE_JPEG, V4L2_YCBCR_ENC_DEFAULT, V4L2_QUANTIZATION_DEFAULT).is_full_range);
  EXPECT_EQ(ycbcr_coding(V4L2_COLORSPACE_REC709, V4L2_YCBCR_ENC_DEFAULT, 0).red_weight, 0.2126);
  EXPECT_EQ(ycbcr_coding(V4L2_COLORSPACE_SRGB, V4L2_YCBCR_ENC_709, 0).red_weight, 0.2126);
  EXPECT_EQ(ycbcr_coding(V4L2_COLORSPACE_BT2020, V4L2_YCBCR_ENC_DEFAULT, 0).blue_weight, 0.0593);
  EXPECT_TRUE(ycbcr_coding(V4L2_COLORSPACE_SRGB, 0, V4L2_QUANTIZATION_FULL_RANGE).is_full_range);
}

TEST(V4l2Pixels, OddSizesStayInsideTheImage) {
  // With AddressSanitizer a byte too far would end the test. The input has exactly the bytes that are asked for.
  for (const V4l2Format& format : v4l2_formats()) {
    if (format.packing == V4l2Packing::Bytes || format.packing == V4l2Packing::Jpeg) continue;
    for (std::uint32_t width = 1; width < 10; ++width)
      for (std::uint32_t height = 1; height < 4; ++height) {
        const auto stride = static_cast<std::uint32_t>(format.row_bytes(width)) + 3;
        const std::vector<std::byte> in(format.image_bytes(width, height, stride));
        EXPECT_EQ(converted(format.fourcc, width, height, stride, in).size(),
                  std::size_t{width} * height * converted_pixel_bytes(format.image));
      }
  }
}

}  // namespace
}  // namespace hueline::drivers
