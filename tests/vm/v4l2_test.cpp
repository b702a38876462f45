#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "drivers/transport/file_descriptor.hpp"
#include "drivers/transport/host_clock.hpp"
#include "drivers/v4l2/v4l2_camera.hpp"
#include "drivers/v4l2/v4l2_control.hpp"
#include "drivers/v4l2/v4l2_decoder.hpp"
#include "drivers/v4l2/v4l2_ioctl.hpp"
#include "drivers/v4l2/v4l2_source.hpp"
#include "tests/support/replugs.hpp"

// V4l2Source and V4l2Decoder on the kernel's test camera (vivid): runs in the guest of tests/vm (v4l2.sh). Its first
// device has formats of one plane, its second those of several.
namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr const char* kFirst = "platform:vivid-000";
constexpr const char* kSecond = "platform:vivid-001";
constexpr std::uint32_t kWidth = 320, kHeight = 180;

V4l2Config config_of(const char* bus_info = kFirst, std::uint32_t fourcc = V4L2_PIX_FMT_YUYV) {
  V4l2Config config;
  config.bus_info = bus_info;
  config.width = kWidth;
  config.height = kHeight;
  config.fourcc = fourcc;
  config.frame_rate_hz = 40;
  return config;
}

std::string path_of(const std::string& bus_info) {
  for (const V4l2Candidate& camera : list_v4l2_cameras())
    if (camera.bus_info == bus_info) return camera.path;
  return {};
}

/// Sets controls of the camera from outside, as another program can.
void set(const char* name, const std::string& value, const char* bus_info = kFirst) {
  const FileDescriptor fd(::open(path_of(bus_info).c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_TRUE(fd) << bus_info;
  const Status status = set_v4l2_controls(fd.get(), list_v4l2_controls(fd.get()), {{name, value}});
  ASSERT_TRUE(status.ok()) << status.error().message;
}

/// Plugs both cameras in or out, by their driver's binding.
void plug(bool is_in) {
  std::ofstream(std::string("/sys/bus/platform/drivers/vivid/") + (is_in ? "bind" : "unbind"))
      << "vivid.0" << std::flush;
}

/// Everything that comes in a time, decoded.
struct Received {
  std::vector<Image> images;
  std::vector<Packet> packets;  // of images
  std::map<FaultKind, std::uint64_t> faults;
  std::vector<std::string> details;
  std::optional<Error> end;

  std::uint64_t count(FaultKind kind) const {
    const auto found = faults.find(kind);
    return found == faults.end() ? 0 : found->second;
  }
};
Received receive(V4l2Source& source, V4l2Decoder& decoder, std::size_t images, nanoseconds limit = seconds(20)) {
  Received all;
  for (const HostTime begin = host_now(); all.images.size() < images && host_now() - begin < limit;) {
    auto packet = source.next({});
    if (!packet) {
      if (packet.error().code == ErrorCode::TimedOut) continue;
      all.end = packet.error();
      break;
    }
    std::vector<Measurement> out;
    if (packet->kind == PacketKind::Fault)
      out.push_back(*decode_fault(packet->sensor, packet->received, packet->bytes.bytes()));
    else
      decoder.decode(*packet, out);
    for (auto& m : out) {
      if (auto* image = std::get_if<Image>(&m)) all.images.push_back(std::move(*image));
      if (const auto* fault = std::get_if<Fault>(&m)) {
        all.faults[fault->kind] += fault->count;
        all.details.push_back(std::string(name(fault->kind)) + ": " + fault->detail);
      }
    }
    if (packet->kind != PacketKind::Fault) all.packets.push_back(std::move(*packet));
  }
  return all;
}

struct Camera {
  V4l2Config config;
  V4l2Source source;
  V4l2Decoder decoder;
  explicit Camera(const V4l2Config& with)
      : config(with), source(with), decoder({.width = with.width, .height = with.height, .fourcc = with.fourcc}) {}
  Received receive(std::size_t images, nanoseconds limit = seconds(20)) {
    return drivers::receive(source, decoder, images, limit);
  }
};

std::string refusal_of(const V4l2Config& config, ErrorCode code) {
  V4l2Source source(config);
  const Status status = source.open();
  EXPECT_FALSE(status.ok());
  if (status.ok()) return {};
  EXPECT_EQ(status.error().code, code) << status.error().message;
  return status.error().message;
}

std::uint64_t sum_of(const Buffer& buffer) {
  return std::accumulate(buffer.bytes().begin(), buffer.bytes().end(), std::uint64_t{0},
                         [](std::uint64_t sum, std::byte b) { return sum * 31 + std::to_integer<std::uint64_t>(b); });
}

class V4l2OfKernel : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* camera : {kFirst, kSecond}) {
      set("osd_text_mode", "2", camera);  // no text in the picture
      set("test_pattern", "0", camera);
    }
  }
};

