// Signals of the wheels that a rig names and a database describes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "drivers/wheel/wheel_decoder.hpp"
#include "tests/drivers/can/can_frames.hpp"

namespace hueline::drivers {
namespace {

using ::testing::HasSubstr;

constexpr const char* kDatabase =
    "BO_ 178 ESP: 8 X\n"
    " SG_ Left : 0|16@1+ (0.01,0) [0|600] \"km/h\" X\n"
    " SG_ Right : 23|16@0+ (0.01,0) [0|600] \"km/h\" X\n"
    " SG_ Count : 56|4@1+ (1,0) [0|15] \"\" X\n"
    "BO_ 2566844672 Hub: 8 X\n"
    " SG_ Page M : 0|8@1+ (1,0) [0|0] \"\" X\n"
    " SG_ Fast m1 : 8|32@1- (1,0) [0|0] \"m/s\" X\n"
    " SG_ Other m2 : 8|32@1+ (1,0) [0|0] \"\" X\n"
    " SG_ Pulses m3 : 8|16@1+ (1,0) [0|0] \"\" X\n"
    "SIG_VALTYPE_ 2566844672 Fast : 1;\n";

WheelSignal named(const std::string& name, double unit = 1) {
  WheelSignal out;
  out.name = name;
  out.unit = unit;
  return out;
}
WheelDecoder::Config config() {
  WheelDecoder::Config out;
  out.database = "vehicle.dbc";
  out.messages.resize(2);
  out.messages[0].speeds = {named("ESP.Left", 1 / 3.6), named("ESP.Right", 1 / 3.6)};
  out.messages[0].counter = named("ESP.Count");
  out.messages[1].speeds = {named("Hub.Fast")};
  return out;
}
std::vector<Measurement> take(WheelDecoder& decoder, const Packet& packet) {
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  return out;
}
Packet database(const char* text) {
  Packet packet;
  packet.sensor = 3;
  packet.bytes = Buffer::copy_of(encode_database_packet(text));
  return packet;
}
std::string problem(const WheelDecoder::Config& wrong) {
  const auto found = wrong.find_signals(kDatabase);
  return found.ok() ? "" : found.error().message;
}

TEST(WheelDatabase, BitsScaleRangeAndIdComeFromIt) {
  ASSERT_EQ(config().validate(), "");
  WheelDecoder decoder(config());
  EXPECT_TRUE(take(decoder, database(kDatabase)).empty());
  // Left 36 km/h little endian; right 72 km/h big endian.
  auto out = take(decoder, test::can_packet(test::can_frame(178, {0x10, 0x0E, 0x1C, 0x20, 0, 0, 0, 1}), 1));
  ASSERT_EQ(out.size(), 1u);
  EXPECT_NEAR(*std::get<WheelSpeed>(out[0]).speed, 15, 1e-9);
  // 65535 is outside of the range that the database gives.
  out = take(decoder, test::can_packet(test::can_frame(178, {0xFF, 0xFF, 0x0E, 0x10, 0, 0, 0, 2}), 3));
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(std::get<Fault>(out[0]).kind, FaultKind::Implausible);
  const auto& counts = decoder.counts();
  EXPECT_EQ(counts.decoded_bytes, 4 + std::strlen(kDatabase) + 64);
}

TEST(WheelDatabase, OfAMultiplexedSignalTheFramesThatHaveItAreUsed) {
  WheelDecoder decoder(config());
  take(decoder, database(kDatabase));
  const float speed = -2.5f;
  for (const int page : {1, 2, 1, 0}) {
    CanFrame frame = test::can_frame(0x18FEF100, {page, 0, 0, 0, 0, 0, 0, 0});
    frame.is_extended = true;
    std::memcpy(frame.data.data() + 1, &speed, 4);
    const auto out = take(decoder, test::can_packet(frame, 1));
    ASSERT_EQ(out.size(), page == 1 ? 1u : 0u) << page;
    if (page != 1) continue;
    EXPECT_EQ(*std::get<WheelSpeed>(out[0]).speed, -2.5);
    EXPECT_TRUE(std::get<WheelSpeed>(out[0]).is_directional);
    frame.length = 4;  // cut
    const auto cut = take(decoder, test::can_packet(frame, 1.01));
    ASSERT_EQ(cut.size(), 1u);
    EXPECT_EQ(std::get<Fault>(cut[0]).kind, FaultKind::Malformed);
    const float none = std::numeric_limits<float>::quiet_NaN();
    frame.length = 8;
    std::memcpy(frame.data.data() + 1, &none, 4);
    const auto no_number = take(decoder, test::can_packet(frame, 1.02));
    ASSERT_EQ(no_number.size(), 1u);
    EXPECT_EQ(std::get<Fault>(no_number[0]).kind, FaultKind::Implausible);
  }
}

TEST(WheelDatabase, WithoutItNothingIsDecodedAndThatIsToldOnce) {
  WheelDecoder decoder(config());
  const Packet frame = test::can_packet(test::can_frame(178, {0, 0, 0, 0, 0, 0, 0, 1}), 1);
  auto out = take(decoder, frame);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(std::get<Fault>(out[0]).kind, FaultKind::WrongDevice);
  EXPECT_TRUE(take(decoder, frame).empty());
  out = take(decoder, database("BO_ 1 A: 8 X\n"));
  ASSERT_EQ(out.size(), 1u);
  EXPECT_THAT(std::get<Fault>(out[0]).detail, HasSubstr("no message ESP; it has A"));
  EXPECT_TRUE(take(decoder, database(kDatabase)).empty());
  EXPECT_EQ(take(decoder, frame).size(), 1u);
}

TEST(WheelDatabase, WhatItCannotGiveIsRefusedWithItsName) {
  EXPECT_EQ(problem(config()), "");
  WheelDecoder::Config wrong = config();
  wrong.messages[0].speeds[1].name = "ESP.Middle";
  EXPECT_THAT(problem(wrong), HasSubstr("ESP.Middle: the message ESP has no signal Middle; it has Left, Right, Count"));
  wrong = config();
  wrong.messages[0].speeds[1].name = "Hub.Fast";
  EXPECT_THAT(problem(wrong), HasSubstr("Hub.Fast is not in ESP"));
  wrong = config();
  wrong.messages[1].pulses = {{named("Hub.Pulses"), 0.02}};
  EXPECT_THAT(problem(wrong), HasSubstr("messages[1].pulses[0].signal is Hub.Pulses, which is multiplexed"));
  wrong = config();
  wrong.messages[1].speeds = {named("ESP.Left")};
  EXPECT_THAT(problem(wrong), HasSubstr("each message once"));
  wrong = config();
  wrong.database.clear();
  EXPECT_THAT(wrong.validate().text(), HasSubstr("dbc is missing"));
  wrong = config();
  wrong.messages.resize(1);
  wrong.messages[0].speeds = {CanSignal{}};
  wrong.messages[0].counter.reset();
  EXPECT_THAT(wrong.validate().text(), HasSubstr("no signal is named"));
}

}  // namespace
}  // namespace hueline::drivers
