#include <gmock/gmock.h>

#include "tests/drivers/gige/emulated_camera.hpp"
#include "tests/drivers/gige/gige_reader.hpp"

#ifdef HUELINE_SANITIZE_THREAD
// GLib, GIO and Aravis are not built with ThreadSanitizer, which therefore cannot see their locks. What it reports
// between their own threads is suppressed, and so is the signal of a lost camera, which GObject's lock protects. The
// receiving thread is checked.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libglib-2.0.so\ncalled_from_lib:libgio-2.0.so\ncalled_from_lib:libgobject-2.0.so\n"
         "called_from_lib:libaravis-0.8.so\nrace:on_control_lost\n";
}
#endif

// AravisSource with Aravis's own fake GigE Vision camera: real sockets, real protocol.
namespace hueline::drivers {
namespace {

using test::FakeCamera;

TEST_F(Gige, ImagesArriveWholeInPlaceAndInOrder) {
  FakeCamera camera("127.0.0.1", "GV01");
  ASSERT_TRUE(camera.is_running());
  AravisSource::Config config = at_loopback();
  config.exposure = std::chrono::microseconds(2345);
  config.gain = 3;
  config.serial = "GV01";
  ASSERT_EQ(config.validate(), "");
  AravisSource source(config);
  const HostTime before = host_now();
  const Status opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  // Aravis enlarges the buffer of its socket at the first packet. On a busy computer the first images may have overrun
  // it before.
  read(source, seconds(5), images(3));
  const Catch caught = read(source, seconds(5), images(20));
  ASSERT_EQ(caught.images.size(), 20U);
  EXPECT_THAT(caught.faults, testing::IsEmpty());
  for (std::size_t i = 0; i < caught.images.size(); ++i) {
    const Image& image = caught.images[i];
    EXPECT_EQ(image.width, 320U);
    EXPECT_EQ(image.height, 240U);
    EXPECT_EQ(image.format, PixelFormat::BayerRG8);
    EXPECT_TRUE(image.is_complete);
    EXPECT_TRUE(is_as_painted(image)) << image.frame_id;
    EXPECT_EQ(image.buffer.data(), caught.packets[i].bytes.data());
    EXPECT_GT(image.received, before);
    EXPECT_LE(image.received, host_now());
    if (i == 0) continue;
    EXPECT_EQ(image.frame_id, caught.images[i - 1].frame_id + 1);
    EXPECT_GT(image.received, caught.images[i - 1].received);
    EXPECT_GT(image.time, caught.images[i - 1].time);
  }
  // 19 periods of 20 ms show that the rate was set. The upper limit is generous, for a loaded computer.
  const nanoseconds span = caught.images.back().time - caught.images.front().time;
  EXPECT_GT(span, milliseconds(340));
  EXPECT_EQ(camera.exposure_us(), 2345U);
  EXPECT_EQ(camera.gain(), 3U);
  EXPECT_GE(source.counts().complete_images, 20U);
}

TEST_F(Gige, WhatTheCameraReportsOfItsExposuresComesWithEachImage) {
  // The second type is that of GigE Vision 1.x. Packets that are lost on the way are sent again.
  for (const std::uint16_t type : {std::uint16_t{0x4001}, std::uint16_t{0x0005}}) {
    const test::EmulatedCamera camera(
        {.reports_exposure = true, .chunk_payload_type = type, .lost_packet_share = 0.02});
    ASSERT_EQ(camera.problem(), "");
    AravisSource::Config config = at_loopback();
    config.exposure = std::chrono::milliseconds(30);
    config.auto_exposure = true;
    ASSERT_EQ(config.validate(), "");
    AravisSource source(config);
    const Status opened = source.open();
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    const Catch caught = read(source, seconds(20), images(30));
    ASSERT_EQ(caught.images.size(), 30U) << type;
    for (const Image& image : caught.images) {
      if (!image.is_complete) continue;
      const std::int64_t stamp = image.time.time_since_epoch().count();
      EXPECT_TRUE(test::EmulatedCamera::is_as_painted(image));
      ASSERT_EQ(image.reported.size(), 1U) << type;
      EXPECT_EQ(image.reported[0].duration, nanoseconds(test::EmulatedCamera::exposure_of(stamp)));
      EXPECT_NEAR(image.reported[0].gain, test::EmulatedCamera::gain_of(stamp), 0.002);
    }
    EXPECT_GT(std::ranges::count_if(caught.images, &Image::is_complete), 20) << type;
  }
}

TEST_F(Gige, ReportsAreLeftAloneIfTheRigSaysSo) {
  const test::EmulatedCamera camera({.reports_exposure = true});
  ASSERT_EQ(camera.problem(), "");
  AravisSource::Config config = at_loopback();
  config.chunks = false;
  AravisSource source(config);
  ASSERT_TRUE(source.open().ok());
  const Catch caught = read(source, seconds(20), images(5));
  ASSERT_EQ(caught.images.size(), 5U);
  for (const Image& image : caught.images) EXPECT_THAT(image.reported, testing::IsEmpty());
}

TEST_F(Gige, AutomaticExposureThatTheCameraDoesNotReportIsRefused) {
  const test::EmulatedCamera camera({});
  ASSERT_EQ(camera.problem(), "");
  AravisSource::Config config = at_loopback();
  config.auto_exposure = true;
  config.chunks = false;
  EXPECT_EQ(config.validate().key, "auto_exposure");
  config.chunks = true;
  AravisSource source(config);
  const auto refused = source.open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::Invalid);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("does not report its exposures"));
}

