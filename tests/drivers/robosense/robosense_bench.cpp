// Decoding compared with a copy of the same returns. The returns are random.
#include "drivers/robosense/robosense_decoder.hpp"
#include "tests/drivers/decode_bench.hpp"
#include "tests/drivers/robosense/robosense_packets.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

constexpr unsigned kPackets = 300;

/// Packets of a scanner that rotates. With two returns a firing blocks come in pairs.
test::DecodeWork rotating(std::array<unsigned, 3> type, bool is_dual) {
  test::RobosenseDifop difop;
  difop.returns = is_dual ? 0 : 1;
  const test::Bytes description = difop.bytes();
  test::DecodeWork work;
  work.decoder = [description] { return std::make_unique<RobosenseDecoder>(RobosenseDecoder::Config{}, description); };
  test::BenchNumbers random;
  for (unsigned number = 0; number < kPackets; ++number) {
    const unsigned us = 600 * number;
    test::RobosensePoints points;
    points.type = type;
    points.time =
        test::ByteWriter(true).u8(23).u8(11).u8(14).u8(22).u8(13).u8(20).u16(us / 1000).u16(us % 1000).bytes();
    points.azimuth = [&](unsigned block) { return (number * 240 + (is_dual ? block / 2 * 2 : block) * 20) % 36000; };
    points.range = [&](unsigned, unsigned) { return random.distance(100, 20'000); };
    work.packets.push_back(test::packet_of(points.bytes(), 1000 * static_cast<std::int64_t>(us)));
  }
  return work;
}

/// Packets of an M1.
test::DecodeWork solid() {
  test::DecodeWork work{test::decoder_of<RobosenseDecoder>({}), {}};
  test::BenchNumbers random;
  for (unsigned number = 0; number < kPackets; ++number) {
    const unsigned us = 160 * number;
    test::ByteWriter out(true);
    out.u32(0x55AA5AA5).u16(number + 1).zeros(2).u8(1).u8(0).zeros(2).u32(1'700'000'000).u32(us).zeros(12);
    for (unsigned block = 0; block < 25; ++block) {
      out.u8(6 * block).u8(1);
      for (unsigned point = 0; point < 5; ++point)
        out.u16(random.distance(100, 30'000))
            .u16(31518 + random.below(2500))
            .u16(26768 + random.below(12'000))
            .u8(7)
            .zeros(2);
    }
    out.zeros(1210 - out.size());
    work.packets.push_back(test::packet_of(out.bytes(), 1000 * static_cast<std::int64_t>(us)));
  }
  return work;
}

HUELINE_BENCH_DECODE(rs32_single, rotating({0, 2, 0}, false));
HUELINE_BENCH_DECODE(rs32_dual, rotating({0, 2, 0}, true));
HUELINE_BENCH_DECODE(m1, solid());

}  // namespace
