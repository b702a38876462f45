// The meaning of messages: values computed by hand, the manual's own examples, and decode(encode(x)) == x.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdio>
#include <span>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/novatel/crc32.hpp"
#include "drivers/novatel/decoder.hpp"
#include "drivers/novatel/messages.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;
using test::all_of;
using test::Put;

std::vector<Measurement> decoded(const test::Bytes& bytes, const NovatelDecoder::Config& config = {}) {
  NovatelDecoder decoder(config);
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(bytes), out);
  decoder.flush(out);
  EXPECT_EQ(test::total(decoder.counts()), bytes.size());
  return out;
}

TEST(NovatelCrc, ManualExamples) {
  // The manual's ASCII logs have the same CRC over their text, from after '#' or '%' to before '*'.
  const auto crc = [](std::string_view text) { return novatel_crc32(test::text_bytes(text)); };
  EXPECT_EQ(
      crc("TIMEA,USB1,0,50.5,FINESTEERING,2209,515163.000,02000020,9924,16809;VALID,-2.501488425e-09,6.133312031e-10,"
          "-17.99999999630,2022,5,13,23,5,45000,VALID"),
      0x1100ad64u);
  EXPECT_EQ(crc("RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,-"
                "1000837"),
            0x038422a7u);
  EXPECT_EQ(novatel_crc32({}), 0u);
}

RC_GTEST_PROP(NovatelCrc, EqualsTheBitwiseDefinition, (const std::vector<std::uint8_t>& values)) {
  const auto bytes = std::as_bytes(std::span(values));
  RC_ASSERT(novatel_crc32(bytes) == test::bitwise_crc(bytes));
}

/// An ASCII log with its check sum.
std::string ascii_log(char begin, const std::string& inside) {
  const std::uint32_t crc = test::bitwise_crc(std::as_bytes(std::span(inside)));
  char sum[16];
  std::snprintf(sum, sizeof sum, "*%08x\r\n", crc);
  return begin + inside + sum;
}

TEST(NovatelAscii, GivesWhatTheSameLogsGiveInBinary) {
  const std::string text = "[COM1]" +
                           ascii_log('%',
                                     "INSPVASA,2300,100000.010;2300,100000.010000000,48.5,9.25,401.25,1.5,-2.5,0.125,1."
                                     "0,-2.0,270.5,INS_SOLUTION_GOOD") +
                           ascii_log('#',
                                     "TIMEA,COM1,0,86.5,FINESTEERING,2300,100001.000,02000020,9924,32768;VALID,1.6e-10,"
                                     "9.6e-10,-18.00000000000,2024,2,5,3,46,23000,VALID") +
                           ascii_log('#',
                                     "BESTPOSA,COM1,0,83.5,FINESTEERING,2300,100001.000,02000040,cdba,32768;SOL_"
                                     "COMPUTED,INS_RTKFIXED,48.5,9.25,400.0,"
                                     "47.5,WGS84,0.02,0.01,0.03,\"AAAA\",1.0,0.0,24,22,22,20,00,06,00,33");
  const auto ascii = decoded(test::text_bytes(text));
  test::Pva pva{2300, 100000.01, 48.5, 9.25, 401.25, 1.5, -2.5, 0.125, 1.0, -2.0, 270.5, 3};
  const auto solutions = all_of<InsSolution>(ascii), binary = all_of<InsSolution>(decoded(test::inspvas(pva)));
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_EQ(test::described(solutions[0]), test::described(binary.at(0)));
  const auto labels = all_of<TimeLabel>(ascii);
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].second, from_gps_week(2300, seconds(100001)));
  EXPECT_EQ(labels[0].utc_offset, seconds(18));
  const auto fixes = all_of<GnssFix>(ascii);
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].type, FixType::RtkFixed);
  EXPECT_EQ(fixes[0].satellites, 22);
  EXPECT_NEAR(fixes[0].position.ellipsoidal_height, 447.5, 1e-9);
  EXPECT_FLOAT_EQ(static_cast<float>(fixes[0].sigma_enu[0]), 0.01f);
}

