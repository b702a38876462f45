#include <benchmark/benchmark.h>

#include "sim/camera_model.hpp"
#include "sim/laser_model.hpp"

namespace {

using namespace hueline::sim;

/// The demo's scene, built once.
struct Bench {
  Bench() : motion(scenario), world(scenario, motion), camera(scenario, motion, world), scanner(scenario, motion, world) {}
  Scenario scenario;
  Motion motion;
  World world;
  PanoramicCamera camera;
  Scanner scanner;
};
const Bench& bench() {
  static const Bench instance;
  return instance;
}

/// One exposure of six lenses; items: pixels. Shadow and outline samples come on top.
void images(benchmark::State& state) {
  std::size_t number = 10;
  std::int64_t pixels = 0;
  for (auto _ : state) {
    const auto image = bench().camera.expose(number, static_cast<unsigned>(state.range(0)));
    benchmark::DoNotOptimize(image.data());
    pixels += static_cast<std::int64_t>(image.size());
    number = 10 + (number + 7) % 40;
  }
  state.SetItemsProcessed(pixels);
  state.counters["images/s"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(images)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Packets of 384 firings; items: firings.
void laser_packets(benchmark::State& state) {
  std::size_t index = 5000;
  for (auto _ : state) benchmark::DoNotOptimize(bench().scanner.fire(index++).returns.data());
  state.SetItemsProcessed(state.iterations() * 384);
}
BENCHMARK(laser_packets)->Unit(benchmark::kMicrosecond);

}  // namespace
