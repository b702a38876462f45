#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/decoder.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/test_data.hpp"

/// Decoding compared with the least effort: copying the same returns, packet by packet, into vectors.
namespace hueline::test {

/// Packets of a scanner, and what makes a decoder of them.
struct DecodeWork {
  std::function<std::unique_ptr<Decoder>()> decoder;
  std::vector<Packet> packets;
};

template <class D>
std::function<std::unique_ptr<Decoder>()> decoder_of(const typename D::Config& config) {
  return [config] { return std::make_unique<D>(config); };
}

/// The datagrams of `size` bytes, or of any size, of a file of the real recordings.
inline std::vector<Packet> recorded_packets(const std::string& file, std::size_t size = 0) {
  std::vector<Packet> packets;
  for (Packet& packet : capture_packets((data_dir() / file).string()))
    if (size == 0 || packet.bytes.size() == size) packets.push_back(std::move(packet));
  return packets;
}

/// The batches that the work makes.
inline std::vector<LaserBatch> batches_of(const DecodeWork& work, std::int64_t& returns) {
  const auto decoder = work.decoder();
  std::vector<Measurement> out;
  for (const Packet& packet : work.packets) decoder->decode(packet, out);
  auto batches = only<LaserBatch>(out);
  returns = 0;
  for (const LaserBatch& batch : batches) returns += static_cast<std::int64_t>(batch.returns.size());
  return batches;
}

inline void bench_decode(benchmark::State& state, const DecodeWork& work) {
  if (work.packets.empty()) return state.SkipWithError(kNoRecording);
  std::int64_t expected = 0, returns = 0;
  const std::size_t batches = batches_of(work, expected).size();
  const auto decoder = work.decoder();
  std::vector<Measurement> out;
  for (auto _ : state) {
    decoder->reset();
    for (const Packet& packet : work.packets) {
      out.clear();
      decoder->decode(packet, out);
      for (const Measurement& m : out)
        if (const auto* batch = std::get_if<LaserBatch>(&m))
          returns += static_cast<std::int64_t>(batch->returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  }
  expect(state, batches >= work.packets.size() && returns == state.iterations() * expected && returns > 0,
         "every packet's returns are decoded");
  state.SetItemsProcessed(returns);
}

inline void bench_copy(benchmark::State& state, const DecodeWork& work) {
  if (work.packets.empty()) return state.SkipWithError(kNoRecording);
  std::int64_t expected = 0, returns = 0;
  const std::vector<LaserBatch> batches = batches_of(work, expected);
  std::vector<Measurement> out;
  for (auto _ : state)
    for (const LaserBatch& batch : batches) {
      out.clear();
      out.emplace_back(batch);
      returns += static_cast<std::int64_t>(std::get<LaserBatch>(out[0]).returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  expect(state, returns == state.iterations() * expected && returns > 0, "every return is copied");
  state.SetItemsProcessed(returns);
}

/// Random numbers as packets have them: one distance in eight is none.
class BenchNumbers {
 public:
  unsigned below(unsigned count) { return static_cast<unsigned>(random_() % count); }
  unsigned distance(unsigned least, unsigned count) { return below(8) == 0 ? 0 : least + below(count); }

 private:
  std::mt19937 random_{7};
};

}  // namespace hueline::test

/// Benchmarks `decode/name` and `copy/name` of the DecodeWork that `work` is.
#define HUELINE_BENCH_DECODE(name, work)                                                    \
  void decode_##name(benchmark::State& state) { hueline::test::bench_decode(state, work); } \
  void copy_##name(benchmark::State& state) { hueline::test::bench_copy(state, work); }     \
  BENCHMARK(decode_##name)->Name("decode/" #name);                                          \
  BENCHMARK(copy_##name)->Name("copy/" #name)
