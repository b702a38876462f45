#include "drivers/v4l2/v4l2_decoder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>

#include "tests/drivers/v4l2/v4l2_packets.hpp"

namespace hueline::drivers {
namespace {

using test::bytes_of;
using test::v4l2_packet;
using testing::ElementsAre;

V4l2Header header_of(std::uint32_t sequence, std::uint32_t fourcc = V4L2_PIX_FMT_SRGGB8) {
  return {.width = 4,
          .height = 2,
          .stride = find_v4l2_format(fourcc)->packing == V4l2Packing::Jpeg ? 0u : 8u,
          .fourcc = fourcc,
          .sequence = sequence,
          .flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
          .stamp = nanoseconds(1234) + std::chrono::milliseconds(sequence)};
}
Packet image(std::uint32_t sequence) { return v4l2_packet(header_of(sequence), std::vector<std::byte>(16)); }
V4l2Decoder decoder_of(std::uint32_t fourcc) { return V4l2Decoder({.width = 4, .height = 2, .fourcc = fourcc}); }

// Returns "Lost 3" for a fault, "image 7" for an image, "empty image 7" for one without pixels.
std::vector<std::string> told(V4l2Decoder& decoder, const Packet& packet) {
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  std::vector<std::string> words;
  for (const auto& m : out) {
    if (const auto* f = std::get_if<Fault>(&m))
      words.push_back(std::string(name(f->kind)) + " " + std::to_string(f->count));
    if (const auto* i = std::get_if<Image>(&m)) {
      words.push_back((i->is_complete ? "image " : "empty image ") + std::to_string(i->frame_id));
      EXPECT_EQ(i->is_complete, !i->pixels().empty());
    }
  }
  return words;
}

TEST(V4l2Packet, HeaderLayoutIsAsWritten) {
  const V4l2Header header{.width = 0x01020304,
                          .height = 2,
                          .stride = 3,
                          .fourcc = V4L2_PIX_FMT_YUYV,
                          .sequence = 5,
                          .flags = 0x2040,
                          .stamp = nanoseconds(-2),
                          .used_bytes = 0,
                          .colour_space = 8,
                          .ycbcr_encoding = 1,
                          .quantisation = 2};
  std::array<std::byte, kV4l2HeaderSize> bytes;
  encode_v4l2_header(header, bytes);
  const std::array<unsigned char, kV4l2HeaderSize> written{
      'V', '4', 'L', '1', 1, 0, 64,   0,    4, 3, 2,    1,   2,   0,   0,   0,   3,   0,   0, 0, 'Y', 'U',
      'Y', 'V', 5,   0,   0, 0, 0x40, 0x20, 0, 0, 0xFE, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0,   0,
      8,   0,   0,   0,   1, 0, 0,    0,    2, 0, 0,    0,   0,   0,   0,   0,   0,   0,   0, 0};
  for (std::size_t i = 0; i < bytes.size(); ++i) EXPECT_EQ(std::to_integer<int>(bytes[i]), written[i]) << i;
  const auto read = decode_v4l2_header(bytes);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->stamp, nanoseconds(-2));
  EXPECT_EQ(read->quantisation, 2u);
  EXPECT_TRUE(read->is_monotonic());
  EXPECT_TRUE(read->is_damaged());
  EXPECT_FALSE(read->is_exposure_start());
}

TEST(V4l2Packet, BrokenHeadersAreRefused) {
  const auto code = [](std::size_t at, int value, std::size_t size) {
    std::vector<std::byte> bytes(kV4l2HeaderSize + 2);
    encode_v4l2_header({.used_bytes = 2}, std::span(bytes).first<kV4l2HeaderSize>());
    bytes[at] = static_cast<std::byte>(value);
    bytes.resize(size);
    const auto read = decode_v4l2_header(bytes);
    return read.ok() ? std::string("ok") : std::string(name(read.error().code));
  };
  EXPECT_EQ(code(0, 'V', 66), "ok");
  EXPECT_EQ(code(0, 'X', 66), "Malformed");
  EXPECT_EQ(code(4, 2, 66), "Unsupported");
  EXPECT_EQ(code(6, 32, 66), "Malformed");
  EXPECT_EQ(code(0, 'V', 63), "Truncated");
  EXPECT_EQ(code(0, 'V', 65), "Truncated");
  EXPECT_EQ(code(0, 'V', 67), "Malformed");
}

TEST(V4l2Decoder, PixelsOfOneByteStayInThePacket) {
  auto decoder = decoder_of(V4L2_PIX_FMT_SRGGB8);
  const Packet packet = image(7);
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  ASSERT_EQ(out.size(), 1u);
  const auto& got = std::get<Image>(out[0]);
  EXPECT_EQ(got.pixels().data(), packet.bytes.data() + kV4l2HeaderSize);
  EXPECT_EQ(got.stride, 8u);
  EXPECT_EQ(got.format, PixelFormat::BayerRG8);
  EXPECT_EQ(got.sensor, 3);
  EXPECT_EQ(got.packet_sequence, 77u);
  EXPECT_EQ(got.received, packet.received);
  EXPECT_EQ(got.time, DeviceTime<CameraCounter>(nanoseconds(7'001'234)));
}

TEST(V4l2Decoder, AStampOfAnUnknownClockIsNone) {
  auto decoder = decoder_of(V4L2_PIX_FMT_SRGGB8);
  V4l2Header header = header_of(1);
  header.flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  std::vector<Measurement> out;
  decoder.decode(v4l2_packet(header, std::vector<std::byte>(16)), out);
  EXPECT_EQ(std::get<Image>(out.at(0)).time, DeviceTime<CameraCounter>());
}

TEST(V4l2Decoder, GapsOfTheSequenceAreLostImages) {
  auto decoder = decoder_of(V4L2_PIX_FMT_SRGGB8);
  EXPECT_THAT(told(decoder, image(UINT32_MAX - 1)), ElementsAre("image 4294967294"));
  EXPECT_THAT(told(decoder, image(1)), ElementsAre("Lost 2", "image 4294967297"));
  EXPECT_THAT(told(decoder, image(2)), ElementsAre("image 4294967298"));
  EXPECT_THAT(told(decoder, image(2)), ElementsAre("Spurious 1"));
  EXPECT_THAT(told(decoder, image(0)), ElementsAre("Spurious 1", "image 0"));
  decoder.reset();
  EXPECT_THAT(told(decoder, image(100)), ElementsAre("image 100"));
}

TEST(V4l2Decoder, AnotherImageOfTheSameNumberIsToldAndUsed) {
  for (const std::uint32_t clock : {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN}) {
    auto decoder = decoder_of(V4L2_PIX_FMT_SRGGB8);
    V4l2Header header = header_of(0);
    header.flags = clock;
    EXPECT_THAT(told(decoder, v4l2_packet(header, std::vector<std::byte>(16))), ElementsAre("image 0"));
    header.stamp += clock == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC ? nanoseconds(1) : nanoseconds(0);
    EXPECT_THAT(told(decoder, v4l2_packet(header, std::vector<std::byte>(16))), ElementsAre("Spurious 1", "image 1"));
    header.sequence = 1;
    EXPECT_THAT(told(decoder, v4l2_packet(header, std::vector<std::byte>(16))), ElementsAre("image 2"));
  }
}

TEST(V4l2Decoder, DamagedAndShortImagesHaveNoPixelsAndAreTold) {
  auto decoder = decoder_of(V4L2_PIX_FMT_SRGGB8);
  V4l2Header damaged = header_of(1);
  damaged.flags |= V4L2_BUF_FLAG_ERROR;
  EXPECT_THAT(told(decoder, v4l2_packet(damaged, std::vector<std::byte>(16))), ElementsAre("Lost 1", "empty image 1"));
  // The last row needs no filling: 8 + 4 bytes are enough.
  EXPECT_THAT(told(decoder, v4l2_packet(header_of(2), std::vector<std::byte>(12))), ElementsAre("image 2"));
  EXPECT_THAT(told(decoder, v4l2_packet(header_of(3), std::vector<std::byte>(11))),
              ElementsAre("Lost 1", "empty image 3"));
  EXPECT_THAT(told(decoder, image(4)), ElementsAre("image 4"));
}

TEST(V4l2Decoder, ImagesOfAnotherKindAreRefused) {
  auto decoder = decoder_of(V4L2_PIX_FMT_SRGGB8);
  EXPECT_THAT(told(decoder, v4l2_packet(header_of(1, V4L2_PIX_FMT_GREY), std::vector<std::byte>(16))),
              ElementsAre("WrongDevice 1"));
  V4l2Header header = header_of(2);
  header.height = 3;
  EXPECT_THAT(told(decoder, v4l2_packet(header, std::vector<std::byte>(24))), ElementsAre("WrongSize 1"));
  header = header_of(3);
  header.stride = 3;
  EXPECT_THAT(told(decoder, v4l2_packet(header, std::vector<std::byte>(24))), ElementsAre("WrongSize 1"));
  EXPECT_THAT(told(decoder, {.bytes = Buffer::copy_of(bytes_of({1, 2}))}), ElementsAre("Malformed 1"));
}

TEST(V4l2Decoder, ConvertsByTheCodingOfItsPacket) {
  auto decoder = decoder_of(V4L2_PIX_FMT_YUYV);
  V4l2Header header = header_of(1, V4L2_PIX_FMT_YUYV);
  header.colour_space = V4L2_COLORSPACE_SRGB;
  std::vector<std::byte> pixels(16, std::byte{128});
  const auto first_pixel = [&] {
    std::vector<Measurement> out;
    decoder.decode(v4l2_packet(header, pixels), out);
    const auto& got = std::get<Image>(out.at(0));
    EXPECT_EQ(got.format, PixelFormat::Rgb8);
    EXPECT_EQ(got.stride, 12u);
    EXPECT_EQ(got.pixels().size(), 24u);
    return std::to_integer<int>(got.pixels()[0]);
  };
  EXPECT_EQ(first_pixel(), 130);  // (128 - 16) * 255 / 219
  ++header.sequence;
  header.quantisation = V4L2_QUANTIZATION_FULL_RANGE;
  EXPECT_EQ(first_pixel(), 128);
}

class MotionJpeg : public testing::Test {
 protected:
  // A picture whose left half is red and right half blue, or grey.
  static std::vector<std::byte> jpeg_of(int width, int height, TJSAMP sampling, int flags = 0) {
    std::vector<unsigned char> rgb(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
    for (std::size_t i = 0; i < rgb.size() / 3; ++i)
      rgb[3 * i + (static_cast<int>(i) % width < width / 2 ? 0 : 2)] = 250;
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    const tjhandle handle = tjInitCompress();
    EXPECT_EQ(tjCompress2(handle, rgb.data(), width, 0, height, TJPF_RGB, &bytes, &size, sampling, 95, flags), 0);
    const auto* begin = reinterpret_cast<const std::byte*>(bytes);
    const std::vector<std::byte> jpeg(begin, begin + size);
    tjFree(bytes);
    tjDestroy(handle);
    return jpeg;
  }
  // Cameras leave the usual Huffman tables (marker 0xFFC4) out.
  static std::vector<std::byte> without_tables(const std::vector<std::byte>& jpeg) {
    std::vector<std::byte> out(jpeg.begin(), jpeg.begin() + 2);
    for (std::size_t at = 2; at + 4 < jpeg.size();) {
      const auto marker = std::to_integer<int>(jpeg[at + 1]);
      if (marker == 0xDA) {
        out.insert(out.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
        break;
      }
      const auto length =
          2 + (std::to_integer<std::size_t>(jpeg[at + 2]) << 8 | std::to_integer<std::size_t>(jpeg[at + 3]));
      const auto* part = jpeg.data() + at;
      if (marker != 0xC4) out.insert(out.end(), part, part + length);
      at += length;
    }
    return out;
  }
  static V4l2Header header(std::uint32_t sequence) {
    return {.width = 32, .height = 16, .fourcc = V4L2_PIX_FMT_MJPEG, .sequence = sequence};
  }
  V4l2Decoder decoder_{{.width = 32, .height = 16, .fourcc = V4L2_PIX_FMT_MJPEG}};
};

TEST_F(MotionJpeg, BecomesRgbWithAndWithoutItsTables) {
  const auto whole = jpeg_of(32, 16, TJSAMP_422), cut = without_tables(whole);
  ASSERT_LT(cut.size() + 300, whole.size());
  std::uint32_t sequence = 0;
  for (const auto& jpeg : {whole, cut}) {
    std::vector<Measurement> out;
    decoder_.decode(v4l2_packet(header(sequence++), jpeg), out);
    const auto& got = std::get<Image>(out.at(0));
    ASSERT_TRUE(got.is_complete);
    EXPECT_EQ(got.format, PixelFormat::Rgb8);
    const auto at = [&](std::size_t x, std::size_t y, std::size_t c) {
      return std::to_integer<int>(got.pixels()[y * got.stride + 3 * x + c]);
    };
    EXPECT_NEAR(at(4, 8, 0), 250, 4);
    EXPECT_NEAR(at(4, 8, 2), 0, 4);
    EXPECT_NEAR(at(28, 8, 0), 0, 4);
    EXPECT_NEAR(at(28, 8, 2), 250, 4);
  }
}

TEST_F(MotionJpeg, GreyOnesStayGrey) {
  std::vector<Measurement> out;
  decoder_.decode(v4l2_packet(header(1), jpeg_of(32, 16, TJSAMP_GRAY)), out);
  const auto& got = std::get<Image>(out.at(0));
  EXPECT_EQ(got.format, PixelFormat::Mono8);
  EXPECT_EQ(got.pixels().size(), 512u);
}

TEST_F(MotionJpeg, FillingBehindItIsNoDamage) {
  auto jpeg = jpeg_of(32, 16, TJSAMP_420);
  jpeg.resize(jpeg.size() + 100);
  EXPECT_THAT(told(decoder_, v4l2_packet(header(1), jpeg)), ElementsAre("image 1"));
}

TEST_F(MotionJpeg, BrokenOnesAreToldAndTheNextIsWhole) {
  const auto jpeg = jpeg_of(32, 16, TJSAMP_422);
  std::uint32_t sequence = 0;
  const auto tell = [&](std::vector<std::byte> bytes) {
    return told(decoder_, v4l2_packet(header(++sequence), bytes));
  };
  EXPECT_THAT(tell({jpeg.begin(), jpeg.end() - 40}), ElementsAre("Malformed 1", "empty image 1"));
  EXPECT_THAT(tell({}), ElementsAre("Malformed 1", "empty image 2"));
  EXPECT_THAT(tell(bytes_of({0xFF, 0xD8})), ElementsAre("Malformed 1", "empty image 3"));
  EXPECT_THAT(tell(jpeg_of(16, 16, TJSAMP_422)), ElementsAre("Malformed 1", "empty image 4"));
  EXPECT_THAT(tell(jpeg_of(32, 16, TJSAMP_422, TJFLAG_PROGRESSIVE)), ElementsAre("Malformed 1", "empty image 5"));
  EXPECT_THAT(tell(jpeg), ElementsAre("image 6"));
}

}  // namespace
}  // namespace hueline::drivers