/// Red, green and blue at a place of a Bayer mosaic, of the pixels around it.
std::array<int, 3> colour_at(const Image& image, std::uint32_t x, std::uint32_t y) {
  const auto pixels = image.pixels();
  const auto value = [&](std::uint32_t column, std::uint32_t row, std::uint32_t c = 0, std::uint32_t bytes = 1) {
    return std::to_integer<int>(pixels[std::size_t{row} * image.stride + column * bytes + c]);
  };
  if (image.format == PixelFormat::Rgb8) return {value(x, y, 0, 3), value(x, y, 1, 3), value(x, y, 2, 3)};
  if (image.format == PixelFormat::Mono8) return {value(x, y), value(x, y), value(x, y)};
  x &= ~1u;
  y &= ~1u;
  const std::uint32_t red_x = image.format == PixelFormat::BayerGR8 || image.format == PixelFormat::BayerBG8;
  const std::uint32_t red_y = image.format == PixelFormat::BayerGB8 || image.format == PixelFormat::BayerBG8;
  return {value(x + red_x, y + red_y), value(x + 1 - red_x, y + red_y), value(x + 1 - red_x, y + 1 - red_y)};
}

// The kernel makes each format by itself from one test picture, so each must show the same colours. The picture has
// eight bars: white, yellow, cyan, green, magenta, red, blue, black, each of 75 %.
TEST_F(V4l2OfKernel, EveryFormatThatItHasShowsTheSameColours) {
  constexpr std::array<std::array<int, 3>, 8> kBars{
      {{1, 1, 1}, {1, 1, 0}, {0, 1, 1}, {0, 1, 0}, {1, 0, 1}, {1, 0, 0}, {0, 0, 1}, {0, 0, 0}}};
  std::map<const char*, std::vector<std::string>> seen;
  for (const char* bus_info : {kFirst, kSecond})
    for (const V4l2Format& format : v4l2_formats()) {
      Camera camera(config_of(bus_info, format.fourcc));
      if (const Status status = camera.source.open(); !status.ok()) {
        EXPECT_EQ(status.error().code, ErrorCode::Invalid) << status.error().message;
        continue;
      }
      const Received got = camera.receive(2);
      ASSERT_EQ(got.images.size(), 2u) << fourcc_text(format.fourcc);
      // This driver may give its first two images the number 0, and it loses images if the machine is busy.
      for (const auto& [kind, count] : got.faults)
        EXPECT_TRUE(kind == FaultKind::Spurious || kind == FaultKind::Lost) << got.details[0];
      seen[bus_info].push_back(fourcc_text(format.fourcc));
      const Image& image = got.images[1];
      EXPECT_TRUE(image.is_complete);
      for (std::uint32_t bar = 0; bar < 8; ++bar) {
        const auto colour = colour_at(image, kWidth * (2 * bar + 1) / 16, kHeight * 3 / 4);
        if (image.format == PixelFormat::Mono8) continue;
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(colour[c], 191 * kBars[bar][c], 6)
              << fourcc_text(format.fourcc) << " bar " << bar << " channel " << c;
      }
      if (image.format == PixelFormat::Mono8) {
        EXPECT_NEAR(colour_at(image, 20, 135)[0], 191, 6) << fourcc_text(format.fourcc);
        EXPECT_NEAR(colour_at(image, 300, 135)[0], 0, 6) << fourcc_text(format.fourcc);
      }
    }
  for (const auto& [bus_info, formats] : seen) {
    std::string line;
    for (const std::string& format : formats) line += " " + format;
    std::printf("%s:%s\n", bus_info, line.c_str());
    EXPECT_THAT(formats, testing::IsSupersetOf({"YUYV", "NV12", "GREY", "RGGB", "RG10", "RG12", "RGB3"}));
  }
}

