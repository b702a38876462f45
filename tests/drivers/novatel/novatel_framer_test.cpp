// Broken bytes: no intact message is lost, every byte is counted, and every loss is reported.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <random>

#include "core/calendar.hpp"
#include "drivers/novatel/decoder.hpp"
#include "drivers/novatel/logs.hpp"
#include "drivers/novatel/overlapping_crc.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"

namespace hueline::drivers {
namespace {

using test::all_of;
using test::Bytes;

/// Message k of a stream. Its time identifies it.
Bytes numbered(int k) {
  return test::inspvas({.week = 2300, .seconds = 1000.0 + k * 0.005, .latitude_deg = 48, .longitude_deg = 11});
}
GpsTime time_of(int k) { return from_gps_week(2300, std::chrono::seconds(1000) + k * std::chrono::milliseconds(5)); }

struct Outcome {
  std::vector<Measurement> measurements;
  DecodeCounts counts;
};
Outcome decode_pieces(const Bytes& bytes, std::mt19937& random, std::size_t longest_piece) {
  NovatelDecoder decoder({});
  Outcome out;
  const std::span<const std::byte> all(bytes);
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t n = std::min<std::size_t>(1 + random() % longest_piece, bytes.size() - at);
    decoder.decode(test::packet_of(all.subspan(at, n)), out.measurements);
    at += n;
    EXPECT_EQ(test::total(decoder.counts()) + decoder.held_bytes(), at);
  }
  decoder.flush(out.measurements);
  out.counts = decoder.counts();
  return out;
}
Outcome decode_whole(const Bytes& bytes) {
  std::mt19937 random(1);
  return decode_pieces(bytes, random, 1 << 20);
}

TEST(NovatelFramer, CorruptionNeverLosesAnIntactMessage) {
  // 400 streams of 40 messages. In some of them bytes are changed, cut out or inserted. Every message that was not
  // touched must come out, and the bytes must add up.
  for (unsigned seed = 0; seed < 400; ++seed) {
    std::mt19937 random(seed);
    Bytes stream;
    std::vector<int> intact;
    for (int k = 0; k < 40; ++k) {
      Bytes message = numbered(k);
      const auto place = static_cast<std::ptrdiff_t>(random() % message.size());
      switch (random() % 6) {
        case 0:
          message[static_cast<std::size_t>(place)] ^= static_cast<std::byte>(1 + random() % 255);
          break;
        case 1:
          message.erase(message.begin() + place,
                        message.begin() + place +
                            static_cast<std::ptrdiff_t>(
                                1 + random() % static_cast<unsigned>(message.end() - message.begin() - place)));
          break;
        case 2:
          message.insert(message.begin() + 1 + place % 100, static_cast<std::byte>(random()));
          break;
        default:
          intact.push_back(k);
      }
      // Sometimes there is noise between messages, and sometimes the beginning of a header in it.
      if (random() % 5 == 0)
        for (auto n = random() % 30; n > 0; --n) stream.push_back(static_cast<std::byte>(random()));
      if (random() % 20 == 0)
        for (const unsigned b : {0xAAu, 0x44u, 0x12u, 28u, 1u, 0u, 0u, 0u, static_cast<unsigned>(random() % 256),
                                 static_cast<unsigned>(random() % 40)})
          stream.push_back(static_cast<std::byte>(b));
      stream.insert(stream.end(), message.begin(), message.end());
    }
    const Outcome out = decode_pieces(stream, random, 300);
    EXPECT_EQ(test::total(out.counts), stream.size());
    std::vector<GpsTime> times;
    for (const InsSolution& s : all_of<InsSolution>(out.measurements)) times.push_back(s.time);
    for (const int k : intact)
      EXPECT_NE(std::find(times.begin(), times.end(), time_of(k)), times.end())
          << "message " << k << " of stream " << seed;
    std::uint64_t told = 0;
    for (const Fault& fault : all_of<Fault>(out.measurements))
      if (fault.kind == FaultKind::Malformed) told += fault.count;
    EXPECT_EQ(told, out.counts.malformed_bytes) << seed;
  }
}

TEST(NovatelFramer, MessageInsideTheClaimedLengthOfABrokenOneIsFound) {
  // A header with an unknown id claims 20 kB, and good messages follow. They are found when the claim turns out to be
  // wrong, or at the end.
  Bytes stream = test::long_message(4000, 2300, 0, Bytes(20000));
  stream.resize(40);  // header and the beginning of the body
  for (int k = 0; k < 10; ++k) {
    const Bytes m = numbered(k);
    stream.insert(stream.end(), m.begin(), m.end());
  }
  const Outcome early = decode_whole(stream);
  EXPECT_EQ(all_of<InsSolution>(early.measurements).size(), 10u);
  EXPECT_EQ(early.counts.malformed_bytes, 40u);
  EXPECT_EQ(early.counts.malformed_messages, 1u);
}

TEST(NovatelFramer, LengthThatAKnownMessageCannotHaveIsNotWaitedFor) {
  Bytes broken = test::long_message(101, 2300, 1000, Bytes(44));
  broken[9] = std::byte{0x20};  // TIME with 8236 bytes
  const Bytes good = numbered(1);
  broken.insert(broken.end(), good.begin(), good.end());
  NovatelDecoder decoder({});
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(broken), out);  // no flush
  EXPECT_EQ(all_of<InsSolution>(out).size(), 1u);
}

