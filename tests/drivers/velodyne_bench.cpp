// Decoding against the floor: copying the same returns, packet by packet, into vectors of their own.
#include <benchmark/benchmark.h>

#include "tests/drivers/velodyne_packets.hpp"
#include "tests/support/test_data.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

struct Capture {
  std::vector<Packet> packets;
  std::vector<LaserBatch> batches;
  std::int64_t returns = 0;
};

Capture load(const char* file, VelodyneModel model) {
  Capture capture;
  for (Packet& packet : test::capture_packets((test::data_dir() / "velodyne" / file).string()))
    if (packet.bytes.size() == kVelodyneDataBytes) capture.packets.push_back(std::move(packet));
  VelodyneDecoder::Config config;
  config.model = model;
  VelodyneDecoder decoder(1, config);
  std::vector<Measurement> out;
  for (const Packet& packet : capture.packets) decoder.decode(packet, out);
  capture.batches = test::only<LaserBatch>(out);
  for (const LaserBatch& batch : capture.batches) capture.returns += static_cast<std::int64_t>(batch.returns.size());
  return capture;
}

void decode(benchmark::State& state, const char* file, VelodyneModel model) {
  const Capture capture = load(file, model);
  if (capture.packets.empty()) return state.SkipWithError("recording not present");
  VelodyneDecoder::Config config;
  config.model = model;
  VelodyneDecoder decoder(1, config);
  std::vector<Measurement> out;
  for (auto _ : state) {
    decoder.reset();
    for (const Packet& packet : capture.packets) {
      out.clear();
      decoder.decode(packet, out);
      benchmark::DoNotOptimize(out.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * capture.returns);
}

void copy(benchmark::State& state, const char* file, VelodyneModel model) {
  const Capture capture = load(file, model);
  if (capture.packets.empty()) return state.SkipWithError("recording not present");
  std::vector<Measurement> out;
  for (auto _ : state)
    for (const LaserBatch& batch : capture.batches) {
      out.clear();
      out.emplace_back(batch);
      benchmark::DoNotOptimize(out.data());
    }
  state.SetItemsProcessed(state.iterations() * capture.returns);
}

BENCHMARK_CAPTURE(decode, vlp16_dual, "vlp16_scans.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(copy, vlp16_dual, "vlp16_scans.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(decode, vlp16_single, "vlp16_gps.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(copy, vlp16_single, "vlp16_gps.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(decode, hdl32e_single, "hdl32e.pcap", VelodyneModel::Hdl32e);
BENCHMARK_CAPTURE(copy, hdl32e_single, "hdl32e.pcap", VelodyneModel::Hdl32e);

}  // namespace
