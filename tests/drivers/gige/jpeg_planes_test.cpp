// Camera images of 24 JPEGs. The pixels are compared with turbojpeg's decoding of each single plane, and with the
// mosaic that was encoded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <memory>

#include "tests/drivers/gige/jpeg_planes_packets.hpp"

namespace hueline::drivers {
namespace {

using test::jpeg_planes;
using test::lens_mosaic;
using test::placed;
using test::planes_config;
using test::planes_packet;

constexpr std::uint32_t kLensWidth = 52, kLensHeight = 44;  // planes of 26 x 22: no whole number of blocks

struct Decoded {
  std::vector<Image> images;
  std::vector<Fault> faults;
};
Decoded decode(ImageDecoder& decoder, const Packet& packet) {
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  Decoded decoded;
  for (auto& m : out) {
    if (auto* image = std::get_if<Image>(&m)) decoded.images.push_back(std::move(*image));
    if (auto* fault = std::get_if<Fault>(&m)) decoded.faults.push_back(std::move(*fault));
  }
  return decoded;
}
std::uint8_t pixel(const Image& image, std::uint32_t x, std::uint32_t y) {
  return std::to_integer<std::uint8_t>(image.pixels()[std::size_t{y} * image.stride + x]);
}
std::uint64_t counted(const ImageDecoder& decoder) {
  return decoder.counts().decoded_bytes + decoder.counts().ignored_bytes + decoder.counts().malformed_bytes;
}
/// Returns the largest difference between a lens's pixels and those of the mosaic.
int worst(const Image& image, const std::vector<std::uint8_t>& mosaic, std::uint32_t columns, std::uint32_t lens) {
  int largest = 0;
  for (std::uint32_t y = 0; y < kLensHeight; ++y)
    for (std::uint32_t x = 0; x < kLensWidth; ++x) {
      const std::uint32_t column = lens % columns * kLensWidth + x, row = lens / columns * kLensHeight + y;
      largest =
          std::max(largest, std::abs(pixel(image, column, row) - mosaic[std::size_t{row} * image.width + column]));
    }
  return largest;
}

class JpegPlanesTest : public testing::Test {
 protected:
  const std::vector<std::uint8_t> mosaic_ = lens_mosaic(3, kLensWidth, kLensHeight);
  const std::vector<std::byte> planes_ = jpeg_planes(mosaic_, 3 * kLensWidth, 3);
  ImageDecoder::Config config_ = planes_config(3, kLensWidth, kLensHeight);
};

TEST_F(JpegPlanesTest, HeadIsAsWritten) {
  ASSERT_GT(planes_.size(), kJpegPlanesHeaderSize);
  EXPECT_EQ(test::be32(planes_, 0x08), planes_.size());
  EXPECT_EQ(test::be32(planes_, 0x10), 0xCAFEBABEu);
  EXPECT_EQ(test::be32(planes_, 0x14), 2u);
  EXPECT_EQ(test::be32(planes_, 0x340), 0x400u);  // lens 0, plane 0 follows the head
  EXPECT_EQ(placed(planes_, 5, 3).offset + placed(planes_, 5, 3).size, planes_.size());  // lens 5, plane 3 is the last
  for (std::size_t lens = 0; lens < 6; ++lens)
    for (std::size_t slot = 0; slot < 4; ++slot)
      EXPECT_EQ(test::be32(planes_, placed(planes_, lens, slot).offset) >> 16, 0xFFD8u);
}

TEST_F(JpegPlanesTest, MosaicIsThatOfTheLenses) {
  for (const std::uint32_t columns : {1u, 2u, 3u, 6u}) {
    const auto mosaic = lens_mosaic(columns, kLensWidth, kLensHeight);
    ImageDecoder decoder(planes_config(columns, kLensWidth, kLensHeight));
    const Packet packet = planes_packet(jpeg_planes(mosaic, columns * kLensWidth, columns));
    const Decoded decoded = decode(decoder, packet);
    ASSERT_EQ(decoded.images.size(), 1u) << columns;
    EXPECT_TRUE(decoded.faults.empty());
    const Image& image = decoded.images[0];
    EXPECT_EQ(image.width, columns * kLensWidth);
    EXPECT_EQ(image.height, 6 / columns * kLensHeight);
    EXPECT_EQ(image.format, PixelFormat::BayerRG8);
    EXPECT_TRUE(image.is_complete);
    EXPECT_TRUE(image.lost.empty());
    ASSERT_EQ(image.pixels().size(), mosaic.size());
    // Neighbouring places differ by 30 and lenses by 15, so a plane in a wrong place shows.
    for (std::uint32_t lens = 0; lens < 6; ++lens)
      EXPECT_LE(worst(image, mosaic, columns, lens), 6) << columns << " " << lens;
    EXPECT_EQ(counted(decoder), packet.bytes.size());
    EXPECT_EQ(decoder.counts().decoded_bytes, packet.bytes.size());
  }
}

TEST_F(JpegPlanesTest, EveryPixelIsTurbojpegs) {
  ImageDecoder decoder(config_);
  const Decoded decoded = decode(decoder, planes_packet(planes_));
  ASSERT_EQ(decoded.images.size(), 1u);
  const std::unique_ptr<void, int (*)(void*)> turbo(tjInitDecompress(), tjDestroy);
  for (std::uint32_t lens = 0; lens < 6; ++lens)
    for (std::uint32_t slot = 0; slot < 4; ++slot) {
      const auto [offset, size] = placed(planes_, lens, slot);
      std::vector<unsigned char> plane(kLensWidth / 2 * kLensHeight / 2);
      ASSERT_EQ(tjDecompress2(turbo.get(), reinterpret_cast<const unsigned char*>(planes_.data() + offset), size,
                              plane.data(), kLensWidth / 2, 0, kLensHeight / 2, TJPF_GRAY, TJFLAG_ACCURATEDCT),
                0);
      for (std::uint32_t y = 0; y < kLensHeight / 2; ++y)
        for (std::uint32_t x = 0; x < kLensWidth / 2; ++x)
          ASSERT_EQ(pixel(decoded.images[0], lens % 3 * kLensWidth + 2 * x + slot % 2,
                          lens / 3 * kLensHeight + 2 * y + slot / 2),
                    plane[y * (kLensWidth / 2) + x])
              << lens << " " << slot;
    }
}

TEST_F(JpegPlanesTest, PlanesGoWhereTheSettingSays) {
  config_.planes.plane_places = {3, 1, 2, 0};  // a camera that sends the lower right place first
  ImageDecoder decoder(config_);
  const Decoded decoded = decode(decoder, planes_packet(planes_));
  ASSERT_EQ(decoded.images.size(), 1u);
  EXPECT_NEAR(pixel(decoded.images[0], 1, 1), mosaic_[0], 6);
  EXPECT_NEAR(pixel(decoded.images[0], 0, 0), mosaic_[3 * kLensWidth + 1], 6);
  EXPECT_NEAR(pixel(decoded.images[0], 1, 0), mosaic_[1], 6);
}

TEST_F(JpegPlanesTest, ABrokenPlaneCostsItsLensAlone) {
  auto broken = planes_;
  const auto [offset, size] = placed(planes_, 2, 1);
  // With markers in the middle of the samples, the decoder runs out of bits.
  for (std::size_t i = size / 2; i < size; ++i) broken[offset + i] = std::byte{0xFF};
  ImageDecoder decoder(config_);
  const Packet packet = planes_packet(broken);
  const Decoded decoded = decode(decoder, packet);
  ASSERT_EQ(decoded.faults.size(), 1u);
  EXPECT_EQ(decoded.faults[0].kind, FaultKind::Malformed);
  EXPECT_EQ(decoded.faults[0].count, 1u);
  EXPECT_THAT(decoded.faults[0].detail, testing::StartsWith("image 1: 1 of 6 lenses lost; lens 2: plane 1: "));
  ASSERT_EQ(decoded.images.size(), 1u);
  const Image& image = decoded.images[0];
  EXPECT_TRUE(image.is_complete);
  ASSERT_EQ(image.lost.size(), 1u);
  EXPECT_EQ(image.lost[0].x, 2 * kLensWidth);
  EXPECT_EQ(image.lost[0].y, 0u);
  EXPECT_EQ(image.lost[0].width, kLensWidth);
  EXPECT_EQ(image.lost[0].height, kLensHeight);
  for (const std::uint32_t lens : {0u, 1u, 3u, 4u, 5u}) EXPECT_LE(worst(image, mosaic_, 3, lens), 6) << lens;
  for (std::uint32_t y = 0; y < kLensHeight; ++y)
    for (std::uint32_t x = 0; x < kLensWidth; ++x) ASSERT_EQ(pixel(image, 2 * kLensWidth + x, y), 0);
  EXPECT_EQ(decoder.counts().malformed_messages, 1u);
  EXPECT_EQ(decoder.counts().messages.at("LensLost"), 1u);
  EXPECT_GT(decoder.counts().malformed_bytes, size);
  EXPECT_EQ(counted(decoder), packet.bytes.size());
}

TEST_F(JpegPlanesTest, AnExposureCutShortKeepsWhatCame) {
  auto cut = planes_;
  cut.resize(placed(planes_, 4, 2).offset + 10);
  ImageDecoder decoder(config_);
  const Decoded decoded = decode(decoder, planes_packet(cut));
  ASSERT_EQ(decoded.images.size(), 1u);
  EXPECT_EQ(decoded.images[0].lost.size(), 2u);
  ASSERT_EQ(decoded.faults.size(), 1u);
  EXPECT_EQ(decoded.faults[0].count, 2u);
  EXPECT_THAT(decoded.faults[0].detail, testing::HasSubstr("lens 4: plane 2 ends at byte "));
  for (std::uint32_t lens = 0; lens < 4; ++lens) EXPECT_LE(worst(decoded.images[0], mosaic_, 3, lens), 6) << lens;
}

TEST_F(JpegPlanesTest, NoLensLeftIsNoImage) {
  auto cut = planes_;
  cut.resize(placed(planes_, 0, 0).offset + 10);
  ImageDecoder decoder(config_);
  const Packet packet = planes_packet(cut);
  const Decoded decoded = decode(decoder, packet);
  EXPECT_TRUE(decoded.images.empty());
  ASSERT_EQ(decoded.faults.size(), 1u);
  EXPECT_EQ(decoded.faults[0].count, 6u);
  EXPECT_EQ(decoder.counts().malformed_bytes, packet.bytes.size());
}

TEST_F(JpegPlanesTest, OtherJpegsAreRefusedByName) {
  const auto with_plane = [&](int subsampling, int format, std::uint32_t width, int flags) {
    std::vector<unsigned char> pixels(std::size_t{width} * (kLensHeight / 2) * 3, 90);
    const std::unique_ptr<void, int (*)(void*)> turbo(tjInitCompress(), tjDestroy);
    unsigned char* jpeg = nullptr;
    unsigned long size = 0;
    EXPECT_EQ(tjCompress2(turbo.get(), pixels.data(), static_cast<int>(width), 0, kLensHeight / 2, format, &jpeg, &size,
                          subsampling, 90, flags),
              0);
    auto out = planes_;
    const std::size_t at = out.size(), entry = 0x340 + 8 * (4 * 3 + 0);
    out.insert(out.end(), reinterpret_cast<std::byte*>(jpeg), reinterpret_cast<std::byte*>(jpeg) + size);
    tjFree(jpeg);
    for (std::size_t i = 0; i < 4; ++i) {
      out[entry + i] = static_cast<std::byte>(at >> (24 - 8 * i));
      out[entry + 4 + i] = static_cast<std::byte>(size >> (24 - 8 * i));
    }
    ImageDecoder decoder(config_);
    const Decoded decoded = decode(decoder, planes_packet(out));
    return decoded.faults.empty() ? std::string("none") : decoded.faults[0].detail;
  };
  EXPECT_EQ(with_plane(TJSAMP_GRAY, TJPF_GRAY, kLensWidth / 2, 0), "none");
  EXPECT_THAT(with_plane(TJSAMP_GRAY, TJPF_GRAY, kLensWidth / 2 + 2, 0),
              testing::EndsWith("it has not half the size of the lens image"));
  EXPECT_THAT(with_plane(TJSAMP_444, TJPF_RGB, kLensWidth / 2, 0), testing::EndsWith("it is not grey"));
  EXPECT_THAT(with_plane(TJSAMP_GRAY, TJPF_GRAY, kLensWidth / 2, TJFLAG_PROGRESSIVE),
              testing::EndsWith("it is not a baseline JPEG"));
}

TEST_F(JpegPlanesTest, WhatIsNoJpegPlanesIsMalformedAsAWhole) {
  for (const std::size_t at : {0x10u, 0x14u}) {
    auto other = planes_;
    other[at] ^= std::byte{1};
    ImageDecoder decoder(config_);
    const Packet packet = planes_packet(other);
    const Decoded decoded = decode(decoder, packet);
    EXPECT_TRUE(decoded.images.empty());
    ASSERT_EQ(decoded.faults.size(), 1u);
    EXPECT_EQ(decoded.faults[0].kind, FaultKind::Malformed);
    EXPECT_EQ(decoder.counts().malformed_bytes, packet.bytes.size());
  }
}

TEST_F(JpegPlanesTest, OfAnIncompletePacketNothingIsDecoded) {
  ImageDecoder decoder(config_);
  const Packet packet = planes_packet(planes_, 1, ImageStatus::TimedOut);
  const Decoded decoded = decode(decoder, packet);
  ASSERT_EQ(decoded.images.size(), 1u);
  EXPECT_FALSE(decoded.images[0].is_complete);
  EXPECT_TRUE(decoded.images[0].buffer.empty());
  EXPECT_EQ(counted(decoder), packet.bytes.size());
}

TEST_F(JpegPlanesTest, ALensThatNobodyWantsMayBeBroken) {
  auto cut = planes_;
  cut.resize(placed(planes_, 5, 0).offset + 10);
  config_.planes.is_used[5] = false;
  ImageDecoder decoder(config_);
  const Decoded decoded = decode(decoder, planes_packet(cut));
  ASSERT_EQ(decoded.images.size(), 1u);
  EXPECT_TRUE(decoded.images[0].lost.empty());
  EXPECT_TRUE(decoded.faults.empty());
  EXPECT_EQ(pixel(decoded.images[0], 2 * kLensWidth + 5, kLensHeight + 5), 0);
}

TEST_F(JpegPlanesTest, ACameraOfWhichNobodyWantsALensStillGivesImages) {
  config_.planes.is_used.fill(false);
  ImageDecoder decoder(config_);
  const Packet packet = planes_packet(planes_);
  const Decoded decoded = decode(decoder, packet);
  ASSERT_EQ(decoded.images.size(), 1u);
  EXPECT_TRUE(decoded.images[0].lost.empty());
  EXPECT_TRUE(decoded.faults.empty());
  EXPECT_EQ(pixel(decoded.images[0], 5, 5), 0);
  EXPECT_EQ(decoder.counts().decoded_bytes, packet.bytes.size());
  EXPECT_EQ(decoder.counts().malformed_bytes, 0u);
}

TEST_F(JpegPlanesTest, SettingsThatCannotBeAreRefused) {
  EXPECT_EQ(config_.validate(), "");
  auto c = config_;
  c.planes.lens_columns = 4;
  EXPECT_THAT(c.validate(), testing::StartsWith("lens_columns is 4"));
  c = config_;
  c.planes.plane_places = {0, 1, 1, 2};
  EXPECT_THAT(c.validate(), testing::StartsWith("plane_places"));
  c = config_;
  c.height += 2;
  EXPECT_THAT(c.validate(), testing::StartsWith("height"));
  c = config_;
  c.pixel_format = PixelFormat::Rgb8;
  EXPECT_THAT(c.validate(), testing::StartsWith("pixel_format"));
}

}  // namespace
}  // namespace hueline::drivers
