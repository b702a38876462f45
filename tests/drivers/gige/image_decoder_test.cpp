#include "drivers/gige/image_decoder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace hueline::drivers {
namespace {

Packet packet_of(ImageHeader header, std::size_t pixels) {
  std::vector<std::byte> bytes(kImageHeaderSize + pixels, std::byte{0x5A});
  encode_image_header(header, std::span(bytes).first<kImageHeaderSize>());
  return {.sensor = 3, .sequence = 77, .received = host_time_ns(9), .bytes = Buffer::copy_of(bytes)};
}
ImageHeader header_of(std::uint64_t frame_id) {
  return {.width = 6,
          .height = 4,
          .stride = 8,
          .pfnc = pfnc_code(PixelFormat::BayerRG8),
          .frame_id = frame_id,
          .time = DeviceTime<CameraCounter>(nanoseconds(1234))};
}
Packet image(std::uint64_t frame_id) { return packet_of(header_of(frame_id), 32); }
std::vector<Measurement> decode(ImageDecoder& decoder, const Packet& packet) {
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  return out;
}
// Returns "Lost 3" for a fault, "image 7" for an image.
std::vector<std::string> told(ImageDecoder& decoder, const Packet& packet) {
  std::vector<std::string> words;
  for (const auto& m : decode(decoder, packet)) {
    if (const auto* f = std::get_if<Fault>(&m))
      words.push_back(std::string(name(f->kind)) + " " + std::to_string(f->count));
    if (const auto* i = std::get_if<Image>(&m)) words.push_back("image " + std::to_string(i->frame_id));
  }
  return words;
}

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ImagePacket, HeaderLayoutIsAsWritten) {
  const ImageHeader header{.width = 0x01020304,
                           .height = 2,
                           .stride = 0x01020304,
                           .pfnc = 0x01080001,
                           .frame_id = 0x1122334455667788,
                           .time = DeviceTime<CameraCounter>(nanoseconds(-1)),
                           .status = ImageStatus::TimedOut,
                           .missing_packets = 5,
                           .offset_x = 6,
                           .offset_y = 7,
                           .exposure = nanoseconds(0x0a0b0c0d),
                           .gain = 2.0f};
  std::array<std::byte, kImageHeaderSize> bytes;
  encode_image_header(header, bytes);
  const std::array<unsigned char, kImageHeaderSize> written{
      'I', 'M', 'G',  '1',  1,    0,    64,   0,    4,    3,    2,   1,   2,   0,   0,   0,   4,   3,   2, 1, 1, 0,
      8,   1,   0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 255, 255, 255, 255, 255, 255, 255, 255, 2, 0, 0, 0,
      5,   0,   0,    0,    6,    0,    0,    0,    7,    0,    0,   0,   13,  12,  11,  10,  0,   0,   0, 64};
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(written)), bytes));
  const auto back = decode_image_header(bytes);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->width, header.width);
  EXPECT_EQ(back->frame_id, header.frame_id);
  EXPECT_EQ(back->time, header.time);
  EXPECT_EQ(back->status, header.status);
  EXPECT_EQ(back->missing_packets, header.missing_packets);
  EXPECT_EQ(back->offset_y, header.offset_y);
  EXPECT_EQ(back->exposure, header.exposure);
  EXPECT_EQ(back->gain, header.gain);
}

TEST(ImagePacket, WhatTheCameraReportsComesWithTheImage) {
  ImageDecoder decoder(ImageDecoder::Config{});
  auto reported = [&, id = 0](nanoseconds exposure, float gain) mutable {
    ImageHeader header = header_of(static_cast<std::uint64_t>(++id));
    header.exposure = exposure;
    header.gain = gain;
    return std::get<Image>(decode(decoder, packet_of(header, 32)).at(0)).reported;
  };
  EXPECT_THAT(reported(nanoseconds(0), 0), IsEmpty());
  ASSERT_EQ(reported(nanoseconds(1'234'567), 0).size(), 1u);
  const ReportedExposure both = reported(nanoseconds(1'234'567), 1.5f).at(0);
  EXPECT_EQ(both.duration, nanoseconds(1'234'567));
  EXPECT_EQ(both.gain, 1.5f);
  EXPECT_EQ(both.region.width, 0u) << "the whole image";
  // Longer than the packet can say.
  EXPECT_THAT(reported(std::chrono::seconds(5), 0), IsEmpty());
}

TEST(ImagePacket, AGainThatIsNoNumberIsRefused) {
  for (const float gain : {-1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    std::array<std::byte, kImageHeaderSize> bytes;
    ImageHeader header = header_of(1);
    header.gain = gain;
    encode_image_header(header, bytes);
    const auto read = decode_image_header(bytes);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, ErrorCode::Malformed);
  }
}

TEST(ImagePacket, PixelFormatsAreThoseOfThePfnc) {
  for (const auto format : {PixelFormat::Mono8, PixelFormat::BayerRG8, PixelFormat::BayerBG8, PixelFormat::BayerGR8,
                            PixelFormat::BayerGB8, PixelFormat::Rgb8})
    EXPECT_EQ(pixel_format_of(pfnc_code(format)), format);
  // The codes are those in the description of Aravis's fake camera.
  EXPECT_EQ(pfnc_code(PixelFormat::BayerBG8), 17301515U);
  EXPECT_EQ(pfnc_code(PixelFormat::BayerGB8), 17301514U);
  EXPECT_EQ(pfnc_code(PixelFormat::BayerGR8), 17301512U);
  EXPECT_EQ(pfnc_code(PixelFormat::BayerRG8), 17301513U);
  EXPECT_EQ(pfnc_code(PixelFormat::Mono8), 17301505U);
  EXPECT_EQ(pfnc_code(PixelFormat::Rgb8), 35127316U);
  EXPECT_EQ(pixel_format_of(17825799), std::nullopt);  // Mono16
}

