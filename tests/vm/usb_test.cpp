#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/gige/genicam_config.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/guest/guest_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "tests/support/replugs.hpp"
#include "tests/vm/guest_opening.hpp"
#include "tests/vm/usb_camera.hpp"

// The driver of USB3 Vision cameras on the kernel's USB: runs in the guest of tests/vm (usb.sh). The camera is emulated
// and is plugged into the kernel's virtual host controller; from usbfs on, everything is real.
namespace hueline::drivers {
namespace {

using sim::U3vFault;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::UsbCamera;
using testing::HasSubstr;
namespace reg = sim::camera_register;

constexpr std::uint32_t kWidth = 320, kHeight = 240;

sim::U3vCamera::Config camera_config() {
  sim::U3vCamera::Config config;
  config.width = kWidth;
  config.height = kHeight;
  return config;
}

GenicamConfig settings() {
  GenicamConfig config;
  config.serial = "HL02";
  config.width = kWidth;
  config.height = kHeight;
  config.pixel_format = PixelFormat::BayerRG8;
  config.frame_rate_hz = 10;
  config.exposure = std::chrono::microseconds(2500);
  return config;
}

/// Everything that comes in a time, decoded. The pixels are compared as they come and are not kept.
struct Received {
  std::vector<Image> images;
  std::uint64_t whole = 0;  // complete images with the pixels that the camera painted
  std::map<FaultKind, std::uint64_t> faults;
  std::vector<std::string> details;
  std::optional<Error> end;

  std::uint64_t count(FaultKind kind) const {
    const auto found = faults.find(kind);
    return found == faults.end() ? 0 : found->second;
  }
};

/// The driver as a drive uses it: the guest process, and the decoder.
struct Driver {
  GuestSource source;
  ImageDecoder decoder{{.width = kWidth, .height = kHeight, .pixel_format = PixelFormat::BayerRG8}};

  explicit Driver(const GenicamConfig& config)
      : source(test::patient_guest("genicam", config.to_text(), config.stream_buffers + config.images_in_flight)) {}
  Status open() { return test::open(source); }
  Status open_within(nanoseconds limit) { return test::open_within(source, limit); }
  Received receive(std::size_t images, nanoseconds limit = seconds(20)) {
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
        if (auto* image = std::get_if<Image>(&m)) {
          const bool is_whole = image->is_complete && UsbCamera::is_as_painted(*image);
          EXPECT_EQ(is_whole, image->is_complete) << "image " << image->frame_id << " has other pixels";
          all.whole += is_whole;
          image->buffer = {};
          all.images.push_back(std::move(*image));
        }
        if (const auto* fault = std::get_if<Fault>(&m)) {
          all.faults[fault->kind] += fault->count;
          all.details.push_back(std::string(name(fault->kind)) + ": " + fault->detail);
        }
      }
    }
    return all;
  }
};

TEST(Usb3Vision, WhatTheCameraReportsOfItsExposuresComesWithEachImage) {
  sim::U3vCamera::Config reporting = camera_config();
  reporting.reports_exposure = true;
  UsbCamera camera(reporting);
  ASSERT_TRUE(camera.plug().ok());
  GenicamConfig config = settings();
  config.auto_exposure = true;
  Driver driver(config);
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const Received got = driver.receive(20);
  ASSERT_EQ(got.whole, 20u) << testing::PrintToString(got.details);
  for (const Image& image : got.images) {
    ASSERT_EQ(image.reported.size(), 1u);
    EXPECT_EQ(image.reported[0].duration, nanoseconds(UsbCamera::exposure_of(image.time.time_since_epoch().count())));
    EXPECT_NEAR(image.reported[0].gain, 2, 0.002);
  }
  EXPECT_EQ(camera.feature(reg::kExposureAuto), 2u);
  EXPECT_EQ(camera.feature(reg::kExposureLimitUs), 2500u);
}

std::int64_t stamp_of(const Image& image) { return image.time.time_since_epoch().count(); }

TEST(Usb3Vision, ImagesAndStampsAreThoseThatTheCameraSent) {
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const Received got = driver.receive(20);
  ASSERT_EQ(got.images.size(), 20u) << testing::PrintToString(got.details);
  for (std::size_t i = 0; i < got.images.size(); ++i) {
    const Image& image = got.images[i];
    EXPECT_EQ(image.format, PixelFormat::BayerRG8);
    if (i == 0) continue;
    const Image& before = got.images[i - 1];
    const std::uint64_t steps = image.frame_id - before.frame_id;
    EXPECT_EQ(stamp_of(image) - stamp_of(before), UsbCamera::stamp_of(steps));
    EXPECT_GT(image.received, before.received);
  }
  EXPECT_EQ(got.whole, 20u);
  EXPECT_EQ(got.count(FaultKind::Lost), got.images.back().frame_id - got.images.front().frame_id - 19);
}

TEST(Usb3Vision, ASpoiledImageIsToldAndThoseAroundItAreWhole) {
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const auto spoil = [&](const char* name, std::uint64_t lost, auto&& how) {
    ASSERT_EQ(driver.receive(2).images.size(), 2u) << name;
    const std::uint64_t late = camera.late();
    how();
    // The source tells of losses once a second.
    const Received got = driver.receive(25);
    ASSERT_EQ(got.images.size(), 25u) << name << testing::PrintToString(got.details)
                                      << (got.end ? got.end->message : "");
    EXPECT_GE(got.whole, 24u) << name;
    EXPECT_GE(got.count(FaultKind::Lost), lost) << name;
    EXPECT_LE(got.count(FaultKind::Lost), lost + 2 + camera.late() - late) << testing::PrintToString(got.details);
    EXPECT_FALSE(got.end.has_value());
  };
  spoil("five images are skipped", 5, [&] { camera.skip(5); });
  spoil("no leader", 1, [&] { camera.spoil(U3vFault::NoLeader); });
  spoil("no trailer", 1, [&] { camera.spoil(U3vFault::NoTrailer); });
  spoil("half of the pixels", 1, [&] { camera.spoil(U3vFault::ShortPayload); });
}