TEST(NovatelAscii, NamesWhatItDoesNotUseAndRefusesWhatIsBroken) {
  const std::string good = ascii_log('%',
                                     "INSPVASA,2300,100000.010;2300,100000.010000000,48.5,9.25,401.25,1.5,-2.5,0.125,1."
                                     "0,-2.0,270.5,INS_SOLUTION_GOOD");
  std::string broken = good;
  broken[40] = broken[40] == '1' ? '2' : '1';
  const std::string unused = ascii_log('%', "RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,1,2,3,4,5,6");
  const std::string second = ascii_log(
      '#',
      "BESTPOSA_1,COM1,0,83.5,FINESTEERING,2300,100001.000,02000040,cdba,32768;SOL_COMPUTED,SINGLE,48.5,9.25,400.0,"
      "47.5,WGS84,0.02,0.01,0.03,\"AAAA\",1.0,0.0,24,22,22,20,00,06,00,33");
  NovatelDecoder decoder({});
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(test::text_bytes(good + broken + unused + second + "$GPGGA,1*00\r\n")), out);
  decoder.flush(out);
  EXPECT_EQ(all_of<InsSolution>(out).size(), 1u);
  EXPECT_TRUE(all_of<GnssFix>(out).empty());
  EXPECT_EQ(decoder.counts().malformed_bytes, broken.size());
  EXPECT_EQ(decoder.counts().messages.at("RAWIMUSX"), 1u);
  EXPECT_EQ(decoder.counts().messages.at("BESTPOS_1"), 1u);
  EXPECT_EQ(decoder.counts().messages.at("text"), 1u);
}

/// Receivers before OEM7 have one antenna, and put other numbers where OEM7 names the antenna.
TEST(NovatelMessages, TheReservedBitsOfOlderReceiversAreNoOtherAntenna) {
  Put body;
  body.u32(0)
      .u32(56)
      .f64(48.5)
      .f64(9.25)
      .f64(400)
      .f32(47.5)
      .u32(61)
      .f32(0.02)
      .f32(0.01)
      .f32(0.03)
      .text("AAAA")
      .f32(1)
      .f32(0)
      .u32(0)
      .u32(0);
  EXPECT_EQ(all_of<GnssFix>(decoded(test::long_message(42, 1540, 5000, body.bytes, 180, 2))).size(), 1u);
  EXPECT_EQ(all_of<GnssFix>(decoded(test::long_message(42, 1540, 5000, body.bytes, 180, 1))).size(), 0u);
}

TEST(NovatelMessages, Mark1TimeByHand) {
  // The manual's example: week 1358 is 0x054E, and 422621.0000005 s is 0x4119CB740000218E.
  Put body;
  for (const unsigned byte : {0x4Eu, 0x05u, 0u, 0u, 0x8Eu, 0x21u, 0u, 0u, 0x74u, 0xCBu, 0x19u, 0x41u}) body.u8(byte);
  body.f64(-1.398163614e-08).f64(7.812745577e-08).f64(-14.000000002).u32(0);
  const auto out = decoded(test::long_message(1130, 1358, 422621000, body.bytes));
  const auto marks = all_of<EventMark>(out);
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_EQ(marks[0].time, from_gps_week(1358, seconds(422621) + nanoseconds(500)));
  EXPECT_EQ(marks[0].input, 1);
  EXPECT_TRUE(marks[0].is_valid);
  EXPECT_EQ(marks[0].sensor, 7);
  // Its precise time bounds the host clock, not the milliseconds in the header.
  const auto arrivals = all_of<TimedArrival>(out);
  ASSERT_EQ(arrivals.size(), 1u);
  EXPECT_EQ(arrivals[0].time, marks[0].time);
}

TEST(NovatelMessages, EveryMarkInputHasItsIds) {
  const std::pair<unsigned, int> time_ids[] = {{231, 1}, {1130, 1}, {616, 2}, {1075, 3}, {1076, 4}};
  for (const auto& [id, input] : time_ids) {
    const auto marks = all_of<EventMark>(decoded(test::mark_time(id, 2300, 5.25)));
    ASSERT_EQ(marks.size(), 1u) << id;
    EXPECT_EQ(marks[0].input, input);
  }
  const std::pair<unsigned, int> pva_ids[] = {{1067, 1}, {1068, 2}, {1118, 3}, {1119, 4}};
  for (const auto& [id, input] : pva_ids) {
    const auto out = decoded(test::long_message(id, 2300, 5250, test::pva_body({.week = 2300, .seconds = 5.25})));
    ASSERT_EQ(all_of<EventMark>(out).size(), 1u) << id;
    EXPECT_EQ(all_of<EventMark>(out)[0].input, input);
    EXPECT_TRUE(all_of<InsSolution>(out).empty());  // its pose is not of Body
  }
}

