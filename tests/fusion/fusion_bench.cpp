#include <algorithm>
#include <chrono>
#include <ctime>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "fusion/colouring.hpp"
#include "fusion/depth_map.hpp"
#include "tests/fusion/drive.hpp"
#include "tests/support/bench.hpp"

/// Measures the cost of a point in the whole stage (placing, choosing exposure and lens, projecting, sampling),
/// compared with only reading the same pixels from the same images in the same order. The images are raw Bayer of six
/// lenses of 2448 x 2048; the scanner has 32 rings.
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

const double kSeconds = sized(2.0, 0.5), kPacketRate = sized(3000, 300);
constexpr double kInterval = 0.5;
const std::uint32_t kScale = sized(8u, 1u);  // of the rig's small lenses
const std::uint32_t kWidth = 306 * kScale, kHeight = 256 * kScale;
constexpr int kFirings = 12, kRings = 32;  // 1.15 million returns a second

struct Workload {
  Drive drive{Motion{}};
  RigGeometry rig;
  std::vector<InsSolution> solutions;
  std::vector<StampedLaserBatch> batches;
  std::vector<Exposure> exposures;
  std::size_t returns = 0;
};

/// Returns the distance along a beam to a road, or to the house fronts of a round square about the start.
double to_square(const Vector3& from, const Vector3& beam) {
  constexpr double kRadius = 60;
  const double to_road = beam.z() < 0 ? from.z() / -beam.z() : 1e9;
  const double a = beam.head<2>().squaredNorm(), b = from.head<2>().dot(beam.head<2>()),
               c = from.head<2>().squaredNorm() - kRadius * kRadius;
  return std::min(to_road, (-b + std::sqrt(b * b - a * c)) / a);
}

const Workload& workload(LensModel model) {
  static std::map<LensModel, Workload> made;
  const auto [it, is_new] = made.try_emplace(model);
  Workload& w = it->second;
  if (!is_new) return w;
  w.rig = ladybug_rig(model);
  w.rig.lasers[0].T_body_scanner = {Eigen::Quaterniond::Identity(), {0, 0, 1.2}};
  for (std::size_t i = 0; i < w.rig.head.lenses.size(); ++i) {
    LensMount& lens = w.rig.head.lenses[i];
    lens.intrinsics.width = static_cast<int>(kWidth);
    lens.intrinsics.height = static_cast<int>(kHeight);
    lens.intrinsics.focal_px *= kScale;
    lens.intrinsics.principal_point_px *= kScale;
    lens.y_offset = kHeight * static_cast<std::uint32_t>(i);
  }
  for (int i = 0; i <= static_cast<int>(200 * (kSeconds + 2)); ++i) w.solutions.push_back(w.drive.solution(i / 200.0));
  for (unsigned i = 0; i < static_cast<unsigned>((kSeconds + 1.5) / kInterval); ++i) {
    // Each image differs, because a camera that shows the same picture from two places is frozen.
    const auto pixel = [i](std::uint32_t x, std::uint32_t y, int c) {
      return static_cast<double>((x * 7 + y * 13 + static_cast<unsigned>(c) * 50 + i * 29) & 127u) + 60;
    };
    w.exposures.push_back(
        make_exposure(i, kInterval * i, make_image(kWidth, 6 * kHeight, PixelFormat::BayerRG8, pixel)));
  }
  int firing = 0;
  for (double t = 0.5; t < 0.5 + kSeconds; t += 1 / kPacketRate) {
    StampedLaserBatch batch;
    batch.sensor = kLaser;
    batch.time = at(t);
    batch.state = SyncState::Locked;
    for (int f = 0; f < kFirings; ++f, ++firing) {
      const double azimuth = firing * 2 * std::numbers::pi / 1800, fired = t + f / (kPacketRate * kFirings);
      const LaserMount& mount = w.rig.lasers[0];
      const Matrix3 R = w.drive.motion().R_base_body(fired);
      const Vector3 from = w.drive.motion().position(fired) + R * mount.T_body_scanner.translation;
      for (int ring = 0; ring < kRings; ++ring) {
        const double elevation = (-30 + 1.33 * ring) * std::numbers::pi / 180;
        const Vector3 beam = R * Vector3(std::cos(elevation) * std::sin(azimuth),
                                         std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
        LaserReturn r = w.drive.hit(from + to_square(from, beam) * beam, fired, t, mount);
        r.channel = static_cast<std::uint16_t>(ring);
        batch.returns.push_back(r);
      }
    }
    w.returns += batch.returns.size();
    w.batches.push_back(std::move(batch));
  }
  return w;
}

/// The pixel that gave a point its colour.
struct Sampled {
  std::uint32_t exposure;
  float u, v;
  std::uint8_t lens;
};

/// Reads 12 pixels of a 4 x 4 neighbourhood at each point's place: the least that an interpolation in a mosaic needs.
/// Returns ns for each point.
double gather_ns(const Workload& w, const std::vector<Sampled>& sampled) {
  std::vector<const std::uint8_t*> places;
  const std::size_t stride = kWidth;
  for (const Sampled& p : sampled) {
    if (p.exposure == kNoExposure) continue;
    const RawView view = view_of(w.exposures[p.exposure].image);
    places.push_back(view.data + (static_cast<std::size_t>(p.v) + w.rig.head.lenses[p.lens].y_offset) * stride +
                     static_cast<std::size_t>(p.u));
  }
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const double start = cpu_seconds();
    std::uint64_t sum = 0;
    for (const std::uint8_t* p : places) {
      sum += p[0] + p[1] + p[2] + p[stride] + p[stride + 1] + p[stride + 2] + p[-static_cast<std::ptrdiff_t>(stride)] +
             p[-static_cast<std::ptrdiff_t>(stride) + 1] + p[2 * stride] + p[2 * stride + 1] + p[stride - 1] + p[-1];
    }
    benchmark::DoNotOptimize(sum);
    best = std::min(best, (cpu_seconds() - start) * 1e9 / static_cast<double>(places.size()));
  }
  return best;
}

