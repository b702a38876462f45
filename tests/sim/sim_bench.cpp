#include <algorithm>

#include "sim/camera_model.hpp"
#include "sim/laser_model.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline::sim;

/// The scene of the demo, built once.
struct Bench {
  Bench()
      : motion(scenario), world(scenario, motion), camera(scenario, motion, world), scanner(scenario, motion, world) {}
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

/// Measures one exposure of six lenses; an item is a pixel. Samples of shadows and outlines are not counted as items.
void images(benchmark::State& state) {
  std::size_t number = 10;
  std::int64_t pixels = 0;
  bool is_seen = true;
  for (auto _ : state) {
    const auto image = bench().camera.expose(number, static_cast<unsigned>(state.range(0)));
    benchmark::DoNotOptimize(image.data());
    pixels += static_cast<std::int64_t>(image.size());
    number = 10 + (number + 7) % 40;
    const auto [darkest, brightest] = std::minmax_element(
        image.begin(), image.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(image.size(), 10'000)));
    is_seen = is_seen && darkest != brightest && *brightest > *darkest + 20;
  }
  const auto& camera = bench().scenario.camera;
  hueline::test::expect(state, is_seen && pixels == state.iterations() * 6 * camera.lens_width * camera.lens_height,
                        "every lens has a picture of the street");
  state.SetItemsProcessed(pixels);
  state.counters["images/s"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(images)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Measures packets of 384 firings; an item is a firing.
void laser_packets(benchmark::State& state) {
  std::size_t index = 5000;
  std::size_t returns = 0;
  for (auto _ : state) {
    const FiredPacket fired = bench().scanner.fire(index);
    benchmark::DoNotOptimize(fired.returns.data());
    returns += fired.returns.size();
    index = 5000 + (index + 1) % 10'000;
  }
  hueline::test::expect(state, returns > static_cast<std::size_t>(state.iterations()) * 384 / 4,
                        "firings hit something");
  state.SetItemsProcessed(state.iterations() * 384);
}
BENCHMARK(laser_packets)->Unit(benchmark::kMicrosecond);

}  // namespace