TEST(NovatelFramer, FieldsAppendedByNewerFirmwareAreAccepted) {
  Bytes body = test::pva_body({.week = 2300, .seconds = 5});
  body.resize(body.size() + 12);
  const Outcome out = decode_whole(test::short_message(508, 2300, 5000, body));
  EXPECT_EQ(all_of<InsSolution>(out.measurements).size(), 1u);
}

TEST(NovatelFramer, ReceivedIsTheArrivalOfTheLastByteThoughRecognitionWasDelayed) {
  Bytes stalled = test::long_message(4000, 2300, 0, Bytes(500));
  stalled.resize(40);
  const Bytes good = numbered(1);
  NovatelDecoder decoder({});
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(stalled, host_time_ns(1)), out);
  const std::span<const std::byte> whole(good);
  decoder.decode(test::packet_of(whole.first(50), host_time_ns(2)), out);
  decoder.decode(test::packet_of(whole.subspan(50), host_time_ns(3)), out);
  EXPECT_TRUE(out.empty());
  decoder.decode(test::packet_of(Bytes(600), host_time_ns(4)), out);
  ASSERT_EQ(all_of<InsSolution>(out).size(), 1u);
  EXPECT_EQ(all_of<InsSolution>(out)[0].received, host_time_ns(3));
}

TEST(NovatelFramer, TextBetweenMessagesIsNotDamage) {
  const Outcome out = decode_whole(test::joined(
      {test::text_bytes("\r\n<OK\r\n[COM1]"), numbered(1),
       test::text_bytes(
           "\r\n<BESTPOS COM1 0 90.5 FINESTEERING 2300 1.000 02000020\r\n<     SOL_COMPUTED SINGLE 48.0\r\n[COM1]"),
       numbered(2),
       test::text_bytes("%RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,"
                        "196192,417138,-1000837*038422a7\r\n"
                        "$GPGGA,1*00\r\n"),
       numbered(3)}));
  EXPECT_EQ(out.counts.malformed_bytes, 0u);
  EXPECT_EQ(out.counts.decoded_bytes, 3u * 104u);
  EXPECT_TRUE(all_of<Fault>(out.measurements).empty());
}

TEST(NovatelFramer, TextAfterDamageIsTextAgainFromItsLine) {
  const Outcome out = decode_whole(
      test::joined({Bytes(5, std::byte{0xF0}), test::text_bytes("garbled<OK\r\n<OK\r\n[COM1]"), numbered(1)}));
  EXPECT_EQ(out.counts.malformed_bytes, 5u + 12u);  // up to the line end that makes '<' a beginning
  EXPECT_EQ(out.counts.ignored_bytes, 5u + 6u);
  EXPECT_EQ(all_of<InsSolution>(out.measurements).size(), 1u);
}

TEST(NovatelFramer, RefusedCommandIsAFault) {
  Bytes body = test::Put().u32(3).text("Message id out of range").bytes;
  const Outcome out =
      decode_whole(test::joined({test::text_bytes("<OK\r\n[COM1]<ERROR:Invalid Message. Field = 1\r\n[COM1]"),
                                 test::long_message(1, 2300, 0, body, 180, 0x80)}));
  const auto faults = all_of<Fault>(out.measurements);
  ASSERT_EQ(faults.size(), 2u);
  EXPECT_EQ(faults[0].kind, FaultKind::Refused);
  EXPECT_NE(faults[0].detail.find("<ERROR:Invalid Message. Field = 1"), std::string::npos);
  EXPECT_EQ(faults[1].kind, FaultKind::Refused);
  EXPECT_NE(faults[1].detail.find("Message id out of range"), std::string::npos);
  EXPECT_EQ(out.counts.malformed_bytes, 0u);
}

