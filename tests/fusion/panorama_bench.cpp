#include <algorithm>
#include <chrono>
#include <ctime>
#include <numbers>

#include "fusion/panorama_renderer.hpp"
#include "fusion/worker_pool.hpp"
#include "tests/fusion/drive.hpp"
#include "tests/support/bench.hpp"

/// Measures the rendering of a panorama from six lenses of 2448 x 2048 raw Bayer pixels, from the laser points to the
/// picture, compared with the plain stitching of the same images on a sphere with hard seams.
namespace hueline::fusion {
namespace {
using namespace hueline::test;
using Clock = std::chrono::steady_clock;

/// Returns the processor time of all threads in seconds. It can be compared even if the machine has other work.
double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
using std::numbers::pi;

struct Workload {
  RigGeometry rig = ladybug_rig(LensModel::KannalaBrandt);
  Image image;
  std::vector<Eigen::Vector3f> points;
  PanoramaView view;
};

const Workload& workload() {
  static const Workload made = [] {
    Workload w;
    const std::uint32_t scale = sized(8u, 1u), width = 306 * scale, height = 256 * scale;
    for (std::size_t i = 0; i < w.rig.head.lenses.size(); ++i) {
      LensMount& lens = w.rig.head.lenses[i];
      lens.intrinsics.width = width;
      lens.intrinsics.height = height;
      lens.intrinsics.focal_px *= scale;
      lens.intrinsics.principal_point_px *= scale;
      lens.y_offset = height * static_cast<std::uint32_t>(i);
    }
    w.image = make_image(width, 6 * height, PixelFormat::BayerRG8, [](std::uint32_t x, std::uint32_t y, int c) {
      return static_cast<double>((x * 7 + y * 13 + static_cast<unsigned>(c) * 50) & 127u) + 60;
    });
    // A million points on a road 2.5 m below and on facades 8 m to both sides.
    const int count = sized(1'000'000, 10'000);
    for (int i = 0; i < count; ++i) {
      const double azimuth = i * 2.399963, polar = 0.3 + 2.5 * (i % 9973) / 9973.0;
      const Vector3 direction(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                              std::cos(polar));
      const double to_road = direction.z() < 0 ? 2.5 / -direction.z() : 1e9,
                   to_wall = 8 / std::max(1e-3, std::abs(direction.y()));
      w.points.push_back((std::min({to_road, to_wall, 80.0}) * direction).cast<float>());
    }
    w.view.shape.width = sized(8192u, 256u);
    w.view.shape.height = w.view.shape.width / 2;
    return w;
  }();
  return made;
}

struct Cost {
  double seconds, cpu_seconds, seen_share;
};
/// Makes a panorama.
Cost cost_of(const Workload& w, const PanoramaRenderer& renderer, bool use_depth, int threads) {
  WorkerPool pool(threads);
  DepthPanorama depth({});
  const RawView raw = view_of(w.image);
  const auto start = Clock::now();
  const double cpu_start = cpu_seconds();
  if (use_depth) {
    depth.add(w.points, pool);
    depth.close(pool);
  }
  const auto made = renderer.render(w.view, {std::span(&raw, 1)}, {}, use_depth ? &depth : nullptr, pool);
  return {std::chrono::duration<double>(Clock::now() - start).count(), cpu_seconds() - cpu_start, made.seen_share};
}

void panorama(benchmark::State& state, bool use_depth) {
  const Workload& w = workload();
  const auto threads = static_cast<int>(state.range(0));
  const PanoramaRenderer renderer(w.rig.head, {}),
      stitcher(w.rig.head, {.blend = PanoramaBlend::None, .even_gains = false});
  double best = 1e9, cpu = 1e9, plain_cpu = 1e9, seen = 0;
  for (auto _ : state) {
    const Cost cost = cost_of(w, renderer, use_depth, threads);
    plain_cpu = std::min(plain_cpu, cost_of(w, stitcher, false, threads).cpu_seconds);
    best = std::min(best, cost.seconds);
    cpu = std::min(cpu, cost.cpu_seconds);
    seen = cost.seen_share;
    state.SetIterationTime(cost.seconds);
  }
  expect(state, seen > 0.6, "most of the sphere is seen");
  const double pixels = static_cast<double>(w.view.shape.width) * w.view.shape.height;
  state.counters["Mpixel/s"] = pixels / best / 1e6;
  state.counters["cpu_ns/pixel"] = cpu * 1e9 / pixels;
  state.counters["stitching_cpu_ns/pixel"] = plain_cpu * 1e9 / pixels;
  state.counters["ratio"] = cpu / plain_cpu;
}

BENCHMARK_CAPTURE(panorama, depth, true)->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(panorama, sphere, false)->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hueline::fusion
