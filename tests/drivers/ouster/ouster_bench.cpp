// Decoding compared with the least effort: copying the same returns, packet by packet, into vectors.
#include <optional>
#include <random>

#include "drivers/ouster/ouster_decoder.hpp"
#include "drivers/ouster/ouster_file.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/test_data.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

struct Drive {
  std::optional<OusterMetadata> metadata;
  std::vector<Packet> packets;
  std::vector<LaserBatch> batches;
  std::int64_t returns = 0;
};

/// The real recording of an OS-1 with 64 channels.
Drive recorded() {
  Drive drive;
  if (const auto text = read_ouster_metadata_file((test::data_dir() / "ouster" / "os1_example.json").string());
      text.ok())
    if (const auto metadata = parse_ouster_metadata(*text); metadata.ok()) drive.metadata = *metadata;
  drive.packets = test::capture_packets((test::data_dir() / "ouster" / "os1_example.pcap").string());
  return drive;
}

/// A turn of a scanner with 128 channels whose pixels are random, one in eight of them without a return.
Drive made(const char* profile, bool is_dual) {
  Drive drive;
  test::OusterText text;
  text.profile = profile;
  text.channels = 128;
  drive.metadata = parse_ouster_metadata(test::ouster_metadata(text)).value();
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
    drive.packets.push_back(test::packet_of(bytes, column * 100'000));
  }
  return drive;
}

Drive load(int kind) {
  Drive drive = kind == 0   ? recorded()
                : kind == 1 ? made("RNG15_RFL8_NIR8", false)
                            : made("RNG19_RFL8_SIG16_NIR16_DUAL", true);
  OusterDecoder decoder({}, drive.metadata);
  std::vector<Measurement> out;
  for (const Packet& packet : drive.packets) decoder.decode(packet, out);
  drive.batches = test::only<LaserBatch>(out);
  for (const LaserBatch& batch : drive.batches) drive.returns += static_cast<std::int64_t>(batch.returns.size());
  return drive;
}

void decode(benchmark::State& state, int kind) {
  const Drive drive = load(kind);
  if (drive.packets.empty()) return state.SkipWithError(test::kNoRecording);
  OusterDecoder decoder({}, drive.metadata);
  std::vector<Measurement> out;
  std::int64_t returns = 0;
  for (auto _ : state) {
    decoder.reset();
    for (const Packet& packet : drive.packets) {
      out.clear();
      decoder.decode(packet, out);
      for (const Measurement& m : out)
        if (const auto* batch = std::get_if<LaserBatch>(&m))
          returns += static_cast<std::int64_t>(batch->returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  }
  test::expect(
      state,
      drive.batches.size() == drive.packets.size() && returns == state.iterations() * drive.returns && returns > 0,
      "every packet's returns are decoded");
  state.SetItemsProcessed(returns);
}

void copy(benchmark::State& state, int kind) {
  const Drive drive = load(kind);
  if (drive.packets.empty()) return state.SkipWithError(test::kNoRecording);
  std::vector<Measurement> out;
  std::int64_t returns = 0;
  for (auto _ : state)
    for (const LaserBatch& batch : drive.batches) {
      out.clear();
      out.emplace_back(batch);
      returns += static_cast<std::int64_t>(std::get<LaserBatch>(out[0]).returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  test::expect(state, returns == state.iterations() * drive.returns && returns > 0, "every return is copied");
  state.SetItemsProcessed(returns);
}

BENCHMARK_CAPTURE(decode, os1_legacy, 0);
BENCHMARK_CAPTURE(copy, os1_legacy, 0);
BENCHMARK_CAPTURE(decode, low_rate_128, 1);
BENCHMARK_CAPTURE(copy, low_rate_128, 1);
BENCHMARK_CAPTURE(decode, dual_128, 2);
BENCHMARK_CAPTURE(copy, dual_128, 2);

}  // namespace