TEST_F(Gige, AnotherCameraOrAnImpossibleSettingIsRefused) {
  FakeCamera camera("127.0.0.1", "GV01");
  auto config = at_loopback();
  config.serial = "GV02";
  AravisSource other(config);
  const auto refused = other.open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::Invalid);
  EXPECT_THAT(refused.error().message, testing::AllOf(testing::HasSubstr("GV01"), testing::HasSubstr("GV02")));

  config = at_loopback();
  config.width = 60'000;  // beyond what its description allows
  AravisSource too_wide(config);
  const auto wide = too_wide.open();
  ASSERT_FALSE(wide.ok());
  EXPECT_EQ(wide.error().code, ErrorCode::Invalid) << wide.error().message;

  config = at_loopback();
  config.features = "NoSuchFeature=1";
  AravisSource featureless(config);
  const auto unknown = featureless.open();
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::Invalid) << unknown.error().message;
}

TEST_F(Gige, AbsentCameraIsUnavailable) {
  if (!has_own_network) GTEST_SKIP() << "another camera may be on the machine's loopback";
  GuestSource source(guest_of(at_loopback()));
  const auto opened = open(source);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::Unavailable) << opened.error().message;
}

TEST_F(Gige, SilentCameraTimesOut) {
  FakeCamera camera("127.0.0.1", "GV01");
  auto config = at_loopback();
  config.frame_rate_hz = 0;
  config.trigger_source = "Software";  // and nobody pulls it
  AravisSource source(config);
  const auto opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  for (int i = 0; i < 3; ++i) {
    const HostTime asked = host_now();
    const auto nothing = source.next({});
    ASSERT_FALSE(nothing.ok());
    EXPECT_EQ(nothing.error().code, ErrorCode::TimedOut);
    EXPECT_LT(host_now() - asked, milliseconds(500));
  }
}

TEST_F(Gige, ACameraThatCountsItsImagesAnewIsOpenedAgainWithinASecond) {
  test::EmulatedCamera camera({.rate_hz = 20, .restarts_at = 60});
  ASSERT_EQ(camera.problem(), "");
  AravisSource::Config config = at_loopback();
  config.frame_rate_hz = 0;
  AravisSource source(config);
  ASSERT_TRUE(source.open().ok());
  // Until it restarts, and then nothing until that is noticed.
  const Catch before = read(
      source, seconds(20), [](const Catch& c) { return c.ended.has_value(); }, false);
  EXPECT_EQ(before.ended, ErrorCode::Disconnected);
  ASSERT_GE(before.images.size(), 20U);
  const HostTime last = before.images.back().received;
  EXPECT_LT(host_now() - last, milliseconds(700));
  EXPECT_GE(before.faults.at(FaultKind::Lost), 1U);
  ASSERT_TRUE(source.open().ok());
  const Catch after = read(source, seconds(5), images(5));
  ASSERT_EQ(after.images.size(), 5U);
  EXPECT_LT(after.images.front().frame_id, 60U);
  EXPECT_LT(after.images.front().received - last, seconds(1));
  for (const Image& image : after.images) EXPECT_TRUE(test::EmulatedCamera::is_as_painted(image)) << image.frame_id;
}

