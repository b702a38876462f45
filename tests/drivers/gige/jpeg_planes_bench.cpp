// A Ladybug5's exposure, 24 JPEGs of 1224 x 1024, decoded into the mosaic. It is compared with turbojpeg, which decodes
// the same JPEGs one after the other into planes, and with a copy of the mosaic. The pictures are those of the street,
// rendered once, with the sensor's noise.
#include <turbojpeg.h>

#include <cstdlib>
#include <cstring>
#include <thread>

#include "sim/camera_model.hpp"
#include "tests/drivers/gige/jpeg_planes_packets.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline;

constexpr std::uint32_t kColumns = 3;
const std::uint32_t kWidth = test::sized(2448u, 408u), kHeight = test::sized(2048u, 340u);

struct Exposure {
  std::vector<std::uint8_t> mosaic;
  std::vector<std::byte> planes[2];  // at quality 85 and 95
};
const Exposure& exposure() {
  static const Exposure made = [] {
    sim::Scenario scenario;
    scenario.camera.lens_width = static_cast<int>(kWidth);
    scenario.camera.lens_height = static_cast<int>(kHeight);
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

/// Returns the mean difference in grey levels between the first `lenses` lens images and those of the mosaic, or 255 if
/// the image has another size.
double difference(const Measurement& measured, std::uint32_t lenses) {
  const auto* image = std::get_if<Image>(&measured);
  const auto& mosaic = exposure().mosaic;
  if (!image || image->pixels().size() < mosaic.size() || image->stride != kColumns * kWidth) return 255;
  std::size_t sum = 0, compared = 0;
  for (std::size_t i = 0; i < mosaic.size(); ++i) {
    const auto x = static_cast<std::uint32_t>(i % image->stride), y = static_cast<std::uint32_t>(i / image->stride);
    if (y / kHeight * kColumns + x / kWidth >= lenses) continue;
    sum += static_cast<std::size_t>(std::abs(static_cast<int>(image->pixels()[i]) - mosaic[i]));
    ++compared;
  }
  return static_cast<double>(sum) / static_cast<double>(compared);
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
  test::expect(state, to == exposure().mosaic, "the mosaic is copied");
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
        if (tjDecompress2(turbo, reinterpret_cast<const unsigned char*>(planes.data() + at.offset), at.size,
                          plane.data(), kWidth / 2, 0, kHeight / 2, TJPF_GRAY, TJFLAG_ACCURATEDCT) != 0)
          return state.SkipWithError("a plane is broken");
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
    benchmark::DoNotOptimize(out.data());
  }
  test::expect(state, out.size() == 1 && difference(out[0], static_cast<std::uint32_t>(state.range(1))) < 5,
               "the mosaic is the one that was encoded");
  note(state);
  state.counters["MB_a_exposure"] = static_cast<double>(planes.size()) * 1e-6;
}
BENCHMARK(decode)->ArgsProduct({{0, 1}, {6, 5}})->ArgNames({"quality 85, 95", "lenses"})->Unit(benchmark::kMillisecond);

}  // namespace
