// Images of messages of ROS, read back by the decoder of the camera whose packets they become.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <array>
#include <cstring>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/import/camera_choice.hpp"
#include "apps/import/image_message.hpp"
#include "drivers/v4l2/v4l2_decoder.hpp"
#include "storage/png.hpp"
#include "tests/rosbag/sample_bag.hpp"

namespace hueline {
namespace {

using drivers::RosEncoding;
using drivers::RosReader;

constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;

RosReader reader(const test::RosWriter& message) {
  return {std::as_bytes(std::span(message.bytes())), RosEncoding::Cdr};
}

struct Raw {
  std::uint32_t width = 0, height = 0;
  std::string encoding;
  std::uint32_t step = 0;
  std::string bytes;
  bool is_big_endian = false;
};
test::RosWriter raw_image(const Raw& raw, std::int64_t ns = kStamp_ns) {
  test::RosWriter out(RosEncoding::Cdr);
  out.header(ns, "camera").put(raw.height).put(raw.width).text(raw.encoding);
  return out.put(std::uint8_t{raw.is_big_endian}).put(raw.step).sequence(raw.bytes);
}
test::RosWriter compressed_image(const std::string& format, const std::string& bytes) {
  test::RosWriter out(RosEncoding::Cdr);
  return out.header(kStamp_ns, "camera").text(format).sequence(bytes);
}

/// Returns what the camera's decoder makes of the packet.
Image seen(const apps::ImageMessage& message) {
  std::string format = message.format;
  format.resize(4, ' ');
  std::uint32_t code = 0;
  std::memcpy(&code, format.data(), 4);
  drivers::V4l2Decoder decoder({.width = message.width, .height = message.height, .fourcc = code});
  std::vector<Measurement> out;
  decoder.decode({1, PacketKind::Wire, false, 0, HostTime{}, message.packet}, out);
  for (const Measurement& one : out)
    if (const auto* image = std::get_if<Image>(&one)) return *image;
  return {};
}
/// Returns the pixels of a row.
std::vector<int> row_of(const Image& image, std::size_t row) {
  std::vector<int> out;
  if (!image.is_complete) return out;
  const std::size_t bytes = image.width * drivers::converted_pixel_bytes(image.format);
  for (std::size_t i = 0; i < bytes; ++i) out.push_back(std::to_integer<int>(image.pixels()[row * image.stride + i]));
  return out;
}
Image image_of(const Raw& raw) {
  const auto image = apps::take_image("sensor_msgs/Image", reader(raw_image(raw)), {});
  EXPECT_TRUE(image.ok()) << raw.encoding << ": " << image.error().message;
  return image.ok() ? seen(*image) : Image();
}

TEST(ImageMessage, GivesThePixelsAndTheTime) {
  const Raw raw{3, 2, "bayer_rggb8", 4, "abc-def-"};  // rows of 4 bytes, 3 of them pixels
  const auto message = apps::take_image("sensor_msgs/Image", reader(raw_image(raw, kStamp_ns + 42)), {.sequence = 7});
  ASSERT_TRUE(message.ok()) << message.error().message;
  EXPECT_EQ(message->format, "RGGB");
  EXPECT_FALSE(message->is_grey);
  const Image image = seen(*message);
  EXPECT_TRUE(image.is_complete);
  EXPECT_EQ(image.format, PixelFormat::BayerRG8);
  EXPECT_EQ(count_ns(image.time), kStamp_ns + 42);
  EXPECT_EQ(row_of(image, 1), (std::vector<int>{'d', 'e', 'f'}));
}

TEST(ImageMessage, PixelsThatV4l2HasNotBecomeRedGreenAndBlue) {
  const std::vector<int> wanted{1, 2, 3, 4, 5, 6};
  EXPECT_EQ(row_of(image_of({2, 1, "rgba8", 8, "\1\2\3x\4\5\6x"}), 0), wanted);
  EXPECT_EQ(row_of(image_of({2, 1, "bgra8", 8, "\3\2\1x\6\5\4x"}), 0), wanted);
  EXPECT_EQ(row_of(image_of({2, 1, "8UC4", 9, "\3\2\1x\6\5\4xx"}), 0), wanted);
  EXPECT_EQ(row_of(image_of({2, 1, "8UC3", 6, "\3\2\1\6\5\4"}), 0), wanted);
  EXPECT_EQ(row_of(image_of({2, 1, "rgb16", 12, "x\1x\2x\3x\4x\5x\6"}), 0), wanted);
  EXPECT_EQ(row_of(image_of({2, 1, "bgra16", 16, "\3x\2x\1xxx\6x\5x\4xxx", true}), 0), wanted);
}

TEST(ImageMessage, TwoBytesEachAreTakenInTheirOrder) {
  EXPECT_EQ(row_of(image_of({2, 2, "mono16", 4, "x\1x\2x\3x\4"}), 1), (std::vector<int>{3, 4}));
  EXPECT_EQ(row_of(image_of({2, 2, "mono16", 4, "\1x\2x\3x\4x", true}), 1), (std::vector<int>{3, 4}));
  const Image bayer = image_of({2, 2, "bayer_grbg16", 4, "x\1x\2x\3x\4"});
  EXPECT_EQ(bayer.format, PixelFormat::BayerGR8);
  EXPECT_EQ(row_of(bayer, 0), (std::vector<int>{1, 2}));
}

TEST(ImageMessage, SamplesOfFewerBitsAreRaised) {
  const auto bits = [](const Raw& raw) { return apps::used_bits("sensor_msgs/Image", reader(raw_image(raw))); };
  EXPECT_EQ(bits({2, 1, "mono16", 4, std::string("\0\1\xFF\x0F", 4)}), 12u);
  EXPECT_EQ(bits({2, 1, "mono16", 4, std::string("\1\0\x0F\xFF", 4), true}), 12u);
  EXPECT_EQ(bits({1, 2, "bayer_rggb16", 4, std::string("\0\1xx\0\2xx", 8)}), 10u) << "what fills a row is no sample";
  EXPECT_EQ(bits({1, 1, "rgb16", 6, std::string("\0\1\0\1\0\x80", 6)}), 16u);
  EXPECT_EQ(bits({2, 1, "mono8", 2, "\1\1"}), 0u);
  const auto raised = [](const Raw& raw) {
    const auto image = apps::take_image("sensor_msgs/Image", reader(raw_image(raw)), {.raised_bits = 4});
    return row_of(seen(*image), 0);
  };
  const std::vector<int> wanted{0x12, 0xFF};
  EXPECT_EQ(raised({2, 1, "mono16", 4, std::string("\x2F\x01\xFF\x0F", 4)}), wanted);
  EXPECT_EQ(raised({2, 1, "mono16", 4, std::string("\x01\x2F\x0F\xFF", 4), true}), wanted);
  EXPECT_EQ(raised({1, 1, "rgb16", 6, std::string("\x01\x2F\x02\x00\x0F\xFF", 6), true}),
            (std::vector<int>{0x12, 0x20, 0xFF}));
  constexpr std::array<std::pair<unsigned, unsigned>, 7> kRaised{
      {{0, 0}, {5, 6}, {10, 6}, {11, 4}, {14, 2}, {15, 0}, {16, 0}}};
  for (const auto& [used, by] : kRaised) {
    apps::CameraTopic camera;
    camera.used_bits = used;
    EXPECT_EQ(camera.raised_bits(), by) << used;
  }
}

TEST(ImageMessage, SamplesOfFewerBitsInPngAreRaised) {
  // Two pixels of 12 bits in 16: 16 times 116, 30, 240 and 255, 0, 8.
  constexpr std::string_view kHex =
      "89504e470d0a1a0a0000000d49484452000000020000000110020000002bd0349e0000001549444154789c636077607cc0cfc0ff9f8181a1"
      "0100115802c6fd9ef7a20000000049454e44ae426082";
  std::string png;
  for (std::size_t i = 0; i < kHex.size(); i += 2)
    png += static_cast<char>(std::stoi(std::string(kHex.substr(i, 2)), nullptr, 16));
  const auto message = compressed_image("rgb16; png compressed ", png);
  EXPECT_EQ(apps::used_bits("sensor_msgs/CompressedImage", reader(message)), 12u);
  const auto image = apps::take_image("sensor_msgs/CompressedImage", reader(message), {.raised_bits = 4});
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_EQ(row_of(seen(*image), 0), (std::vector<int>{116, 30, 240, 255, 0, 8}));
  const storage::RgbImage eight(2, 1, {7, 2, 15});
  const auto encoded = storage::encode_png({eight.pixels.data()->data(), 2, 1});
  const std::string plain(reinterpret_cast<const char*>(encoded->data()), encoded->size());
  EXPECT_EQ(apps::used_bits("sensor_msgs/CompressedImage", reader(compressed_image("rgb8; png compressed ", plain))),
            0u);
  EXPECT_EQ(apps::used_bits("sensor_msgs/CompressedImage", reader(compressed_image("png", png.substr(0, 60)))), 0u);
}

TEST(ImageMessage, TheNamesOfRos2AreRead) {
  const std::vector<int> grey{130, 130, 130, 130, 130, 130};  // (128 - 16) * 255 / 219
  for (const std::string name : {"yuv422", "uyvy", "yuv422_yuy2", "yuyv"})
    EXPECT_EQ(row_of(image_of({2, 1, name, 4, "\x80\x80\x80\x80"}), 0), grey) << name;
  EXPECT_EQ(row_of(image_of({2, 2, "nv21", 2, "\x80\x80\x80\x80\x80\x80"}), 1), grey);
}

TEST(ImageMessage, PicturesThatNoCameraSendsBecomePixels) {
  storage::RgbImage picture(16, 16, {200, 30, 60});
  picture.at(1, 0) = {1, 2, 3};
  const std::uint8_t* pixels = picture.pixels.data()->data();
  const auto png = storage::encode_png({pixels, 16, 16});
  ASSERT_TRUE(png.ok());
  const std::string as_png(reinterpret_cast<const char*>(png->data()), png->size());
  const auto message =
      apps::take_image("sensor_msgs/CompressedImage", reader(compressed_image("rgb8; png compressed", as_png)), {});
  ASSERT_TRUE(message.ok()) << message.error().message;
  EXPECT_EQ(message->format, "RGB3");
  EXPECT_FALSE(message->is_grey);
  const auto row = row_of(seen(*message), 0);
  ASSERT_EQ(row.size(), 48u);
  EXPECT_EQ((std::vector<int>{row.begin(), row.begin() + 6}), (std::vector<int>{200, 30, 60, 1, 2, 3}));

  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  const auto handle = tjInitCompress();
  ASSERT_EQ(tjCompress2(handle, pixels, 16, 0, 16, TJPF_RGB, &jpeg, &size, TJSAMP_444, 95, TJFLAG_PROGRESSIVE), 0);
  const std::string progressive(reinterpret_cast<const char*>(jpeg), size);
  tjFree(jpeg);
  tjDestroy(handle);
  const auto several =
      apps::take_image("sensor_msgs/CompressedImage", reader(compressed_image("jpeg", progressive)), {});
  ASSERT_TRUE(several.ok()) << several.error().message;
  EXPECT_EQ(several->format, "RGB3");
  const auto last = row_of(seen(*several), 15);
  ASSERT_EQ(last.size(), 48u);
  EXPECT_NEAR(last[0], 200, 6);
  EXPECT_NEAR(last[1], 30, 6);

  // EXIF data with an orientation of 6, as of a telephone that is held upright.
  EXPECT_EQ(several->orientation, 1);
  const std::string exif(
      "\xFF\xE1\x00\x22"
      "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0",
      36);
  const auto upright =
      apps::take_image("sensor_msgs/CompressedImage",
                       reader(compressed_image("jpeg", progressive.substr(0, 2) + exif + progressive.substr(2))), {});
  ASSERT_TRUE(upright.ok()) << upright.error().message;
  EXPECT_EQ(upright->orientation, 6);
  EXPECT_EQ(row_of(seen(*upright), 15), last) << "the pixels are as stored";
}

TEST(ImageMessage, AMosaicThatWasCompressedAsGreyKeepsItsColours) {
  // What a camera with the pattern RGGB sees of one colour.
  constexpr int kSide = 16;
  storage::RgbImage samples(kSide, kSide, {0, 0, 0});
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const auto value = static_cast<std::uint8_t>(x % 2 != y % 2 ? 90 : x % 2 == 0 ? 200 : 40);
      samples.at(x, y) = {value, value, value};
    }
  const std::uint8_t* pixels = samples.pixels.data()->data();
  const auto encoded = storage::encode_png({pixels, kSide, kSide});
  ASSERT_TRUE(encoded.ok());
  const std::string png(reinterpret_cast<const char*>(encoded->data()), encoded->size());
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  const auto handle = tjInitCompress();
  ASSERT_EQ(tjCompress2(handle, pixels, kSide, 0, kSide, TJPF_RGB, &buffer, &size, TJSAMP_GRAY, 100, 0), 0);
  const std::string jpeg(reinterpret_cast<const char*>(buffer), size);
  tjFree(buffer);
  tjDestroy(handle);

