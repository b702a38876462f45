// Decoding compared with the least effort: copying the same returns, datagram by datagram, into vectors.
#include "tests/drivers/profile_scanner/profile_scanner_packets.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline;

struct Workload {
  std::vector<Packet> packets;
  std::int64_t returns = 0;
};

/// A tenth of a second of a scanner with 1.2 M pulses and 250 lines a second. A sixth of the pulses meet the sky, and a
/// sixth meet leaves, which give three returns.
Workload datagrams(unsigned pulses_per_datagram, bool has_jitter) {
  Workload out;
  std::uint64_t pulse = 0;
  for (std::uint32_t counter = 0; pulse < 120'000; ++counter) {
    test::ProfileDatagram d;
    d.counter = counter;
    d.angle = static_cast<std::uint32_t>(pulse * 894'785);
    d.step = 894'785 + (has_jitter ? static_cast<std::int32_t>(counter % 7) : 0);
    d.period_ps = 833'333;
    for (unsigned i = 0; i < pulses_per_datagram; ++i, ++pulse) {
      const std::uint32_t range = 50'000 + static_cast<std::uint32_t>(pulse * 7919 % 500'000);
      if (pulse / 64 % 6 == 0)
        d.pulses.push_back({});
      else if (pulse / 64 % 6 == 1)
        d.pulses.push_back({{range, 900}, {range + 8000, 500}, {range + 20'000, 3000}});
      else
        d.pulses.push_back({{range, 4000}});
      out.returns += static_cast<std::int64_t>(d.pulses.back().size());
    }
    out.packets.push_back(test::profile_packet(d.bytes()));
  }
  return out;
}

void decode(benchmark::State& state, unsigned pulses, bool has_jitter) {
  const Workload work = datagrams(pulses, has_jitter);
  drivers::ProfileScannerDecoder decoder({});
  std::vector<Measurement> out;
  std::int64_t returns = 0, bytes = 0;
  for (const Packet& packet : work.packets) bytes += static_cast<std::int64_t>(packet.bytes.size());
  for (auto _ : state) {
    decoder.reset();
    for (const Packet& packet : work.packets) {
      out.clear();
      decoder.decode(packet, out);
      if (const auto* batch = std::get_if<LaserBatch>(&out.back()))
        returns += static_cast<std::int64_t>(batch->returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  }
  test::expect(state, returns == state.iterations() * work.returns, "every return is decoded");
  state.SetItemsProcessed(returns);
  state.SetBytesProcessed(state.iterations() * bytes);
}

void copy(benchmark::State& state, unsigned pulses) {
  std::vector<Measurement> decoded;
  drivers::ProfileScannerDecoder decoder({});
  const Workload work = datagrams(pulses, false);
  for (const Packet& packet : work.packets) decoder.decode(packet, decoded);
  std::vector<Measurement> out;
  std::int64_t returns = 0;
  for (auto _ : state)
    for (const Measurement& batch : decoded) {
      out.clear();
      out.push_back(batch);
      returns += static_cast<std::int64_t>(std::get<LaserBatch>(out[0]).returns.size());
      benchmark::DoNotOptimize(out.data());
    }
  test::expect(state, returns == state.iterations() * work.returns, "every return is copied");
  state.SetItemsProcessed(returns);
}

BENCHMARK_CAPTURE(decode, datagrams_1500, 190, false);
BENCHMARK_CAPTURE(decode, datagrams_1500_uneven_mirror, 190, true);
BENCHMARK_CAPTURE(copy, datagrams_1500, 190);
BENCHMARK_CAPTURE(decode, datagrams_9000, 1200, false);
BENCHMARK_CAPTURE(copy, datagrams_9000, 1200);

}  // namespace
