#include "sync/synchroniser.hpp"
#include "tests/support/bench.hpp"
#include "tests/sync/simulated_rig.hpp"

/// Measures the cost of stamping, with laser batches of 384 returns, in a locked rig with one camera and one POS.
namespace hueline::sync {
namespace {

using namespace hueline::test;

void stamp(benchmark::State& state, SyncState clock) {
  Drive drive(some_begin(), seconds(sized(40, 10)));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20));
  drive.ins(100, late(4, 2));
  SimulatedLaser laser;
  laser.rate_hz = 754;
  laser.clock = [=](GpsTime) { return clock; };
  laser.run(drive);
  SimulatedCamera camera;
  camera.run(drive);
  Synchroniser::Config config;
  config.clock.pps = kPps;
  config.clock.label.trusted = kPos;
  config.pos = kPos;
  config.lasers.resize(1);
  config.lasers[0].sensor = kLaser;
  config.cameras.resize(1);
  config.cameras[0].camera = kCamera;
  config.hold_images = 400;  // from the seconds before the clock locks; these images have no pixels
  const auto& items = drive.stream.sorted();
  std::int64_t batches = 0, as_meant = 0;
  for (auto run : state) {
    state.PauseTiming();
    Synchroniser sync(config);
    std::vector<Measurement> copies;
    for (const auto& item : items) copies.push_back(item.second);
    for (Measurement& m : copies)
      if (auto* batch = std::get_if<LaserBatch>(&m)) batch->returns.resize(384);
    SyncOutput out;
    state.ResumeTiming();
    for (Measurement& m : copies) {
      sync.process(std::move(m), out);
      batches += static_cast<std::int64_t>(out.laser.size());
      out.clear();
    }
    sync.flush(out);
    batches += static_cast<std::int64_t>(out.laser.size());
    state.PauseTiming();
    const auto& counts = sync.lasers()[0].counts();
    as_meant += static_cast<std::int64_t>(clock == SyncState::Locked ? counts.disciplined : counts.by_arrival);
    benchmark::DoNotOptimize(out);
    copies.clear();
    state.ResumeTiming();
  }
  expect(state,
         batches == state.iterations() * static_cast<std::int64_t>(laser.truth.size()) && as_meant > batches * 9 / 10,
         "every batch is stamped, and in the way that is measured");
  state.counters["batches/s"] = benchmark::Counter(static_cast<double>(batches), benchmark::Counter::kIsRate);
  state.counters["per_batch"] =
      benchmark::Counter(static_cast<double>(batches), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(stamp, disciplined, SyncState::Locked)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stamp, by_arrival, SyncState::Unlocked)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hueline::sync