TEST_F(V4l2OfKernel, WhatTheCameraHasNotIsRefusedWithWhatItHas) {
  V4l2Config config = config_of();
  config.width = 321;
  EXPECT_THAT(refusal_of(config, ErrorCode::Invalid), HasSubstr("320 x 180, 640 x 360"));
  EXPECT_THAT(refusal_of(config_of(kFirst, V4L2_PIX_FMT_MJPEG), ErrorCode::Invalid), HasSubstr("YUYV"));
  config = config_of();
  config.frame_rate_hz = 777.7;
  EXPECT_THAT(refusal_of(config, ErrorCode::Invalid), HasSubstr("at this size it has"));
  config = config_of();
  config.controls = {{"brightnes", "3"}};
  EXPECT_THAT(refusal_of(config, ErrorCode::Invalid),
              HasSubstr("did you mean brightness? It has: brightness: 0 to 255"));
  config.controls = {{"brightness", "256"}};
  EXPECT_THAT(refusal_of(config, ErrorCode::Invalid), HasSubstr("cannot be 256"));
  config = config_of("usb-0000:00:14.0-2");
  EXPECT_THAT(refusal_of(config, ErrorCode::Unavailable), HasSubstr("(vivid, platform:vivid-000)"));
  config = config_of();
  config.device = "/dev/video99";
  EXPECT_THAT(refusal_of(config, ErrorCode::Unavailable), HasSubstr("/dev/video99"));
  config.device = "/dev/null";
  EXPECT_THAT(refusal_of(config, ErrorCode::Invalid), HasSubstr("is no device that streams"));
  config.device = path_of(kSecond);
  EXPECT_THAT(refusal_of(config, ErrorCode::Unavailable), HasSubstr("another camera"));
}

TEST_F(V4l2OfKernel, ASecondProgramWaits) {
  Camera first(config_of());
  ASSERT_TRUE(first.source.open().ok());
  EXPECT_THAT(refusal_of(config_of(), ErrorCode::Unavailable), HasSubstr("another program"));
  EXPECT_EQ(first.receive(2).images.size(), 2u);
}

TEST_F(V4l2OfKernel, ControlsAndRateAreSetBeforeTheFirstImage) {
  V4l2Config config = config_of();
  config.frame_rate_hz = 10;
  config.controls = {{"brightness", "0x50"}, {"horizontal_flip", "true"}};
  Camera camera(config);
  const Status status = camera.source.open();
  ASSERT_TRUE(status.ok()) << status.error().message;
  const FileDescriptor fd(::open(path_of(kFirst).c_str(), O_RDWR | O_CLOEXEC));
  v4l2_control brightness{V4L2_CID_BRIGHTNESS, 0};
  ASSERT_EQ(v4l2_ioctl(fd.get(), VIDIOC_G_CTRL, &brightness), 0);
  EXPECT_EQ(brightness.value, 0x50);
  const Received got = camera.receive(12);
  ASSERT_EQ(got.images.size(), 12u);
  // The black bar is on the left now.
  EXPECT_LT(colour_at(got.images[0], 20, 135)[0], colour_at(got.images[0], 300, 135)[0]);
  std::vector<double> intervals;
  for (std::size_t i = 1; i < got.images.size(); ++i)
    intervals.push_back(to_seconds(got.images[i].received - got.images[i - 1].received));
  std::ranges::nth_element(intervals, intervals.begin() + 5);
  EXPECT_NEAR(intervals[5], 0.1, 0.02);
  set("brightness", "128");
  set("horizontal_flip", "false");
}