TEST(NovatelFramer, EndlessNoiseIsToldInPieces) {
  NovatelDecoder decoder({});
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(Bytes(10000, std::byte{0xF8})), out);  // a wrong baud rate, still connected
  EXPECT_EQ(all_of<Fault>(out).size(), 2u);
  EXPECT_EQ(decoder.counts().malformed_bytes, 8192u);
  decoder.flush(out);
  EXPECT_EQ(decoder.counts().malformed_bytes, 10000u);
}

TEST(NovatelFramer, ResetForgetsHalfAMessageAndCountsIt) {
  const Bytes first = numbered(1), second = numbered(2);
  NovatelDecoder decoder({});
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(std::span(first).first(60)), out);
  EXPECT_EQ(decoder.held_bytes(), 60u);
  decoder.reset();
  EXPECT_EQ(decoder.counts().malformed_bytes, 60u);
  decoder.decode(test::packet_of(second), out);
  ASSERT_EQ(all_of<InsSolution>(out).size(), 1u);
  EXPECT_EQ(all_of<InsSolution>(out)[0].time, time_of(2));
}

RC_GTEST_PROP(NovatelFramer, AnyBytesAreAccountedForWhereverTheyAreCut,
              (const std::vector<std::uint8_t>& noise, std::uint32_t seed)) {
  Bytes bytes = numbered(3);
  for (const std::uint8_t b : noise) bytes.push_back(static_cast<std::byte>(b));
  const Bytes tail = numbered(4);
  bytes.insert(bytes.end(), tail.begin(), tail.end());
  std::mt19937 random(seed);
  const Outcome whole = decode_whole(bytes), pieces = decode_pieces(bytes, random, 9);
  RC_ASSERT(test::total(whole.counts) == bytes.size());
  RC_ASSERT(whole.measurements.size() == pieces.measurements.size());
  for (std::size_t i = 0; i < whole.measurements.size(); ++i)
    RC_ASSERT(test::described(whole.measurements[i]) == test::described(pieces.measurements[i]));
  RC_ASSERT(all_of<InsSolution>(whole.measurements).size() == 2u);
}

TEST(NovatelDecoder, NamesOfMessagesAreBounded) {
  Bytes stream;
  for (unsigned id = 3000; id < 6000; ++id) {
    const Bytes message = test::long_message(id, 2300, 0, Bytes(4));
    stream.insert(stream.end(), message.begin(), message.end());
  }
  const Outcome out = decode_whole(stream);
  EXPECT_EQ(out.counts.messages.size(), DecodeCounts::kMostNames + 1);
  EXPECT_EQ(out.counts.messages.at("others"), 3000 - DecodeCounts::kMostNames);
  EXPECT_EQ(out.counts.ignored_bytes, stream.size());
}

/// Headers every ten bytes, each of which claims the next 32 kB, then an intact message. Only the last byte of a claim
/// shows that it is wrong.
Bytes nested_lengths(std::size_t size) {
  const Bytes header = test::long_message(4000, 2300, 0, Bytes(32000));
  Bytes stream;
  while (stream.size() < size) stream.insert(stream.end(), header.begin(), header.begin() + 10);
  const Bytes good = numbered(7);
  stream.insert(stream.end(), good.begin(), good.end());
  return stream;
}

struct Found : NovatelFramer::Sink {
  void on_message(const NovatelMessage& message) override { messages.push_back(message.header.id); }
  void on_text(std::string_view text, HostTime) override { text_bytes += text.size(); }
  void on_skipped(std::uint64_t bytes, std::uint64_t began, std::uint16_t, HostTime) override {
    skipped += bytes, broken += began;
  }
  std::vector<std::uint16_t> messages;
  std::uint64_t text_bytes = 0, skipped = 0, broken = 0;
};