TEST(NovatelMessages, OneMarkForTimeAndPvaOfOneEvent) {
  const auto pva = [](double t) {
    return test::long_message(1067, 2300, test::milliseconds_of(t), test::pva_body({.week = 2300, .seconds = t}));
  };
  const auto bytes =
      test::joined({test::mark_time(1130, 2300, 10.1), pva(10.1), pva(10.6), test::mark_time(1130, 2300, 10.6),
                    test::mark_time(616, 2300, 10.6)});  // another input at the same instant is another event
  const auto marks = all_of<EventMark>(decoded(bytes));
  ASSERT_EQ(marks.size(), 3u);
  EXPECT_EQ(marks[0].input, 1);
  EXPECT_EQ(marks[1].input, 1);
  EXPECT_EQ(marks[2].input, 2);
  EXPECT_EQ(marks[1].time - marks[0].time, std::chrono::milliseconds(500));
}

TEST(NovatelMessages, MarkIsOnlyValidWithAGoodClock) {
  const auto valid = [](const test::Bytes& bytes) { return all_of<EventMark>(decoded(bytes)).at(0).is_valid; };
  EXPECT_TRUE(valid(test::mark_time(1130, 2300, 1.5)));
  EXPECT_FALSE(valid(test::mark_time(1130, 2300, 1.5, 0, 0, 120)));  // COARSESTEERING
  EXPECT_FALSE(valid(test::mark_time(1130, 2300, 1.5, 0, 3)));       // clock model INVALID
  EXPECT_FALSE(valid(test::mark_time(1130, 2300, 1.5, 2e-6)));       // 2 us from GPS
}

test::Bytes time_message(unsigned week, std::uint32_t milliseconds, const UtcTime& utc, double utc_offset,
                         std::uint32_t utc_status = 1, std::uint32_t clock_status = 0,
                         unsigned time_status = test::kFineSteering) {
  Put p;
  p.u32(clock_status).f64(1e-9).f64(1e-9).f64(utc_offset).u32(static_cast<std::uint32_t>(utc.year));
  p.u8(static_cast<unsigned>(utc.month)).u8(static_cast<unsigned>(utc.day)).u8(static_cast<unsigned>(utc.hour));
  p.u8(static_cast<unsigned>(utc.minute)).u32(static_cast<std::uint32_t>(utc.second) * 1000u).u32(utc_status);
  return test::long_message(101, week, milliseconds, p.bytes, time_status);
}

TEST(NovatelMessages, TimeOfTheManualsExample) {
  // 2209, 515163 s; -17.9999999963; 2022-05-13 23:05:45.
  const auto out = decoded(time_message(2209, 515163000, {2022, 5, 13, 23, 5, 45, 0}, -17.9999999963));
  const auto labels = all_of<TimeLabel>(out);
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].second, from_gps_week(2209, seconds(515163)));
  EXPECT_EQ(labels[0].utc_offset, seconds(18));
  EXPECT_TRUE(labels[0].is_valid);
  EXPECT_TRUE(all_of<Fault>(out).empty());
}

TEST(NovatelMessages, TimeIsDoubtedForAReason) {
  const UtcTime utc{2022, 5, 13, 23, 5, 45, 0};
  // The calendar time is one second off, because somebody's leap second is wrong.
  auto out = decoded(time_message(2209, 515164000, utc, -18));
  EXPECT_FALSE(all_of<TimeLabel>(out).at(0).is_valid);
  ASSERT_EQ(all_of<Fault>(out).size(), 1u);
  EXPECT_EQ(all_of<Fault>(out)[0].kind, FaultKind::LabelConflict);
  // UTC is not known yet (0), or is a warning (2): there is no offset, but the GPS second is still right.
  for (const std::uint32_t status : {0u, 2u}) {
    out = decoded(time_message(2209, 515163000, {1980, 1, 6, 0, 0, 0, 0}, 0, status));
    EXPECT_FALSE(all_of<TimeLabel>(out).at(0).utc_offset);
    EXPECT_TRUE(all_of<TimeLabel>(out).at(0).is_valid);
  }
  EXPECT_FALSE(all_of<TimeLabel>(decoded(time_message(2209, 515163000, utc, -18, 1, 1))).at(0).is_valid);  // CONVERGING
  EXPECT_FALSE(
      all_of<TimeLabel>(decoded(time_message(2209, 515163000, utc, -18, 1, 0, 100))).at(0).is_valid);  // COARSE
  // If TIME is logged twice a second, the one at the half second belongs to the edge before it.
  EXPECT_EQ(all_of<TimeLabel>(decoded(time_message(2209, 515163500, utc, -18, 0))).at(0).second,
            from_gps_week(2209, seconds(515163)));
}

