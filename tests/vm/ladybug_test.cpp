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

#include "drivers/guest/guest_source.hpp"
#include "drivers/ladybug/ladybug_decoder.hpp"
#include "drivers/ladybug/ladybug_settings.hpp"
#include "drivers/transport/host_clock.hpp"
#include "tests/support/replugs.hpp"
#include "tests/vm/guest_opening.hpp"
#include "tests/vm/ladybug_on_usb.hpp"

// The driver of a Ladybug on the kernel's USB: runs in the guest of tests/vm (usb.sh). The camera is emulated and is
// plugged into the kernel's virtual host controller; from usbfs on, everything is real.
namespace hueline::drivers {
namespace {

using sim::LadybugFault;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::LadybugOnUsb;
using testing::HasSubstr;
namespace reg = sim::ladybug_register;

LadybugSettings settings() {
  LadybugSettings out;
  out.frame_rate_hz = 10;
  out.exposure = std::chrono::microseconds(2500);
  out.gain_dB = 6;
  out.jpeg_quality = 77;
  out.buffer_width = 512;
  out.buffer_height = 300;
  out.strobe_pin = 0;
  return out;
}

struct Received {
  std::vector<std::uint32_t> images;  // their sequence numbers
  std::uint64_t whole = 0;            // with the bytes that the camera sent, all planes decoded
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
  LadybugDecoder decoder;

