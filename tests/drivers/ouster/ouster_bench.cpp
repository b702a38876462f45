// Decoding compared with a copy of the same returns.
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "drivers/ouster/ouster_decoder.hpp"
#include "drivers/ouster/ouster_file.hpp"
#include "tests/drivers/decode_bench.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

test::DecodeWork work_of(const OusterMetadata& metadata, std::vector<Packet> packets) {
  return {[metadata] { return std::make_unique<OusterDecoder>(OusterDecoder::Config{}, metadata); },
          std::move(packets)};
}

/// The real recording of an OS-1 with 64 channels.
test::DecodeWork recorded() {
  const auto text = read_ouster_metadata_file((test::data_dir() / "ouster" / "os1_example.json").string());
  if (!text.ok()) return {};
  return work_of(parse_ouster_metadata(*text).value(), test::recorded_packets("ouster/os1_example.pcap"));
}

/// A turn of a scanner with 128 channels whose pixels are random, one in eight of them without a return.
test::DecodeWork made(const char* profile, bool is_dual) {
  test::OusterText text;
  text.profile = profile;
  text.channels = 128;
  std::vector<Packet> packets;
  std::mt19937 random(7);
  for (int column = 0; column < 1024; column += 16) {
    test::OusterPacket packet;
    packet.channels = 128;
    packet.first_column = column;
    packet.time_ns += static_cast<std::uint64_t>(column) * 100'000;
    packet.pixel.resize(is_dual ? 16 : 4);
    auto bytes = test::ouster_bytes(packet);
    const std::size_t stride = 12 + 128 * packet.pixel.size();
    for (std::size_t c = 0; c < 16; ++c)
      for (std::size_t at = 0; at < 128 * packet.pixel.size(); at += 4) {
        const auto value = static_cast<unsigned>(random());
        const bool is_empty = random() % 8 == 0;
        for (std::size_t b = 0; b < 4; ++b)
          bytes[32 + c * stride + 12 + at + b] = static_cast<std::byte>(is_empty ? 0 : value >> (8 * b) & 0xFFU);
      }
    packets.push_back(test::packet_of(bytes, column * 100'000));
  }
  return work_of(parse_ouster_metadata(test::ouster_metadata(text)).value(), std::move(packets));
}

HUELINE_BENCH_DECODE(os1_legacy, recorded());
HUELINE_BENCH_DECODE(low_rate_128, made("RNG15_RFL8_NIR8", false));
HUELINE_BENCH_DECODE(dual_128, made("RNG19_RFL8_SIG16_NIR16_DUAL", true));

}  // namespace