TEST(NovatelMessages, TimeInsideALeapSecond) {
  // 2016-12-31 23:59:60 UTC: week 1930, second 17 (offset still 17).
  const auto out = decoded(time_message(1930, 17000, {2016, 12, 31, 23, 59, 60, 0}, -17));
  EXPECT_TRUE(all_of<TimeLabel>(out).at(0).is_valid);
  EXPECT_TRUE(all_of<Fault>(out).empty());
}

TEST(NovatelMessages, AttitudeTurnsTheBodyAsTheManualSays) {
  // Azimuth 90 means that the nose points east, pitch 10 that the nose is up, roll 10 that the right side is down.
  const auto R = [](double roll, double pitch, double azimuth) {
    const auto out = decoded(test::inspvas({.roll_deg = roll, .pitch_deg = pitch, .azimuth_deg = azimuth}));
    return rotation_enu_body(all_of<InsSolution>(out).at(0).attitude).toRotationMatrix();
  };
  EXPECT_NEAR((R(0, 0, 90) * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitX()).norm(), 0, 1e-12);
  EXPECT_NEAR((R(0, 10, 0) * Eigen::Vector3d::UnitY()).z(), std::sin(10 * kRadPerDeg), 1e-12);
  EXPECT_NEAR((R(10, 0, 0) * Eigen::Vector3d::UnitX()).z(), -std::sin(10 * kRadPerDeg), 1e-12);
}

TEST(NovatelMessages, StatusDecidesWhatIsGood) {
  const std::pair<std::uint32_t, bool> cases[] = {{0, false}, {1, false}, {2, false}, {3, true},
                                                  {6, true},  {7, false}, {8, false}};
  for (const auto& [status, good] : cases) {
    const auto out = decoded(test::inspvas({.status = status}));
    EXPECT_EQ(all_of<InsSolution>(out).at(0).is_good, good) << status;
    // With short headers only, the state of the filter shows that the clock is fine.
    EXPECT_EQ(all_of<TimedArrival>(out).size(), good ? 1u : 0u) << status;
  }
  // A long header said that the time is coarse, so what follows with short headers is doubted.
  const auto out = decoded(test::joined({test::mark_time(1130, 2300, 1, 0, 0, 100), test::inspvas({})}));
  EXPECT_FALSE(all_of<InsSolution>(out).at(0).is_good);
  EXPECT_TRUE(all_of<TimedArrival>(out).empty());
}

TEST(NovatelMessages, ImpossibleValuesBecomeNothingAndAreCounted) {
  const double nan = std::nan("");
  for (const test::Pva& bad :
       {test::Pva{.week = 0}, test::Pva{.seconds = 604800}, test::Pva{.seconds = nan}, test::Pva{.latitude_deg = 91},
        test::Pva{.longitude_deg = nan}, test::Pva{.north = nan}, test::Pva{.azimuth_deg = INFINITY}}) {
    NovatelDecoder decoder({});
    std::vector<Measurement> out;
    decoder.decode(test::packet_of(test::inspvas(bad)), out);
    EXPECT_TRUE(all_of<InsSolution>(out).empty());
    EXPECT_EQ(decoder.counts().ignored_bytes, 104u);
    EXPECT_EQ(decoder.counts().messages.at("INSPVAS"), 1u);
  }
}