TEST(ImageDecoder, PixelsAreNotCopied) {
  ImageDecoder decoder({.width = 6, .height = 4, .pixel_format = PixelFormat::BayerRG8});
  const Packet packet = image(1);
  const auto out = decode(decoder, packet);
  ASSERT_EQ(out.size(), 1U);
  const auto& made = std::get<Image>(out[0]);
  EXPECT_EQ(made.buffer.data(), packet.bytes.data());
  EXPECT_EQ(made.pixels().data(), packet.bytes.data() + kImageHeaderSize);
  EXPECT_EQ(made.pixels().size(), 32U);
  EXPECT_EQ(made.sensor, 3);
  EXPECT_EQ(made.packet_sequence, 77U);
  EXPECT_EQ(made.received, host_time_ns(9));
  EXPECT_EQ(made.time.time_since_epoch(), nanoseconds(1234));
  EXPECT_EQ(made.stride, 8U);
  EXPECT_TRUE(made.is_complete);
  EXPECT_EQ(decoder.counts().decoded_bytes, packet.bytes.size());
}

TEST(ImageDecoder, GapsAreLostImages) {
  ImageDecoder decoder({});
  EXPECT_THAT(told(decoder, image(10)), ElementsAre("image 10"));
  EXPECT_THAT(told(decoder, image(11)), ElementsAre("image 11"));
  EXPECT_THAT(told(decoder, image(15)), ElementsAre("Lost 3", "image 15"));
  EXPECT_THAT(told(decoder, image(15)), ElementsAre("Spurious 1"));
  EXPECT_THAT(told(decoder, image(2)), ElementsAre("Spurious 1", "image 2"));
  decoder.reset();
  EXPECT_THAT(told(decoder, image(1)), ElementsAre("image 1"));
}

TEST(ImageDecoder, ShortIdsWrapPastZero) {
  ImageDecoder decoder({});
  EXPECT_THAT(told(decoder, image(65535)), ElementsAre("image 65535"));
  EXPECT_THAT(told(decoder, image(1)), ElementsAre("image 1"));
  ImageDecoder with_gap({});
  EXPECT_THAT(told(with_gap, image(65533)), ElementsAre("image 65533"));
  EXPECT_THAT(told(with_gap, image(2)), ElementsAre("Lost 3", "image 2"));
  ImageDecoder long_ids({});
  EXPECT_THAT(told(long_ids, image(65535)), ElementsAre("image 65535"));
  EXPECT_THAT(told(long_ids, image(65536)), ElementsAre("image 65536"));
}

TEST(ImageDecoder, IncompleteImagesAreFlaggedAndHeadlessOnesBecomeTheGap) {
  ImageDecoder decoder({});
  ImageHeader header = header_of(1);
  header.status = ImageStatus::MissingPackets;
  header.missing_packets = 9;
  auto out = decode(decoder, packet_of(header, 32));
  ASSERT_EQ(out.size(), 1U);
  EXPECT_FALSE(std::get<Image>(out[0]).is_complete);
  EXPECT_EQ(std::get<Image>(out[0]).missing_packets, 9U);
  EXPECT_THAT(told(decoder, packet_of({.status = ImageStatus::NoLeader}, 32)), IsEmpty());
  EXPECT_THAT(told(decoder, image(3)), ElementsAre("Lost 1", "image 3"));
}

TEST(ImageDecoder, WrongSizeAndWrongFormatAreSaidAndNotUsed) {
  ImageDecoder other_size({.width = 6, .height = 5});
  EXPECT_THAT(told(other_size, image(1)), ElementsAre("WrongSize 1"));
  ImageDecoder other_format({.pixel_format = PixelFormat::Mono8});
  EXPECT_THAT(told(other_format, image(1)), ElementsAre("WrongDevice 1"));
  ImageHeader unknown = header_of(2);
  unknown.pfnc = 17825799;
  EXPECT_THAT(told(other_format, packet_of(unknown, 32)), ElementsAre("WrongDevice 1"));
}

TEST(ImageDecoder, BrokenBytesAreMalformed) {
  ImageDecoder decoder({});
  const auto whole = image(1);
  for (const std::size_t size : {0, 1, 63, 64, 95}) {
    const Packet cut{.bytes = Buffer::copy_of(whole.bytes.bytes().first(size))};
    EXPECT_THAT(told(decoder, cut), ElementsAre("Malformed 1")) << size;
  }
  ImageHeader narrow = header_of(1);
  narrow.stride = 5;
  EXPECT_THAT(told(decoder, packet_of(narrow, 32)), ElementsAre("Malformed 1"));
  ImageHeader vast = header_of(1);
  vast.stride = vast.height = 0xFFFFFFFF;
  EXPECT_THAT(told(decoder, packet_of(vast, 32)), ElementsAre("Malformed 1"));
  for (const std::size_t at : {0, 4, 6, 40}) {
    std::vector<std::byte> bytes(whole.bytes.bytes().begin(), whole.bytes.bytes().end());
    bytes[at] = std::byte{0x77};
    EXPECT_THAT(told(decoder, Packet{.bytes = Buffer::copy_of(bytes)}), ElementsAre("Malformed 1")) << at;
  }
}

}  // namespace
}  // namespace hueline::drivers
