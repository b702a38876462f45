// Decoding compared with a copy of the same returns.
#include "drivers/hesai/hesai_decoder.hpp"
#include "tests/drivers/decode_bench.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

test::DecodeWork recorded(const char* file, HesaiModel model) {
  HesaiDecoder::Config config;
  config.model = model;
  const std::size_t bytes = hesai_table(model).least_bytes();
  return {test::decoder_of<HesaiDecoder>(config), test::recorded_packets(std::string("hesai/") + file, bytes)};
}

/// A turn of a scanner without recording, whose returns are random. `mode` is the maker's number of the return mode,
/// `returns` the blocks of the same firings.
test::DecodeWork made(HesaiModel model, unsigned mode, unsigned returns) {
  const HesaiTable& table = hesai_table(model);
  HesaiDecoder::Config config;
  config.model = model;
  test::DecodeWork work{test::decoder_of<HesaiDecoder>(config), {}};
  test::BenchNumbers random;
  unsigned azimuth = 0;
  for (unsigned number = 0; number < 600; ++number) {
    test::ByteWriter out(false);
    out.u8(0xEE).u8(0xFF).u8(6).u8(1).u8(table.least_status).u8(0);
    out.u8(static_cast<unsigned>(table.channels())).u8(static_cast<unsigned>(table.blocks)).u8(0).u8(4).zeros(2);
    for (unsigned block = 0; block < static_cast<unsigned>(table.blocks); ++block) {
      if (block % returns == 0) azimuth = (azimuth + 18) % 36000;
      out.u16(azimuth);
      for (int c = 0; c < table.channels(); ++c)
        out.u16(random.distance(100, 20'000)).u8(random.below(256)).zeros(table.unit - 3);
    }
    out.zeros(table.tail_at() - out.size());
    test::ByteWriter tail(false);
    tail.zeros(table.tail.mode).u8(mode).zeros(table.tail.date - tail.size());
    for (const unsigned part : {123u, 1u, 11u, 1u, 2u, 3u}) tail.u8(part);
    tail.zeros(table.tail.microseconds - tail.size()).u32(100 * number).zeros(table.tail.sequence - tail.size());
    const test::Bytes bytes = out.raw(tail.u32(number).bytes()).bytes();
    work.packets.push_back(test::packet_of(bytes, 100'000 * static_cast<std::int64_t>(number)));
  }
  return work;
}

HUELINE_BENCH_DECODE(pandar40p, recorded("40p_scans.pcap", HesaiModel::Pandar40P));
HUELINE_BENCH_DECODE(xt32, recorded("xt32_scans.pcap", HesaiModel::Xt32));
HUELINE_BENCH_DECODE(ot128_single, made(HesaiModel::Ot128, 0x37, 1));
HUELINE_BENCH_DECODE(ot128_dual, made(HesaiModel::Ot128, 0x39, 2));
HUELINE_BENCH_DECODE(xt32m2x_triple, made(HesaiModel::Xt32m2, 0x3D, 3));

}  // namespace