void colour_drive(benchmark::State& state, LensModel model, ColourMethod method, ExposureChoice choice) {
  const Workload& w = workload(model);
  Colouring::Config config;
  config.method = method;
  config.choice = choice;
  config.threads = static_cast<int>(state.range(0));
  std::vector<Sampled> sampled;
  std::uint64_t direct = 0, coloured = 0, frozen = 0, points = 0;
  double stage_ns = 0, wall = 0;
  for (auto _ : state) {
    sampled.clear();
    sampled.reserve(w.returns);
    std::vector<StampedLaserBatch> batches = w.batches;
    Colouring colouring(config, w.rig, [&](const CloudBlock& block) {
      for (const ColouredPoint& p : block.points) sampled.push_back({p.exposure, p.u, p.v, p.lens});
    });
    for (const InsSolution& s : w.solutions) colouring.add(s);
    for (const Exposure& e : w.exposures) colouring.add(e);
    const auto start = Clock::now();
    const double cpu_start = cpu_seconds();
    for (StampedLaserBatch& batch : batches) colouring.add(std::move(batch));
    colouring.flush();
    wall = std::chrono::duration<double>(Clock::now() - start).count();
    stage_ns = (cpu_seconds() - cpu_start) * 1e9 / static_cast<double>(w.returns);
    state.SetIterationTime(wall);
    const auto& states = colouring.counts().by_state;
    direct = states[static_cast<std::size_t>(ColourState::Direct)];
    coloured = direct + states[static_cast<std::size_t>(ColourState::Neighbour)];
    frozen = colouring.counts().exposures_frozen;
  }
  points = sampled.size();
  expect(state,
         frozen == 0 && points == w.returns &&
             (choice == ExposureChoice::Nearest ? direct : coloured) > w.returns / 10 * 9,
         "nine points in ten are coloured, by the nearest exposure from their own");
  state.counters["points/s"] = static_cast<double>(w.returns) / wall;
  state.counters["cpu_ns/point"] = stage_ns;
  state.counters["direct"] = static_cast<double>(direct) / static_cast<double>(w.returns);
  if (method == ColourMethod::Lens) {
    const double gather = gather_ns(w, sampled);
    state.counters["gather_ns"] = gather;
    state.counters["ratio"] = stage_ns / gather;
  }
}

/// Closing a depth map after each turn of a scanner, against writing the memory that holds the result.
void close_depth_map(benchmark::State& state) {
  const DirectionGrid grid(DepthMap::Config{}.cell);
  constexpr std::uint32_t kBelow = 40, kAbove = 40;  // rows around the horizon that the scanner sees
  const std::size_t points = sized(std::size_t{20'000}, std::size_t{2'000});
  std::mt19937 random(3);
  std::vector<std::pair<std::uint32_t, float>> turn(points);
  for (auto& [cell, nearness] : turn) {
    const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
    const std::uint32_t row = static_cast<std::uint32_t>(grid.rows) / 2 - kBelow + below(kBelow + kAbove);
    cell = row * static_cast<std::uint32_t>(grid.columns) + below(static_cast<std::uint32_t>(grid.columns));
    nearness = 1.0f / static_cast<float>(4 + random() % 40);
  }
  std::vector<float> floor(4 * grid.size());
  double closing_s = 0, writing_s = 0;
  std::uint64_t behind = 0;
  float filler = 0;
  for (auto _ : state) {
    state.PauseTiming();
    DepthMap map{DepthMap::Config{}};
    for (const auto& [cell, nearness] : turn) map.add(cell, nearness);
    state.ResumeTiming();
    double begin = cpu_seconds();
    map.close();
    closing_s += cpu_seconds() - begin;
    state.PauseTiming();
    begin = cpu_seconds();
    std::fill(floor.begin(), floor.end(), filler += 1);
    benchmark::DoNotOptimize(floor.data());
    writing_s += cpu_seconds() - begin;
    behind = 0;
    for (const auto& [cell, nearness] : turn) behind += map.look(cell, 0.2f * nearness) != LineOfSight::Clear;
    state.ResumeTiming();
  }
  if (behind < points / 10 * 9)
    state.SkipWithError("places far behind the points are in clear sight: the map was not closed");
  state.counters["ns/point"] = closing_s / static_cast<double>(state.iterations()) / static_cast<double>(points) * 1e9;
  state.counters["ratio"] = closing_s / writing_s;
}
BENCHMARK(close_depth_map)->Unit(benchmark::kMillisecond);

BENCHMARK_CAPTURE(colour_drive, brown_lens, LensModel::Brown, ColourMethod::Lens, ExposureChoice::Visible)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(colour_drive, kannala_brandt_lens, LensModel::KannalaBrandt, ColourMethod::Lens,
                  ExposureChoice::Visible)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(colour_drive, kannala_brandt_nearest, LensModel::KannalaBrandt, ColourMethod::Lens,
                  ExposureChoice::Nearest)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(colour_drive, kannala_brandt_panorama, LensModel::KannalaBrandt, ColourMethod::Panorama,
                  ExposureChoice::Nearest)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hueline::fusion