TEST(NovatelFramer, LengthsThatNestAreHashedOnce) {
  const Bytes stream = nested_lengths(200'000);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{1460}, stream.size()}) {
    NovatelFramer framer({});
    Found found;
    for (std::size_t at = 0; at < stream.size(); at += piece)
      framer.feed(std::span(stream).subspan(at, std::min(piece, stream.size() - at)), {}, found);
    EXPECT_LE(framer.bytes_hashed(), 2 * stream.size()) << "pieces of " << piece;
    framer.flush(found);
    EXPECT_EQ(found.messages, std::vector<std::uint16_t>{508}) << "pieces of " << piece;
    EXPECT_EQ(found.skipped, 200'000u);
    EXPECT_EQ(found.broken, 20'000u);
  }
}

TEST(NovatelFramer, MessagesAmongLengthsThatNestAreFoundWhereverTheyStand) {
  std::mt19937 random(5);
  Bytes stream;
  std::vector<GpsTime> sent;
  for (int k = 0; k < 60; ++k) {
    for (auto n = random() % 50; n > 0; --n) {
      const Bytes header = test::long_message(4000 + random() % 4, 2300, 0, Bytes(random() % 3000));
      stream.insert(stream.end(), header.begin(), header.begin() + 10);
    }
    const Bytes message = numbered(k);
    stream.insert(stream.end(), message.begin(), message.end());
    sent.push_back(time_of(k));
  }
  for (const std::size_t longest : {std::size_t{3}, std::size_t{400}, stream.size()}) {
    std::vector<GpsTime> times;
    for (const InsSolution& s : all_of<InsSolution>(decode_pieces(stream, random, longest).measurements))
      times.push_back(s.time);
    EXPECT_EQ(times, sent);
  }
}

RC_GTEST_PROP(OverlappingCrc, IsThatOfEachRange, (const std::vector<std::uint8_t>& noise, std::uint32_t seed)) {
  Bytes bytes(1 + seed % 5000);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::byte>(noise.empty() ? i : noise[i % noise.size()] + i / 7);
  std::mt19937 random(seed);
  OverlappingCrc crc;
  for (std::size_t begin = 0; begin < bytes.size(); begin += random() % 300) {
    const auto range = std::span<const std::byte>(bytes).subspan(begin, random() % (bytes.size() - begin + 1));
    RC_ASSERT(crc.of(range, begin) == test::bitwise_crc(range));
  }
  RC_ASSERT(crc.bytes_hashed() <= 2 * bytes.size());
}

TEST(NovatelLogs, Dialogue) {
  NovatelLogs::Config config;
  config.mark_inputs = {1, 3};
  config.commands = {"EVENTINCONTROL MARK1 EVENT POSITIVE 0 2"};
  config.raw_imu = true;
  const auto dialogue = novatel_dialogue(config);
  ASSERT_TRUE(dialogue.ok());
  EXPECT_EQ(
      *dialogue,
      "UNLOGALL THISPORT\r\nEVENTINCONTROL MARK1 EVENT POSITIVE 0 2\r\nLOG TIMEB ONTIME 1\r\nLOG MARK1TIMEB ONNEW\r\n"
      "LOG MARK3TIMEB ONNEW\r\nLOG BESTPOSB ONTIME 1\r\nLOG INSSTDEVB ONTIME 1\r\nLOG INSPVAXB ONTIME 1\r\n"
      "LOG INSPVASB ONTIME 0.005\r\nLOG INSCONFIGB ONCHANGED\r\nLOG RAWIMUSXB ONNEW\r\n");
}

TEST(NovatelLogs, ConfigNamesTheWrongKey) {
  NovatelLogs::Config config;
  config.ins_rate_hz = 30;
  EXPECT_NE(config.validate().text().find("ins_rate_hz"), std::string::npos);
  config = {};
  config.mark_inputs = {1, 1};
  EXPECT_NE(config.validate().text().find("mark_inputs"), std::string::npos);
  config = {};
  config.commands = {"SAVECONFIG\r\nFRESET"};
  EXPECT_NE(config.validate().text().find("commands"), std::string::npos);
  EXPECT_EQ(novatel_dialogue(config).error().code, ErrorCode::Invalid);
  config = {};
  config.ins_extended_rate_hz = 0.2;
  config.ins_rate_hz = 0;
  EXPECT_NE(novatel_dialogue(config)->find("LOG INSPVAXB ONTIME 5\r\n"), std::string::npos);
}

}  // namespace
}  // namespace hueline::drivers
