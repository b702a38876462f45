#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ladybug/ladybug_assembler.hpp"
#include "drivers/ladybug/ladybug_registers.hpp"
#include "drivers/ladybug/ladybug_settings.hpp"
#include "sim/devices/ladybug_registers.hpp"
#include "tests/drivers/ladybug/ladybug_stream.hpp"

// What of a Ladybug on USB needs no USB: the images in the bytes of its endpoint, and its registers. tests/vm/usb_test
// has the rest.
namespace hueline::drivers {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
namespace reg = sim::ladybug_register;

constexpr std::size_t kPacket = 1024;

using test::Bytes;
using test::image_of;
using test::Memory;
using test::pop_all;
using test::Told;

void append(Bytes& to, const Bytes& more) { to.insert(to.end(), more.begin(), more.end()); }

std::vector<std::string> words(const std::vector<Fault>& faults) {
  std::vector<std::string> out;
  for (const Fault& fault : faults)
    out.push_back(std::string(name(fault.kind)) + " " + std::to_string(fault.count) + ": " + fault.detail);
  return out;
}
/// Gives a stream in transfers of a size; the last one is short.
void give(LadybugAssembler& assembler, const Bytes& stream, std::size_t transfer) {
  for (std::size_t at = 0; at < stream.size(); at += transfer) {
    const std::size_t size = std::min(transfer, stream.size() - at);
    assembler.take(std::span(stream).subspan(at, size), size < transfer, host_time_ns(static_cast<std::int64_t>(at)));
  }
}

TEST(LadybugAssembler, FindsTheImagesWhateverTheSizesOfTransfersAndOfTheCamerasBuffer) {
  const std::vector<Bytes> images{image_of(1, 5000), image_of(2, 1024), image_of(3, 8192), image_of(4, 3000)};
  for (const std::size_t transfer : {kPacket, 4 * kPacket, 9 * kPacket, 64 * kPacket})
    for (const std::size_t buffer : {std::size_t{0}, 8 * kPacket, 9 * kPacket}) {
      Memory memory(1 << 20);
      LadybugAssembler assembler(kPacket, 9 * kPacket, memory);
      Bytes stream;
      for (const Bytes& image : images) {
        append(stream, image);
        // To the end of the packet, or of the camera's buffer.
        stream.resize(stream.size() + (buffer ? buffer - image.size() : (kPacket - image.size() % kPacket) % kPacket));
      }
      give(assembler, stream, transfer);
      const Told told = pop_all(assembler);
      EXPECT_EQ(told.images, images) << transfer << " " << buffer;
      EXPECT_THAT(words(told.faults), ElementsAre()) << transfer << " " << buffer;
      EXPECT_EQ(memory.bytes_in_use(), 0u);
    }
}

TEST(LadybugAssembler, AnImageEndsWithAShortPacketAndTheNextBeginsBehindIt) {
  Memory memory(1 << 20);
  LadybugAssembler assembler(kPacket, 9 * kPacket, memory);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Bytes image = image_of(i, 5000 + i);
    assembler.take(image, true, host_time_ns(i));
  }
  assembler.take({}, true, host_time_ns(9));  // an empty packet
  const Told told = pop_all(assembler);
  EXPECT_THAT(told.images, ElementsAre(image_of(0, 5000), image_of(1, 5001), image_of(2, 5002)));
  EXPECT_THAT(words(told.faults), ElementsAre());
}

TEST(LadybugAssembler, TellsWhatIsNoImageAndGoesOnWithTheNext) {
  Memory memory(1 << 20);
  LadybugAssembler assembler(kPacket, 9 * kPacket, memory);
  Bytes stream(3 * kPacket, std::byte{7});
  append(stream, image_of(1, 4 * kPacket));
  append(stream, image_of(2, 4 * kPacket));
  assembler.take(stream, false, host_time_ns(1));
  // The second half of the third is lost.
  const Bytes third = image_of(3, 4 * kPacket);
  assembler.take(std::span(third).first(2 * kPacket), false, host_time_ns(2));
  assembler.interrupt("the camera halted", host_time_ns(3));
  assembler.take(std::span(third).last(kPacket), false, host_time_ns(4));
  assembler.take(image_of(4, 2 * kPacket), false, host_time_ns(5));
  // The fifth is ended too early, and what comes then is larger than an image can be.
  assembler.interrupt("a transfer failed", host_time_ns(5));
  assembler.take(std::span(third).first(kPacket + 5), true, host_time_ns(6));
  assembler.take(image_of(6, 10 * kPacket), true, host_time_ns(7));
  const Told told = pop_all(assembler);
  EXPECT_THAT(told.images, ElementsAre(image_of(1, 4 * kPacket), image_of(2, 4 * kPacket), image_of(4, 2 * kPacket)));
  EXPECT_THAT(
      words(told.faults),
      ElementsAre("Malformed 3072: 3072 bytes on USB are no image",
                  "Malformed 2048: an image of 4096 bytes was broken off after 2048: the camera halted",
                  "Malformed 1024: 1024 bytes on USB are no image", "Malformed 1: a transfer failed: bytes are missing",
                  "Malformed 1029: an image of 4096 bytes was broken off after 1029: the camera ended it before",
                  "Malformed 10240: 10240 bytes on USB are no image"));
  EXPECT_EQ(memory.bytes_in_use(), 0u);
}