TEST_F(Gige, LostPacketsGiveFlaggedImagesAndACountedFault) {
  FakeCamera camera("127.0.0.1", "GV01");
  camera.lose(0.005);  // of 55 packets an image: every fourth image is hit
  auto config = at_loopback();
  config.packet_size = 1500;
  config.images_in_flight = 300;
  AravisSource source(config);
  ASSERT_TRUE(source.open().ok());
  const Catch caught =
      read(source, seconds(4), [](const Catch& c) { return c.images.size() > 40 && c.faults.count(FaultKind::Lost); });
  const auto incomplete = std::ranges::count_if(caught.images, [](const Image& i) { return !i.is_complete; });
  EXPECT_GT(incomplete, 0);
  for (const Image& image : caught.images) {
    if (image.is_complete) {
      EXPECT_TRUE(is_as_painted(image)) << image.frame_id;
    } else {
      EXPECT_GT(image.missing_packets, 0U);
    }
  }
  EXPECT_GE(caught.faults.count(FaultKind::Lost), 1U);
  EXPECT_GT(source.counts().incomplete_images, 0U);
  EXPECT_GT(source.counts().missing_packets, 0U);
}

TEST_F(Gige, HeldImagesExhaustThePoolAndThatIsSaid) {
  FakeCamera camera("127.0.0.1", "GV01");
  auto config = at_loopback();
  config.stream_buffers = 2;
  config.images_in_flight = 3;
  AravisSource source(config);
  ASSERT_TRUE(source.open().ok());
  Catch hoarded = read(source, seconds(5), [](const Catch& c) { return c.faults.count(FaultKind::Overflow) != 0; });
  EXPECT_LE(hoarded.images.size(), 5U);
  EXPECT_GE(hoarded.images.size(), 3U);
  EXPECT_GT(hoarded.faults[FaultKind::Overflow], 0U);
  for (const Image& image : hoarded.images) EXPECT_TRUE(!image.is_complete || is_as_painted(image));
  hoarded = {};
  EXPECT_EQ(read(source, seconds(5), images(10), false).images.size(), 10U);
}

TEST_F(Gige, KilledCameraIsDisconnectedAndItsSuccessorOpens) {
  auto camera = std::make_optional<FakeCamera>("127.0.0.1", "GV01");
  GuestSource source(guest_of(at_loopback()));
  ASSERT_TRUE(open(source).ok());
  EXPECT_EQ(read(source, seconds(5), images(5)).images.size(), 5U);
  camera.reset();
  const HostTime killed = host_now();
  const Catch rest = read(source, seconds(20), [](const Catch&) { return false; });
  EXPECT_EQ(rest.ended, ErrorCode::Disconnected);
  // A heartbeat each second, then 5 s of retries, the last of which waits 3 s.
  EXPECT_LT(host_now() - killed, seconds(12));
  GTEST_LOG_(INFO) << "disconnected after " << to_seconds(host_now() - killed) << " s";
  camera.emplace("127.0.0.1", "GV01");
  const auto reopened = open(source);
  ASSERT_TRUE(reopened.ok()) << reopened.error().message;
  EXPECT_EQ(read(source, seconds(5), images(5)).images.size(), 5U);
}

TEST(GigeConfig, SaysWhichKeyIsWrong) {
  AravisSource::Config config;
  EXPECT_THAT(config.validate(), testing::HasSubstr("serial"));
  config.serial = "1234";
  EXPECT_EQ(config.validate(), "");
  config.frame_rate_hz = 5;
  config.trigger_source = "Line0";
  EXPECT_THAT(config.validate(), testing::HasSubstr("trigger_source"));
  config.frame_rate_hz = 0;
  config.packet_size = 100;
  EXPECT_THAT(config.validate(), testing::AllOf(testing::HasSubstr("packet_size"), testing::HasSubstr("16000")));
  config.packet_size = 0;
  config.interface = "eth0";
  config.address = "10.0.0.2";
  EXPECT_THAT(config.validate(), testing::HasSubstr("interface"));
}

}  // namespace
}  // namespace hueline::drivers