  const auto take = [](const std::string& format, const std::string& bytes) {
    return apps::take_image("sensor_msgs/CompressedImage", reader(compressed_image(format, bytes)), {});
  };
  for (const auto& [format, bytes] :
       {std::pair("bayer_rggb8; jpeg compressed ", &jpeg), std::pair("bayer_rggb8; png compressed ", &png),
        std::pair("bayer_rggb8; jpeg compressed bayer_rggb8", &jpeg)}) {
    const auto message = take(format, *bytes);
    ASSERT_TRUE(message.ok()) << message.error().message;
    EXPECT_EQ(message->format, "RGGB") << format;
    EXPECT_FALSE(message->is_grey);
    const auto red = row_of(seen(*message), 8), blue = row_of(seen(*message), 9);
    ASSERT_EQ(red.size(), std::size_t{kSide});
    EXPECT_NEAR(red[8], 200, 2);
    EXPECT_NEAR(red[9], 90, 2);
    EXPECT_NEAR(blue[8], 90, 2);
    EXPECT_NEAR(blue[9], 40, 2);
  }
  EXPECT_EQ(take("bayer_bggr8; png compressed ", png)->format, "BA81");
  // What was converted before is grey, or has its colours.
  EXPECT_TRUE(take("bayer_rggb8; jpeg compressed mono8", jpeg)->is_grey);
  EXPECT_TRUE(take("mono8; jpeg compressed ", jpeg)->is_grey);
  storage::RgbImage colours(kSide, kSide, {200, 90, 40});
  const auto coloured = storage::encode_png({colours.pixels.data()->data(), kSide, kSide});
  ASSERT_TRUE(coloured.ok());
  const std::string as_png(reinterpret_cast<const char*>(coloured->data()), coloured->size());
  EXPECT_EQ(take("bayer_rggb8; png compressed bgr8", as_png)->format, "RGB3");
  EXPECT_EQ(take("bayer_rggb8; png compressed ", as_png)->format, "RGB3");
}

TEST(ImageMessage, ImagesOfFoxglovesSchemasAreRead) {
  test::RosWriter message(RosEncoding::Cdr);
  message.time(kStamp_ns).text("camera").put(std::uint32_t{2}).put(std::uint32_t{1}).text("rgb8");
  message.put(std::uint32_t{6}).sequence("\1\2\3\4\5\6");
  const auto image = apps::take_image("foxglove_msgs/RawImage", reader(message), {});
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_EQ(image->header.frame, "camera");
  EXPECT_EQ(row_of(seen(*image), 0), (std::vector<int>{1, 2, 3, 4, 5, 6}));
}

TEST(ImageMessage, AnImageWithoutAStampGetsTheRecordersTime) {
  const Raw raw{3, 1, "mono8", 3, "abc"};
  const UnixTime recorded{nanoseconds(kStamp_ns + 5)};
  const apps::ImageStamp rule{.unstamped = recorded, .shift = std::chrono::hours(1)};
  const auto unstamped = apps::take_image("sensor_msgs/Image", reader(raw_image(raw, 0)), rule);
  ASSERT_TRUE(unstamped.ok());
  EXPECT_EQ(unstamped->header.stamp, recorded);
  EXPECT_EQ(count_ns(seen(*unstamped).time), kStamp_ns + 5);
  const auto stamped = apps::take_image("sensor_msgs/Image", reader(raw_image(raw)), rule);
  ASSERT_TRUE(stamped.ok());
  EXPECT_EQ(count_ns(seen(*stamped).time), kStamp_ns + 3'600'000'000'000);
}

TEST(ImageMessage, SaysWhatIsReadInstead) {
  const auto why = [](const std::string& type, const test::RosWriter& message) {
    const auto image = apps::take_image(type, reader(message), {});
    return image.ok() ? "it is read" : image.error().message;
  };
  EXPECT_EQ(why("sensor_msgs/Image", raw_image({3, 2, "32FC1", 12, std::string(24, 'x')})),
            "pixels of the encoding \"32FC1\"; mono8, mono16, rgb8, bgr8, rgba8, bgra8, rgb16, bgr16, bayer_* of 8 and "
            "16 bits, 8UC1, 8UC3, 8UC4, yuv422, yuyv and nv21 are read");
  EXPECT_EQ(why("sensor_msgs/CompressedImage", compressed_image("h264", std::string("\0\0\0\1\x67", 5))),
            "compressed as \"h264\": video is not read; images, JPEG or PNG are");
  EXPECT_EQ(why("sensor_msgs/CompressedImage", compressed_image("16UC1; compressedDepth png", "x")),
            "compressed as \"16UC1; compressedDepth png\": depths, no colours");
  EXPECT_EQ(why("sensor_msgs/CompressedImage", compressed_image("webp", "RIFF....WEBP")),
            "compressed as \"webp\": is neither a PNG nor a JPEG by its first bytes");
  EXPECT_EQ(why("ffmpeg_image_transport_msgs/FFMPEGPacket", test::RosWriter(RosEncoding::Cdr)),
            "video is not read; record images, or decode it into sensor_msgs/Image");
}

TEST(ImageMessage, MessagesCutAnywhereAreRefused) {
  for (const Raw& raw :
       {Raw{3, 2, "mono8", 3, "abcdef"}, Raw{2, 1, "rgba8", 8, "\1\2\3x\4\5\6x"}, Raw{2, 2, "nv21", 2, "abcdef"}}) {
    const std::string whole = raw_image(raw).bytes();
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::string cut = whole.substr(0, size);
      const RosReader in(std::as_bytes(std::span(cut)), RosEncoding::Cdr);
      EXPECT_FALSE(apps::take_image("sensor_msgs/Image", in, {}).ok()) << raw.encoding << " cut to " << size;
    }
  }
  // The size that the message names needs more bytes than it has.
  EXPECT_FALSE(apps::take_image("sensor_msgs/Image", reader(raw_image({2, 2, "nv21", 2, "abcd"})), {}).ok());
  EXPECT_FALSE(apps::take_image("sensor_msgs/Image", reader(raw_image({2, 2, "rgba8", 7, "0123456789abcd"})), {}).ok());
}

}  // namespace
}  // namespace hueline