TEST_F(V4l2OfKernel, StampsOfTheEndAreTheArrival) {
  Camera camera(config_of());
  ASSERT_TRUE(camera.source.open().ok());
  const HostTime begin = host_now();
  const Received got = camera.receive(10);
  const HostTime end = host_now();
  ASSERT_EQ(got.images.size(), 10u);
  for (std::size_t i = 0; i < got.images.size(); ++i) {
    const Image& image = got.images[i];
    // This driver calculates the end of the image when it begins to fill it, so its stamp may lie ahead.
    EXPECT_LT(image.received, to_host_time(image.time.time_since_epoch(), KernelClock::Monotonic) + milliseconds(1));
    EXPECT_GT(image.received, begin - seconds(1));
    EXPECT_LT(image.received, end);
    EXPECT_TRUE(i == 0 || image.received > got.images[i - 1].received);
  }
}

TEST_F(V4l2OfKernel, StampsOfTheExposuresStartAreNoArrival) {
  set("timestamp_source", "1");
  Camera camera(config_of());
  ASSERT_TRUE(camera.source.open().ok());
  const Received got = camera.receive(10);
  set("timestamp_source", "0");
  ASSERT_EQ(got.images.size(), 10u);
  for (std::size_t i = 0; i < got.images.size(); ++i) {
    const auto header = decode_v4l2_header(got.packets[i].bytes.bytes());
    ASSERT_TRUE(header.ok());
    EXPECT_TRUE(header->is_exposure_start());
    EXPECT_GT(got.images[i].received, to_host_time(header->stamp, KernelClock::Monotonic));
  }
}

TEST_F(V4l2OfKernel, AWrongStampIsToldAndNotUsed) {
  set("wrap_timestamp", "32 Bit");
  Camera camera(config_of());
  ASSERT_TRUE(camera.source.open().ok());
  const Received got = camera.receive(5);
  set("wrap_timestamp", "None");
  ASSERT_EQ(got.images.size(), 5u);
  EXPECT_EQ(got.count(FaultKind::ClockStep), 5u);
  for (const Image& image : got.images) EXPECT_LT(host_now() - image.received, seconds(20));
}

TEST_F(V4l2OfKernel, DroppedImagesAreLostOnesInTheCount) {
  Camera camera(config_of());
  ASSERT_TRUE(camera.source.open().ok());
  set("percentage_of_dropped_buffers", "30");
  std::uint64_t first = 0, last = 0, lost = 0;
  for (int i = 0; i < 3; ++i) {
    const Received got = camera.receive(20);
    ASSERT_EQ(got.images.size(), 20u);
    EXPECT_EQ(got.count(FaultKind::Overflow), 0u);
    if (i == 0) first = got.images.front().frame_id;
    last = got.images.back().frame_id;
    lost += got.count(FaultKind::Lost);
  }
  set("percentage_of_dropped_buffers", "0");
  EXPECT_GT(lost, 8u);
  EXPECT_EQ(last - first + 1, 60 + lost);
}

TEST_F(V4l2OfKernel, AnImageThatTheDriverFlagsIsTold) {
  Camera camera(config_of());
  ASSERT_TRUE(camera.source.open().ok());
  ASSERT_EQ(camera.receive(2).images.size(), 2u);
  set("inject_v4l2_buf_flag_error", "1");
  const Received got = camera.receive(40);
  EXPECT_EQ(std::ranges::count(got.images, false, &Image::is_complete), 1);
  EXPECT_THAT(got.details, testing::Contains(HasSubstr("is damaged, as its driver says")));
}

TEST_F(V4l2OfKernel, AStreamThatTheDriverEndsIsOpenedAgain) {
  Camera camera(config_of());
  ASSERT_TRUE(camera.source.open().ok());
  ASSERT_EQ(camera.receive(2).images.size(), 2u);
  set("inject_fatal_streaming_error", "1");
  const Received got = camera.receive(1000, seconds(5));
  ASSERT_TRUE(got.end.has_value());
  EXPECT_EQ(got.end->code, ErrorCode::Disconnected) << got.end->message;
  const Status again = camera.source.open();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(camera.receive(2).images.size(), 2u);
}

