// Decoding compared with the least effort: copying the same returns, packet by packet, into vectors.
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/bench.hpp"
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
  VelodyneDecoder decoder(config);
  std::vector<Measurement> out;
  for (const Packet& packet : capture.packets) decoder.decode(packet, out);
  capture.batches = test::only<LaserBatch>(out);
  for (const LaserBatch& batch : capture.batches) capture.returns += static_cast<std::int64_t>(batch.returns.size());
  return capture;
}

void decode(benchmark::State& state, const char* file, VelodyneModel model) {
  const Capture capture = load(file, model);
  if (capture.packets.empty()) return state.SkipWithError(test::kNoRecording);
  VelodyneDecoder::Config config;
  config.model = model;
  VelodyneDecoder decoder(config);
  std::vector<Measurement> out;
  std::int64_t returns = 0;
  for (auto _ : state) {
    decoder.reset();
    for (const Packet& packet : capture.packets) {
      out.clear();
      decoder.decode(packet, out);
      for (const Measurement& m : out)
        if (const auto* batch = std::get_if<LaserBatch>(&m))
          returns += static_cast<std::int64_t>(batch->returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  }
  test::expect(state,
               capture.batches.size() >= capture.packets.size() && returns == state.iterations() * capture.returns &&
                   returns > 0,
               "every packet's returns are decoded");
  state.SetItemsProcessed(returns);
}

void copy(benchmark::State& state, const char* file, VelodyneModel model) {
  const Capture capture = load(file, model);
  if (capture.packets.empty()) return state.SkipWithError(test::kNoRecording);
  std::vector<Measurement> out;
  std::int64_t returns = 0;
  for (auto _ : state)
    for (const LaserBatch& batch : capture.batches) {
      out.clear();
      out.emplace_back(batch);
      returns += static_cast<std::int64_t>(std::get<LaserBatch>(out[0]).returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  test::expect(state, returns == state.iterations() * capture.returns && returns > 0, "every return is copied");
  state.SetItemsProcessed(returns);
}

BENCHMARK_CAPTURE(decode, vlp16_dual, "vlp16_scans.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(copy, vlp16_dual, "vlp16_scans.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(decode, vlp16_single, "vlp16_gps.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(copy, vlp16_single, "vlp16_gps.pcap", VelodyneModel::Vlp16);
BENCHMARK_CAPTURE(decode, hdl32e_single, "hdl32e.pcap", VelodyneModel::Hdl32e);
BENCHMARK_CAPTURE(copy, hdl32e_single, "hdl32e.pcap", VelodyneModel::Hdl32e);
BENCHMARK_CAPTURE(decode, vlp32c_single, "vlp32_scans.pcap", VelodyneModel::Vlp32c);
BENCHMARK_CAPTURE(copy, vlp32c_single, "vlp32_scans.pcap", VelodyneModel::Vlp32c);
BENCHMARK_CAPTURE(decode, vls128_single, "vls128_scans.pcap", VelodyneModel::Vls128);
BENCHMARK_CAPTURE(copy, vls128_single, "vls128_scans.pcap", VelodyneModel::Vls128);

}  // namespace