  explicit Driver(const LadybugSettings& config)
      : source(test::patient_guest("ladybug", config.to_text(), config.images_in_flight)), decoder(decoder_of()) {}
  static LadybugDecoder::Config decoder_of() {
    LadybugDecoder::Config out{.width = LadybugOnUsb::kWidth, .height = LadybugOnUsb::kHeight};
    out.planes.lens_columns = 3;
    return out;
  }
  Status open() { return test::open(source); }
  Status open_within(nanoseconds limit) { return test::open_within(source, limit); }
  Received receive(const LadybugOnUsb& camera, std::size_t images, nanoseconds limit = seconds(20)) {
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
      for (const auto& m : out) {
        if (const auto* image = std::get_if<Image>(&m)) {
          const auto number = static_cast<std::uint32_t>(image->frame_id);
          const bool is_whole = image->is_complete && std::ranges::equal(packet->bytes.bytes(), camera.image(number));
          EXPECT_TRUE(is_whole) << number;
          all.whole += is_whole;
          all.images.push_back(number);
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

void expect_set(const LadybugOnUsb& camera) {
  EXPECT_NEAR(camera.camera().get_float(reg::kShutter_s), 0.0025, 1e-8);
  EXPECT_NEAR(camera.camera().get_float(reg::kGain_dB), 6, 1e-6);
  EXPECT_NEAR(camera.camera().get_float(reg::kFrameRate_Hz), 10, 1e-6);
  EXPECT_EQ(camera.camera().get(reg::kJpeg), 0x82000000u | 77u);
  EXPECT_EQ(camera.camera().get(reg::kStrobe0), 0x83000000u);
}

TEST(LadybugUsb, ImagesAreThoseThatTheCameraSentWhetherItFillsItsBufferOrNot) {
  for (const bool whole_buffer : {true, false})
    for (const std::uint32_t height : {300u, 301u}) {
      sim::LadybugCamera::Config config;
      config.sends_whole_buffer = whole_buffer;
      LadybugOnUsb camera(config);
      ASSERT_TRUE(camera.plug().ok());
      LadybugSettings set = settings();
      set.buffer_width = height == 301 ? 509 : 512;
      set.buffer_height = height;
      Driver driver(set);
      const Status opened = driver.open_within(seconds(30));
      ASSERT_TRUE(opened.ok()) << opened.error().message;
      const Received got = driver.receive(camera, 15);
      ASSERT_EQ(got.images.size(), 15u) << testing::PrintToString(got.details);
      EXPECT_EQ(got.whole, 15u);
      EXPECT_EQ(got.count(FaultKind::Malformed), 0u) << testing::PrintToString(got.details);
      EXPECT_EQ(got.count(FaultKind::Lost), got.images.back() - got.images.front() - 14u);
      EXPECT_LE(got.count(FaultKind::Lost), camera.late());
      expect_set(camera);
    }
}

TEST(LadybugUsb, ASpoiledImageIsToldAndThoseAroundItAreWhole) {
  LadybugOnUsb camera;
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const auto spoil = [&](const char* name, std::uint64_t lost, const char* detail, auto&& how) {
    ASSERT_EQ(driver.receive(camera, 2).images.size(), 2u) << name;
    const std::uint64_t late = camera.late();
    how();
    const Received got = driver.receive(camera, 12);
    ASSERT_EQ(got.images.size(), 12u) << name << testing::PrintToString(got.details);
    EXPECT_EQ(got.whole, 12u) << name;
    EXPECT_GE(got.count(FaultKind::Lost), lost) << name;
    EXPECT_LE(got.count(FaultKind::Lost), lost + camera.late() - late) << testing::PrintToString(got.details);
    EXPECT_THAT(testing::PrintToString(got.details), HasSubstr(detail)) << name;
    EXPECT_FALSE(got.end.has_value()) << name;
  };
  spoil("five images are skipped", 5, "images lost between", [&] { camera.skip(5); });
  spoil("half an image", 1, "the camera ended it before", [&] { camera.spoil(LadybugFault::Short); });
  spoil("no image", 1, "bytes on USB are no image", [&] { camera.spoil(LadybugFault::Strange); });
  spoil("a halt", 1, "the camera halted its endpoint on USB", [&] { camera.spoil(LadybugFault::Stall); });
}

TEST(LadybugUsb, WhatIsWrongIsSaidWithWhatToDo) {
  const auto why = [](const LadybugSettings& set) {
    Driver driver(set);
    const Status opened = driver.open();
    return opened.ok() ? std::string("opened") : opened.error().message;
  };
  EXPECT_THAT(why(settings()), HasSubstr("no Ladybug is on USB (maker 1e10); is it plugged in"));
  LadybugOnUsb first, second({.serial = 7});
  ASSERT_TRUE(first.plug().ok());
  ASSERT_TRUE(second.plug().ok());
  LadybugSettings set = settings();
  Driver seventh([&] {
    set.serial = 7;
    return set;
  }());
  const Status opened = seventh.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ(seventh.receive(second, 3).whole, 3u);
  EXPECT_THAT(why(set), HasSubstr("another program uses it")) << "the wanted one";
  seventh.source.close();
  set.serial = 0;
  EXPECT_THAT(why(set), HasSubstr("several are on USB: name one of the serial numbers"));
  set.serial = 8;
  EXPECT_THAT(why(set), HasSubstr("none on USB has the serial number 8; there are "));
  set.serial = 7;
  set.frame_rate_hz = 100;
  EXPECT_THAT(why(set), HasSubstr("frame_rate_hz is 100; this camera allows 1 to 30"));
  set.frame_rate_hz = 10;
  set.transfer_MB = 200;
  EXPECT_THAT(why(set), HasSubstr("have 16 MB for their transfers"));
}

TEST(LadybugUsb, ACameraThatFallsSilentIsOpenedAgain) {
  LadybugOnUsb camera;
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  const Status opened = driver.open_within(seconds(30));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  ASSERT_EQ(driver.receive(camera, 2).images.size(), 2u);
  camera.pause(true);
  const Received end = driver.receive(camera, 1000, seconds(10));
  ASSERT_TRUE(end.end.has_value());
  EXPECT_THAT(end.end->message, HasSubstr("nothing came for"));
  camera.pause(false);
  const Status again = driver.open_within(seconds(30));
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(driver.receive(camera, 5).whole, 5u);
}

TEST(LadybugUsb, UnpluggedAtAnyMomentItComesBack) {
  const int cycles = test::replugs(3);
  LadybugOnUsb camera;
  ASSERT_TRUE(camera.plug().ok());
  Driver driver(settings());
  std::vector<double> took_s;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    const HostTime back = host_now();
    const Status opened = driver.open_within(seconds(30));
    ASSERT_TRUE(opened.ok()) << cycle << ": " << opened.error().message;
    driver.decoder.reset();
    const auto images = static_cast<std::size_t>(1 + cycle % 5);
    const Received before = driver.receive(camera, images);
    ASSERT_EQ(before.whole, images) << cycle;
    if (cycle > 0) took_s.push_back(to_seconds(host_now() - back) - 0.1 * static_cast<double>(images - 1));
    expect_set(camera);
    if (cycle % 2 == 0)
      camera.spoil(LadybugFault::Unplug);  // in the middle of an image
    else
      camera.unplug();
    const HostTime gone = host_now();
    const Received end = driver.receive(camera, 1000, seconds(5));
    ASSERT_TRUE(end.end.has_value()) << cycle;
    EXPECT_EQ(end.end->code, ErrorCode::Disconnected) << end.end->message;
    EXPECT_LT(to_seconds(host_now() - gone), 1.0) << cycle;
    const Status absent = driver.open();
    ASSERT_FALSE(absent.ok());
    EXPECT_EQ(absent.error().code, ErrorCode::Unavailable) << absent.error().message;
    ASSERT_TRUE(camera.plug().ok());
  }
  test::print_returns("Ladybug", took_s);
}

}  // namespace
}  // namespace hueline::drivers