TEST_F(V4l2OfKernel, HeldImagesStayAsTheyAreAndThenTheLossIsTold) {
  V4l2Config config = config_of();
  config.images_in_flight = 6;
  Camera camera(config);
  ASSERT_TRUE(camera.source.open().ok());
  // Six in the driver's memory, six in copies; then none fits.
  Received held = camera.receive(12);
  ASSERT_EQ(held.packets.size(), 12u);
  std::vector<std::uint64_t> sums;
  for (const Packet& packet : held.packets) sums.push_back(sum_of(packet.bytes));
  const Received beyond = camera.receive(1, milliseconds(500));
  EXPECT_EQ(beyond.images.size(), 0u);
  EXPECT_GT(beyond.count(FaultKind::Overflow), 2u);
  for (std::size_t i = 0; i < sums.size(); ++i) EXPECT_EQ(sum_of(held.packets[i].bytes), sums[i]) << i;
  held = {};
  for (int i = 0; i < 5; ++i) {
    const Received after = camera.receive(4);
    EXPECT_EQ(after.images.size(), 4u);
    EXPECT_EQ(after.count(FaultKind::Overflow), 0u);
  }
}

TEST_F(V4l2OfKernel, CopiesAndTheDriversMemoryGiveTheSamePackets) {
  for (const bool zero_copy : {true, false}) {
    V4l2Config config = config_of(kFirst, V4L2_PIX_FMT_SRGGB8);
    config.zero_copy = zero_copy;
    Camera camera(config);
    ASSERT_TRUE(camera.source.open().ok());
    const Received got = camera.receive(3);
    ASSERT_EQ(got.packets.size(), 3u);
    EXPECT_EQ(got.packets[2].bytes.size(), kV4l2HeaderSize + kWidth * kHeight);
    EXPECT_NEAR(colour_at(got.images[2], 20, 135)[1], 191, 6);
  }
}

TEST_F(V4l2OfKernel, UnpluggedAtAnyMomentItComesBack) {
  const int cycles = test::replugs(6);
  V4l2Config config = config_of();
  config.controls = {{"brightness", "77"}};
  Camera camera(config);
  std::vector<double> took_s;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    ASSERT_TRUE(camera.source.open().ok()) << cycle;
    const Received before = camera.receive(static_cast<std::size_t>(1 + cycle % 5));
    ASSERT_FALSE(before.packets.empty());
    const std::uint64_t sum = sum_of(before.packets[0].bytes);
    plug(false);
    const Received end = camera.receive(1000, seconds(5));
    ASSERT_TRUE(end.end.has_value()) << cycle;
    EXPECT_EQ(end.end->code, ErrorCode::Disconnected) << end.end->message;
    EXPECT_EQ(sum_of(before.packets[0].bytes), sum);  // what was received outlives the camera
    const Status absent = camera.source.open();
    ASSERT_FALSE(absent.ok());
    EXPECT_EQ(absent.error().code, ErrorCode::Unavailable) << absent.error().message;
    const HostTime back = host_now();
    plug(true);
    ASSERT_TRUE(camera.source.open().ok()) << cycle;
    camera.decoder.reset();
    ASSERT_EQ(camera.receive(1).images.size(), 1u);
    took_s.push_back(to_seconds(host_now() - back));
    const FileDescriptor fd(::open(path_of(kFirst).c_str(), O_RDWR | O_CLOEXEC));
    v4l2_control brightness{V4L2_CID_BRIGHTNESS, 0};
    ASSERT_EQ(v4l2_ioctl(fd.get(), VIDIOC_G_CTRL, &brightness), 0);
    EXPECT_EQ(brightness.value, 77);
  }
  test::print_returns("V4L2", took_s);
}

}  // namespace
}  // namespace hueline::drivers
