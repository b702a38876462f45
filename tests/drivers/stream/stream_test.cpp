// Messages in streams of bytes: check sums of overlapping ranges, forms, and what is skipped.
#include <gtest/gtest.h>

#include <random>

#include "drivers/nmea/nmea_decoder.hpp"
#include "drivers/stream/line_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"
#include "drivers/stream/rtcm_form.hpp"
#include "drivers/ublox/ublox_decoder.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;

// The definitions, bit by bit.
std::uint32_t crc(std::span<const std::byte> bytes, std::uint32_t polynomial, int bits) {
  std::uint32_t out = 0;
  for (const std::byte byte : bytes)
    for (int bit = 7; bit >= 0; --bit) {
      const bool top = ((out >> (bits - 1)) & 1) != (static_cast<unsigned>(byte) >> bit & 1);
      out = (out << 1) & static_cast<std::uint32_t>((std::uint64_t{1} << bits) - 1);
      if (top) out ^= polynomial;
    }
  return out;
}
std::uint16_t fletcher(std::span<const std::byte> bytes) {
  unsigned a = 0, b = 0;
  for (const std::byte byte : bytes) {
    a = (a + static_cast<unsigned>(byte)) % 256;
    b = (b + a) % 256;
  }
  return static_cast<std::uint16_t>(a | b << 8);
}
std::uint16_t word_sum(std::span<const std::byte> bytes) {
  unsigned sum = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2)
    sum += static_cast<unsigned>(bytes[i]) | static_cast<unsigned>(bytes[i + 1]) << 8;
  return static_cast<std::uint16_t>(sum);
}
std::uint8_t byte_sum(std::span<const std::byte> bytes) {
  unsigned sum = 0;
  for (const std::byte byte : bytes) sum += static_cast<unsigned>(byte);
  return static_cast<std::uint8_t>(sum);
}

/// Compares the check sums of many ranges, whose beginnings never fall, with those of the definition.
template <class Hash, class Definition>
void compare(const Definition& definition) {
  std::mt19937 random(1);
  std::vector<std::byte> stream(20'000);
  for (std::byte& byte : stream) byte = static_cast<std::byte>(random());
  OverlappingHash<Hash> hash;
  std::size_t at = 0, hashed_alone = 0;
  while (at < stream.size()) {
    const std::size_t length = std::min<std::size_t>((stream.size() - at) / 2 * 2, 2 * (random() % 500));
    const auto range = std::span(stream).subspan(at, length);
    ASSERT_EQ(hash.of(range, at), definition(range)) << at << ' ' << length;
    hashed_alone += length;
    at += random() % 20;
  }
  EXPECT_LE(hash.bytes_hashed(), 2 * stream.size());
  EXPECT_GT(hashed_alone, 20 * stream.size());
}

TEST(OverlappingHash, IsTheDefinition) {
  compare<FletcherHash>(fletcher);
  compare<WordSumHash>(word_sum);
  compare<SumHash>(byte_sum);
  compare<Crc16Hash>([](std::span<const std::byte> bytes) { return crc(bytes, 0x1021, 16); });
  compare<Crc24Hash>([](std::span<const std::byte> bytes) { return crc(bytes, 0x864CFB, 24); });
}

Bytes rtcm(int number, std::size_t content) {
  Bytes out{0xD3, 0, static_cast<std::uint8_t>(content), static_cast<std::uint8_t>(number >> 4),
            static_cast<std::uint8_t>(number << 4)};
  out.resize(3 + content, 0xB5);
  const std::uint32_t sum = crc(std::as_bytes(std::span(out)), 0x864CFB, 24);
  for (int shift = 16; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(sum >> shift));
  return out;
}

TEST(MessageFramer, FindsWhatIsWholeWhereverTheStreamIsCut) {
  const Bytes good = nmea("GPZDA,120000.00,01,03,2026,00,00");
  Bytes broken = nmea("GPZDA,120001.00,01,03,2026,00,00");
  broken[12] ^= 1;
  const Bytes all = bytes_of("# a comment\n") + good + rtcm(1005, 19) + broken + good + Bytes{0xB5, 0x62, 1} + good +
                    bytes_of("$GPZDA,1200");
  for (std::size_t chunk = 1; chunk <= all.size(); ++chunk) {
    UbloxDecoder decoder({});
    const Heard heard = hear(decoder, all, chunk);
    ASSERT_EQ(heard.bytes(), all.size());
    ASSERT_EQ(heard.counts.messages,
              (std::map<std::string, std::uint64_t>{{"GPZDA", 3}, {"RTCM 1005", 1}, {"text", 1}}))
        << chunk;
    ASSERT_EQ(heard.counts.malformed_bytes, broken.size() + 3 + 11);
    ASSERT_EQ(heard.counts.malformed_messages, 3u);
  }
}

TEST(MessageFramer, TakesTimeInProportionToTheBytesOfGarbage) {
  // Each pair of bytes claims a message of 15 kB.
  Bytes garbage;
  for (int i = 0; i < 400'000; ++i) {
    const Bytes head{0xB5, 0x62, 0x01, 0x07, 0x98, 0x3A};
    garbage.insert(garbage.end(), head.begin(), head.end());
  }
  UbloxDecoder decoder({});
  const Heard heard = hear(decoder, garbage, 16384);
  EXPECT_EQ(heard.counts.malformed_bytes, garbage.size());  // hours of work if each claim were hashed alone
}

TEST(MessageFramer, CountsWhatIsHeldAtAnInterruption) {
  NmeaDecoder decoder({});
  std::vector<Measurement> out;
  Packet packet;
  const Bytes cut = bytes_of("$GPZDA,1200");
  packet.bytes = Buffer::copy_of(std::as_bytes(std::span(cut)));
  decoder.decode(packet, out);
  decoder.reset();
  EXPECT_EQ(decoder.counts().malformed_bytes, 11u);
}

TEST(CycleWatch, TellsMessagesThatNeverCame) {
  CycleWatch watch;
  std::uint64_t lost = 0;
  for (int i = 0; i < 200; ++i) {
    if (i == 100 || i == 101) continue;
    if (i == 150) watch.skipped(100, 1);  // it came, but broken
    if (i == 150) continue;
    const HostTime received = host_time_ns(i * 100'000'000LL + 5'000'000);
    watch.take("PVT", gps_time_ns(1'400'000'000'000'000'000 + i * 100'000'000LL), 100, received);
    if (const auto fault = watch.told(1, received)) lost += fault->count;
  }
  watch.finish();
  if (const auto fault = watch.told(1, {}, true)) lost += fault->count;
  EXPECT_EQ(lost, 2u);
}

}  // namespace
}  // namespace hueline::drivers
