// Decoding compared with a copy of the same returns. The returns are random.
#include "drivers/livox/livox_decoder.hpp"
#include "tests/drivers/decode_bench.hpp"
#include "tests/drivers/livox/livox_packets.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

constexpr unsigned kPackets = 300, kPoints = 96;

/// Packets of the second generation in a form with one return, whose points `add` writes.
template <class Add>
test::DecodeWork second_generation(unsigned form, const Add& add) {
  test::DecodeWork work{test::decoder_of<LivoxDecoder>({}), {}};
  test::BenchNumbers random;
  for (unsigned number = 0; number < kPackets; ++number) {
    test::ByteWriter points(false);
    for (unsigned k = 0; k < kPoints; ++k) add(points, random);
    test::LivoxSecond packet;
    packet.data_type = form;
    packet.sequence = number;
    packet.time_ns += 480'000 * number;
    work.packets.push_back(
        test::packet_of(packet.bytes(points.bytes(), kPoints), 480'000 * static_cast<std::int64_t>(number)));
  }
  return work;
}

/// One coordinate of a point, one in eight of which is in the origin.
void add_place(test::ByteWriter& out, test::BenchNumbers& random, bool is_short) {
  const bool is_none = random.below(8) == 0;
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t value = is_none ? 0 : random.below(20'000) - 10'000;
    is_short ? out.u16(value & 0xFFFF) : out.u32(value);
  }
}

test::DecodeWork cartesian() {
  return second_generation(0x01, [](test::ByteWriter& out, test::BenchNumbers& random) {
    add_place(out, random, false);
    out.u8(random.below(256)).u8(0);
  });
}
test::DecodeWork cartesian_short() {
  return second_generation(0x02, [](test::ByteWriter& out, test::BenchNumbers& random) {
    add_place(out, random, true);
    out.u8(random.below(256)).u8(0);
  });
}
test::DecodeWork spherical() {
  return second_generation(0x03, [](test::ByteWriter& out, test::BenchNumbers& random) {
    out.u32(random.distance(500, 100'000))
        .u16(random.below(18'000))
        .u16(random.below(36'000))
        .u8(random.below(256))
        .u8(0);
  });
}
test::DecodeWork dual() {
  return second_generation(0x11, [](test::ByteWriter& out, test::BenchNumbers& random) {
    for (int i = 0; i < 2; ++i) {
      add_place(out, random, false);
      out.u8(random.below(256)).u8(0);
    }
  });
}

HUELINE_BENCH_DECODE(cartesian, cartesian());
HUELINE_BENCH_DECODE(cartesian_short, cartesian_short());
HUELINE_BENCH_DECODE(spherical, spherical());
HUELINE_BENCH_DECODE(dual, dual());

}  // namespace