TEST(LadybugAssembler, WhatComesBehindTheCamerasBufferIsNoPadding) {
  Memory memory(1 << 20);
  LadybugAssembler assembler(kPacket, 4 * kPacket, memory);
  Bytes stream = image_of(1, kPacket + 100);
  stream.resize(7 * kPacket);
  append(stream, image_of(2, 4 * kPacket));
  give(assembler, stream, 2 * kPacket);
  const Told told = pop_all(assembler);
  EXPECT_THAT(told.images, ElementsAre(image_of(1, kPacket + 100), image_of(2, 4 * kPacket)));
  EXPECT_THAT(words(told.faults), ElementsAre("Malformed 3072: 3072 bytes on USB are no image"));
}

TEST(LadybugAssembler, AnImageWithoutMemoryIsCountedAndTheNextIsWhole) {
  Memory memory(8 * kPacket);
  LadybugAssembler assembler(kPacket, 9 * kPacket, memory);
  assembler.take(image_of(1, 8 * kPacket), false, host_time_ns(1));
  assembler.take(image_of(2, 8 * kPacket), false, host_time_ns(2));
  const Told told = pop_all(assembler);
  EXPECT_THAT(told.images, ElementsAre(image_of(1, 8 * kPacket)));
  ASSERT_EQ(told.faults.size(), 1u);
  EXPECT_THAT(words(told.faults)[0], HasSubstr("Overflow 1: an image found no free buffer"));
  assembler.take(image_of(3, 8 * kPacket), false, host_time_ns(3));
  EXPECT_THAT(pop_all(assembler).images, ElementsAre(image_of(3, 8 * kPacket)));
}

TEST(LadybugAssembler, EveryByteOfARandomStreamIsAnImagesOrPaddingOrCounted) {
  std::mt19937 random(5);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  for (int round = 0; round < 300; ++round) {
    Memory memory(1 << 20);
    LadybugAssembler assembler(kPacket, 9 * kPacket, memory);
    std::size_t sent = 0, counted = 0, interruptions = 1;
    const auto count = [&] {
      const Told told = pop_all(assembler);
      for (const Bytes& image : told.images) counted += image.size();
      for (const Fault& fault : told.faults) counted += fault.count;
    };
    for (int piece = 0; piece < 20; ++piece) {
      Bytes bytes = below(3) ? image_of(static_cast<std::uint32_t>(piece), kPacket * (1 + below(9)))
                             : Bytes(kPacket * (1 + below(4)), std::byte{1});
      if (below(4) == 0) bytes.resize(1 + below(bytes.size()));
      sent += bytes.size();
      assembler.take(bytes, bytes.size() % kPacket != 0 || below(3) == 0, host_time_ns(piece));
      if (below(8) == 0) assembler.interrupt("lost", host_time_ns(piece)), ++interruptions;
      count();
    }
    assembler.interrupt("the end", host_time_ns(99));
    count();
    // Only what follows an image is padding, which is not counted.
    EXPECT_LE(counted, sent + interruptions) << round;
    EXPECT_EQ(memory.bytes_in_use(), 0u);
  }
}

TEST(LadybugSettings, TextKeepsEachSetting) {
  LadybugSettings settings;
  settings.serial = 15'123'456;
  settings.exposure = std::chrono::microseconds(1500);
  settings.gain_dB = -1.5;
  settings.jpeg_quality = 80;
  settings.trigger_pin = 0;
  settings.trigger_edge = LadybugSettings::Edge::Falling;
  settings.strobe_pin = 1;
  settings.registers = "0x12F8=0x80000001";
  const auto read = LadybugSettings::from_text(settings.to_text());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->to_text(), settings.to_text());
  EXPECT_EQ(read->trigger_pin, 0u);
  EXPECT_EQ(read->strobe_pin, 1u);
  EXPECT_EQ(read->trigger_edge, LadybugSettings::Edge::Falling);
  EXPECT_EQ(read->exposure, std::chrono::microseconds(1500));
}

TEST(LadybugSettings, WhatCannotBeIsRefused) {
  const auto why = [](auto&& change) {
    LadybugSettings settings;
    change(settings);
    return std::string(settings.validate());
  };
  EXPECT_EQ(why([](auto&) {}), "");
  EXPECT_THAT(why([](auto& s) { s.trigger_pin = 0, s.frame_rate_hz = 10; }), HasSubstr("exclude each other"));
  EXPECT_THAT(why([](auto& s) { s.trigger_pin = 1, s.strobe_pin = 1; }), HasSubstr("allowed: another pin"));
  EXPECT_THAT(why([](auto& s) { s.buffer_width = 100; }), HasSubstr("go together"));
  for (const char* text : {"1E80=0x1", "0x1E80", "0x1E81=0x1", "0x1E80=0x1ffffffff", "0x1E80=x", "0x=0x1"})
    EXPECT_THAT(why([&](auto& s) { s.registers = text; }), HasSubstr("is no register and value")) << text;
}