/// A filter that has not aligned sends the centre of the earth as its place. Why it does not navigate must be told.
TEST(NovatelMessages, AFilterThatDoesNotNavigateSaysSoWithoutAPlace) {
  const double nan = std::nan("");
  const test::Pva centre{.latitude_deg = -90, .height = -6356752.3, .status = 1};
  const auto solutions = all_of<InsSolution>(decoded(test::joined(
      {test::inspvas(centre), test::inspvas({.seconds = 100001, .latitude_deg = nan, .north = nan, .status = 0})})));
  ASSERT_EQ(solutions.size(), 2u);
  EXPECT_EQ(solutions[0].status, 1u);
  EXPECT_FALSE(solutions[0].is_good);
  EXPECT_FALSE(is_on_earth(solutions[0].position));
  EXPECT_FALSE(is_on_earth(solutions[1].position));
  EXPECT_TRUE(solutions[1].velocity_enu.isZero());
  Put body;  // INSPVAX
  body.u32(1).u32(0).f64(-90).f64(0).f64(-6356752.3).f32(0);
  for (int i = 0; i < 6; ++i) body.f64(0);
  for (int i = 0; i < 9; ++i) body.f32(0);
  body.u32(0).u16(0);
  const auto x = all_of<InsSolution>(decoded(test::long_message(1465, 2300, 5000, body.bytes)));
  ASSERT_EQ(x.size(), 1u);
  EXPECT_EQ(x[0].status, 1u);
  EXPECT_FALSE(x[0].is_good);
  // One that navigates has a place; without it the message is broken.
  EXPECT_TRUE(all_of<InsSolution>(decoded(test::inspvas({.latitude_deg = -90, .height = -6356752.3}))).empty());
}

TEST(NovatelMessages, SecondaryAntennaIsNotThePosition) {
  Put p;
  p.u32(0).u32(50).f64(10).f64(20).f64(100).f32(40).u32(61).f32(0.1).f32(0.2).f32(0.3).u32(0).f32(0).f32(0);
  p.u8(20).u8(18).u8(18).u8(18).u32(0);
  NovatelDecoder decoder({});
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(test::joined({test::long_message(42, 2300, 1000, p.bytes),
                                               test::long_message(42, 2300, 1000, p.bytes, 180, 1)})),
                 out);
  const auto fixes = all_of<GnssFix>(out);
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].type, FixType::RtkFixed);
  EXPECT_EQ(fixes[0].satellites, 18);
  EXPECT_NEAR(fixes[0].position.ellipsoidal_height, 140, 1e-9);
  EXPECT_EQ(decoder.counts().messages.at("BESTPOS_1"), 1u);
}

RC_GTEST_PROP(NovatelMessages, InspvasDecodesToWhatWasEncoded, ()) {
  const auto real = [](int from, int to) {
    return *rc::gen::inRange(from * 1000, to * 1000) / 1000.0 + *rc::gen::inRange(0, 1000) * 1e-7;
  };
  test::Pva v;
  v.week = *rc::gen::inRange(1u, 5000u);
  const std::int64_t ns = *rc::gen::inRange<std::int64_t>(0, 604800LL * 1000000000LL);
  v.seconds = static_cast<double>(ns) * 1e-9;
  v.latitude_deg = real(-90, 90);
  v.longitude_deg = real(-180, 180);
  v.height = real(-400, 9000);
  v.north = real(-50, 50);
  v.east = real(-50, 50);
  v.up = real(-10, 10);
  v.roll_deg = real(-180, 180);
  v.pitch_deg = real(-90, 90);
  v.azimuth_deg = real(0, 360);
  v.status = *rc::gen::inRange(0u, 15u);
  RC_PRE(std::abs(v.latitude_deg) <= 90.0 && std::abs(v.longitude_deg) <= 180.0);
  const auto solutions = all_of<InsSolution>(decoded(test::inspvas(v)));
  RC_ASSERT(solutions.size() == 1u);
  const InsSolution& s = solutions[0];
  RC_ASSERT(std::abs((s.time - from_gps_week(static_cast<int>(v.week), nanoseconds(ns))).count()) <=
            1);  // a double holds 0.1 ns here
  RC_ASSERT(std::abs(s.position.latitude / kRadPerDeg - v.latitude_deg) < 1e-12);
  RC_ASSERT(std::abs(s.position.longitude / kRadPerDeg - v.longitude_deg) < 1e-12);
  RC_ASSERT(s.position.ellipsoidal_height == v.height);
  RC_ASSERT(s.velocity_enu == Eigen::Vector3d(v.east, v.north, v.up));
  RC_ASSERT(std::abs(s.attitude.roll / kRadPerDeg - v.roll_deg) < 1e-12);
  RC_ASSERT(std::abs(s.attitude.pitch / kRadPerDeg - v.pitch_deg) < 1e-12);
  RC_ASSERT(std::abs(s.attitude.heading / kRadPerDeg - v.azimuth_deg) < 1e-12);
  RC_ASSERT(s.status == v.status);
}

}  // namespace
}  // namespace hueline::drivers