TEST(Usb3Vision, AHaltIsClearedAndTheStreamGoesOn) {
  auto slow = camera_config();
  slow.start_takes_ms = 600;  // it says so, and the driver waits
  UsbCamera camera(slow);
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  for (int halt = 0; halt < 3; ++halt) {
    ASSERT_EQ(driver.receive(2).images.size(), 2u);
    camera.spoil(U3vFault::Stall);
    const Received got = driver.receive(10);
    EXPECT_FALSE(got.end.has_value()) << got.end->message;
    ASSERT_EQ(got.images.size(), 10u) << testing::PrintToString(got.details);
    EXPECT_GE(got.whole, 9u);
    EXPECT_GE(got.count(FaultKind::Lost), 1u);
    EXPECT_THAT(got.details, testing::Contains(HasSubstr("the camera halted its endpoint on USB")));
  }
}

TEST(Usb3Vision, ACameraThatSendsNoImageIsOpenedAgain) {
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  ASSERT_EQ(driver.receive(2).images.size(), 2u);
  camera.pause(true);
  const Received end = driver.receive(1000, seconds(10));
  ASSERT_TRUE(end.end.has_value()) << testing::PrintToString(end.details);
  EXPECT_EQ(end.end->code, ErrorCode::Disconnected);
  EXPECT_THAT(end.end->message, HasSubstr("its stream on USB has failed"));
  EXPECT_THAT(end.end->message, HasSubstr("have 16 MB for their transfers"));
  camera.pause(false);
  const Status again = driver.open_within(seconds(30));
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(driver.receive(5).images.size(), 5u);
}

TEST(Usb3Vision, TooLittleMemoryForTransfersIsToldWithWhatRaisesIt) {
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  GenicamConfig config = settings();
  config.transfer_MB = 100;
  Driver driver(config);
  const Status opened = driver.open();
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message, HasSubstr("usbfs_memory_mb"));
}

TEST(Usb3Vision, TheNameThatAravisListsAndTheSerialNumberFindTheCamera) {
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  GenicamConfig config = settings();
  config.serial.clear();
  const std::string guid = sim::u3v_guid(camera_config().serial);
  for (const std::string& id : {"hueline-" + guid + "-HL02", guid, std::string("hueline-Emulated-HL02")}) {
    config.id = id;
    Driver named(config);
    const Status opened = named.open_within(seconds(30));
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    EXPECT_EQ(named.receive(3).images.size(), 3u) << id;
  }
  config.id.clear();
  config.serial = "HL03";
  Driver absent(config);
  const Status other = absent.open();
  ASSERT_FALSE(other.ok());
  EXPECT_THAT(other.error().message, HasSubstr("no camera with serial number HL03"));
}

TEST(Usb3Vision, WhatTheCameraRefusesIsNamed) {
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  GenicamConfig config = settings();
  config.features = "NoSuchFeature=1";
  Driver driver(config);
  const Status opened = driver.open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Invalid);
  EXPECT_THAT(opened.error().message, HasSubstr("NoSuchFeature"));
}

TEST(Usb3Vision, UnpluggedAtAnyMomentItComesBack) {
  const int cycles = test::replugs(3);
  UsbCamera camera(camera_config());
  ASSERT_TRUE(camera.plug().ok());
  GenicamConfig config = settings();
  config.gain = 7;
  Driver driver(config);
  std::vector<double> took_s;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    const HostTime back = host_now();
    const Status opened = driver.open_within(seconds(30));
    ASSERT_TRUE(opened.ok()) << cycle << ": " << opened.error().message;
    driver.decoder.reset();
    const Received before = driver.receive(static_cast<std::size_t>(1 + cycle % 5));
    ASSERT_EQ(before.images.size(), static_cast<std::size_t>(1 + cycle % 5)) << cycle;
    if (cycle > 0) took_s.push_back(to_seconds(before.images[0].received - back));
    EXPECT_EQ(camera.feature(reg::kGain), 7u);
    EXPECT_EQ(camera.feature(reg::kExposureUs), 2500u);
    EXPECT_EQ(camera.feature(reg::kFrameRateMilliHz), 10'000u);
    if (cycle % 2 == 0)
      camera.spoil(U3vFault::Unplug);  // in the middle of an image
    else
      camera.unplug();
    const HostTime gone = host_now();
    const Received end = driver.receive(1000, seconds(5));
    ASSERT_TRUE(end.end.has_value()) << cycle;
    EXPECT_EQ(end.end->code, ErrorCode::Disconnected) << end.end->message;
    EXPECT_LT(to_seconds(host_now() - gone), 1.0) << cycle;
    const Status absent = driver.open();
    ASSERT_FALSE(absent.ok());
    EXPECT_EQ(absent.error().code, ErrorCode::Unavailable) << absent.error().message;
    ASSERT_TRUE(camera.plug().ok());
  }
  test::print_returns("USB3 Vision", took_s);
}

}  // namespace
}  // namespace hueline::drivers