/// The emulated registers without USB.
class Registers final : public RegisterAccess {
 public:
  Result<std::uint32_t> read(std::uint64_t address) override {
    EXPECT_EQ(address >> 32U, 0xFFFFu);
    const auto value = inside.read(static_cast<std::uint32_t>(address));
    if (!value) return Error{ErrorCode::Unsupported, "refused"};
    return *value;
  }
  Status write(std::uint64_t address, std::uint32_t value) override {
    if (!inside.write(static_cast<std::uint32_t>(address), value)) return Error{ErrorCode::Unsupported, "refused"};
    return {};
  }
  sim::LadybugRegisters inside{42};
};

TEST(LadybugSetUp, SetsEverythingAndSaysHowLargeAnImageIs) {
  Registers camera;
  LadybugSettings settings;
  settings.exposure = std::chrono::microseconds(1500);
  settings.gain_dB = 3;
  settings.frame_rate_hz = 7.5;
  settings.jpeg_quality = 70;
  settings.buffer_width = 512;
  settings.buffer_height = 301;
  settings.strobe_pin = 1;
  settings.strobe_duration = std::chrono::microseconds(1000);
  settings.registers = "0x830=0x80000000";
  const auto bytes = set_up(camera, settings);
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  // Whole packets of 9600 bytes.
  EXPECT_EQ(*bytes, (512u * 301u + 9599u) / 9600u * 9600u);
  EXPECT_NEAR(camera.inside.get_float(reg::kShutter_s), 0.0015, 1e-9);
  EXPECT_NEAR(camera.inside.get_float(reg::kGain_dB), 3.0, 1e-6);
  EXPECT_NEAR(camera.inside.get_float(reg::kFrameRate_Hz), 7.5, 1e-6);
  EXPECT_EQ(camera.inside.get(reg::kJpeg), 0x82000000u | 70u);
  EXPECT_EQ(camera.inside.get(reg::kStrobe0 + 4), 0x83000000u | 1024u);
  EXPECT_EQ(camera.inside.get(reg::kPinDirection), 0x40000000u);
  EXPECT_FALSE(camera.inside.is_streaming());
  ASSERT_TRUE(set_streaming(camera, true).ok());
  EXPECT_TRUE(camera.inside.is_streaming());
  ASSERT_TRUE(set_up(camera, {}).ok());
  EXPECT_FALSE(camera.inside.is_streaming());
  EXPECT_EQ(*read_serial(camera), 42u);
}

TEST(LadybugSetUp, ATriggerIsSetWithItsPinAndEdge) {
  Registers camera;
  LadybugSettings settings;
  settings.trigger_pin = 3;
  settings.trigger_edge = LadybugSettings::Edge::Falling;
  ASSERT_TRUE(set_up(camera, settings).ok());
  EXPECT_EQ(camera.inside.get(reg::kTrigger), 0x82000000u | 3u << 21U);
  settings = {};
  ASSERT_TRUE(set_up(camera, settings).ok());
  EXPECT_EQ(camera.inside.get(reg::kTrigger) & 0x02000000u, 0u) << "it runs freely again";
}

TEST(LadybugSetUp, ASettingThatTheCameraHasNotIsRefusedWithWhatItHas) {
  const auto why = [](auto&& change) {
    Registers camera;
    LadybugSettings settings;
    change(settings);
    const auto bytes = set_up(camera, settings);
    return bytes.ok() ? "" : bytes.error().message;
  };
  EXPECT_EQ(why([](auto&) {}), "");
  EXPECT_EQ(why([](auto& s) { s.video_mode = 3; }), "camera: video_mode is 3; this camera has 7");
  EXPECT_EQ(why([](auto& s) { s.frame_rate_hz = 60; }), "camera: frame_rate_hz is 60; this camera allows 1 to 30");
  EXPECT_EQ(why([](auto& s) { s.exposure = std::chrono::microseconds(16); }),
            "camera: made 20 of exposure_us 16: write that into the rig");
  EXPECT_THAT(why([](auto& s) { s.buffer_width = s.buffer_height = 5000; }), HasSubstr("are 5000 x 5000; the largest"));
  EXPECT_THAT(why([](auto& s) { s.packet_bytes = 9790; }), HasSubstr("allowed: multiples of 8 to 9792"));
  EXPECT_THAT(why([](auto& s) { s.strobe_pin = 3; }), HasSubstr("(register 0x150C)"));
  EXPECT_THAT(why([](auto& s) { s.registers = "0x4=0x1"; }), HasSubstr("refused (register 0x4)"));
}

}  // namespace
}  // namespace hueline::drivers
