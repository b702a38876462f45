// A Ladybug5's exposure, 24 JPEGs of 1224 x 1024, into the mosaic, against turbojpeg decoding the same JPEGs one after the other into
// planes, and against a copy of the mosaic. The pictures are those of the street, rendered once, with the sensor's noise.
#include <benchmark/benchmark.h>
#include <turbojpeg.h>

#include <cstring>
#include <thread>

#include "sim/camera_model.hpp"
#include "tests/drivers/jpeg_planes_packets.hpp"

namespace {

using namespace hueline;

constexpr std::uint32_t kColumns = 3, kWidth = 2448, kHeight = 2048;

struct Exposure {
  std::vector<std::uint8_t> mosaic;
  std::vector<std::byte> planes[2];  // at quality 85 and 95
};
const Exposure& exposure() {
  static const Exposure made = [] {
    sim::Scenario scenario;
    scenario.camera.lens_width = kWidth;
    scenario.camera.lens_height = kHeight;
    const sim::Motion motion(scenario);
    const sim::World world(scenario, motion);
    Exposure out;
    out.mosaic = sim::PanoramicCamera(scenario, motion, world).expose(20, std::thread::hardware_concurrency());
    out.planes[0] = test::jpeg_planes(out.mosaic, kColumns * kWidth, kColumns, 85);
    out.planes[1] = test::jpeg_planes(out.mosaic, kColumns * kWidth, kColumns, 95);
    return out;
  }();
  return made;
}

void note(benchmark::State& state) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(exposure().mosaic.size()));
  state.SetItemsProcessed(state.iterations());
}

void copy(benchmark::State& state) {
  std::vector<std::uint8_t> to(exposure().mosaic.size());
  for (auto _ : state) {
    std::memcpy(to.data(), exposure().mosaic.data(), to.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  note(state);
}
BENCHMARK(copy)->Unit(benchmark::kMillisecond);

void turbojpeg(benchmark::State& state) {
  const auto& planes = exposure().planes[state.range(0)];
  tjhandle turbo = tjInitDecompress();
  std::vector<unsigned char> plane(kWidth / 2 * kHeight / 2);
  for (auto _ : state)
    for (std::size_t lens = 0; lens < 6; ++lens)
      for (std::size_t slot = 0; slot < 4; ++slot) {
        const auto at = test::placed(planes, lens, slot);
        if (tjDecompress2(turbo, reinterpret_cast<const unsigned char*>(planes.data() + at.offset), at.size, plane.data(), kWidth / 2, 0, kHeight / 2,
                          TJPF_GRAY, TJFLAG_ACCURATEDCT) != 0)
          state.SkipWithError("a plane is broken");
        benchmark::DoNotOptimize(plane.data());
      }
  tjDestroy(turbo);
  note(state);
}
BENCHMARK(turbojpeg)->Arg(0)->Arg(1)->ArgName("quality 85, 95")->Unit(benchmark::kMillisecond);

void decode(benchmark::State& state) {
  const auto& planes = exposure().planes[state.range(0)];
  drivers::ImageDecoder::Config config = test::planes_config(kColumns, kWidth, kHeight);
  config.planes.is_used[5] = state.range(1) == 6;  // the one that looks up
  drivers::ImageDecoder decoder(config);
  const Packet packet = test::planes_packet(planes);
  std::vector<Measurement> out;
  for (auto _ : state) {
    out.clear();
    decoder.reset();
    decoder.decode(packet, out);
    if (out.size() != 1) state.SkipWithError("the exposure is broken");
  }
  note(state);
  state.counters["MB_a_exposure"] = static_cast<double>(planes.size()) * 1e-6;
}
BENCHMARK(decode)->ArgsProduct({{0, 1}, {6, 5}})->ArgNames({"quality 85, 95", "lenses"})->Unit(benchmark::kMillisecond);

}  // namespace
