// Proofs that take long: many runs against known truth. The counters are the result; the times do not matter.
//   calibration_bench --benchmark_filter=lens_trials
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>

#include "calibration/lens/lens_calibration.hpp"
#include "runtime/lens_values.hpp"
#include "tests/calibration/boresight/simulated_passes.hpp"
#include "tests/calibration/lens/simulated_boards.hpp"
#include "tests/calibration/mount/measured_objects.hpp"
#include "tests/calibration/mount/simulated_points.hpp"
#include "tests/support/bench.hpp"

namespace hueline::calibration {
namespace {

/// Calibrates one lens 200 times from boards with corner noise. Counts how often focal lengths and principal point are
/// within 0.3 px and within three of their own sigmas.
void lens_trials(benchmark::State& state) {
  const bool is_fisheye = state.range(0) != 0;
  const fusion::CameraIntrinsics lens = is_fisheye ? test::fisheye_lens() : test::plane_lens();
  const int kRuns = hueline::test::sized(200, 1);
  test::SimulatedBoards what = test::good_views();
  for (auto _ : state) {
    int within_px = 0, within_sigma = 0, values_within_sigma = 0, failed = 0;
    double noise2 = 0, square = 0, sigma2 = 0;
    for (std::uint32_t run = 0; run < static_cast<std::uint32_t>(kRuns); ++run) {
      what.seed = 1000 + run;
      const auto found = calibrate_lens(what.board, test::simulate_boards(lens, what), lens.width, lens.height,
                                        {.model = is_fisheye ? LensModel::KannalaBrandt : LensModel::Brown});
      if (!found.ok()) {
        ++failed;
        continue;
      }
      const auto ours = found->adjusted.lens.parameters();
      const double truth[4] = {lens.focal_px.x(), lens.focal_px.y(), lens.principal_point_px.x(),
                               lens.principal_point_px.y()};
      bool near = true, honest = true;
      for (int i = 0; i < 4; ++i) {
        const double error = ours[static_cast<std::size_t>(i)] - truth[i],
                     sigma = std::sqrt(found->adjusted.covariance(i, i));
        near = near && std::abs(error) <= 0.3;
        honest = honest && std::abs(error) <= 3 * sigma;
        values_within_sigma += std::abs(error) <= 3 * sigma;
        square += error * error / 4;
        sigma2 += sigma * sigma / 4;
      }
      within_px += near;
      within_sigma += honest;
      noise2 += found->adjusted.sigma_px * found->adjusted.sigma_px;
    }
    hueline::test::expect(state, failed == 0 && values_within_sigma > 3 * kRuns,
                          "lenses are calibrated, to what they state");
    state.counters["failed"] = failed;
    state.counters["all4_within_0.3px_%"] = 100.0 * within_px / kRuns;
    state.counters["all4_within_3sigma_%"] = 100.0 * within_sigma / kRuns;
    state.counters["values_within_3sigma_%"] = 100.0 * values_within_sigma / (4 * kRuns);
    state.counters["error_rms_px"] = std::sqrt(square / kRuns);
    state.counters["stated_sigma_px"] = std::sqrt(sigma2 / kRuns);
    state.counters["corner_sigma_px"] = std::sqrt(noise2 / kRuns);
  }
}
/// Compares ways to take views of a board by the sigmas that they lead to, with 0.1 px of noise.
void lens_views(benchmark::State& state) {
  test::SimulatedBoards what = test::good_views();
  const int way = static_cast<int>(state.range(0));
  what.views = way == 4 ? 20 : way == 5 ? 60 : 40;
  if (way == 0 || way == 1) what.nearest = 0.8, what.farthest = 2;  // a quarter of the image
  if (way == 0 || way == 2) what.least_tilt_deg = 0, what.tilt_deg = 20;
  const fusion::CameraIntrinsics lens = state.range(1) != 0 ? test::fisheye_lens() : test::plane_lens();
  const int kRuns = hueline::test::sized(5, 1);
  for (auto _ : state) {
    double focal2 = 0, centre2 = 0, box = 0;
    for (std::uint32_t run = 0; run < static_cast<std::uint32_t>(kRuns); ++run) {
      what.seed = 1 + run;
      const auto views = test::simulate_boards(lens, what);
      for (const auto& view : views) {
        Eigen::Vector2d least = view.corners[0].pixel, most = least;
        for (const auto& corner : view.corners)
          least = least.cwiseMin(corner.pixel), most = most.cwiseMax(corner.pixel);
        box += (most - least).prod() / (lens.width * lens.height) / static_cast<double>(views.size() * kRuns);
      }
      const auto found = adjust_lens(what.board, views, runtime::lens_values(lens), {});
      if (!found.ok()) return state.SkipWithError(found.error().message.c_str());
      focal2 += (found->covariance(0, 0) + found->covariance(1, 1)) / (2 * kRuns);
      centre2 += (found->covariance(2, 2) + found->covariance(3, 3)) / (2 * kRuns);
    }
    hueline::test::expect(state, focal2 > 0 && box > 0, "lenses are adjusted");
    state.counters["focal_px"] = std::sqrt(focal2);
    state.counters["centre_px"] = std::sqrt(centre2);
    state.counters["box_share"] = box;
  }
}
/// Makes 200 resections from 20 points (lens 0: 1224 px wide, 1: fisheye, 2: 2448 px wide). Compares the errors with
/// the stated standard deviations and counts those within three of them.
void resection_trials(benchmark::State& state) {
  const fusion::CameraIntrinsics lens = state.range(0) == 0   ? test::plane_lens()
                                        : state.range(0) == 1 ? test::fisheye_lens()
                                                              : test::large_plane_lens();
  const int kRuns = hueline::test::sized(200, 1);
  for (auto _ : state) {
    double turn2 = 0, centre2 = 0, turn_sigma2 = 0, centre_sigma2 = 0;
    int failed = 0, within = 0;
    for (std::uint32_t run = 0; run < static_cast<std::uint32_t>(kRuns); ++run) {
      test::SimulatedPoints what = {.count = 20, .noise_px = 1, .noise_m = 0.005, .seed = 5000 + run};
      if (state.range(0) == 3) what = test::good_points(5000 + run);
      const auto shot = test::simulate_points(lens, what);
      const auto found = resect(runtime::lens_values(lens), shot.points, {.sigma_px = 1, .sigma_point_m = 0.005});
      if (!found.ok()) {
        ++failed;
        continue;
      }
      const auto error = test::pose_error(found->T_scanner_lens, shot.T_scanner_lens);
      turn2 += error.head<3>().squaredNorm() / 3;  // an axis
      centre2 += error.tail<3>().squaredNorm() / 3;
      turn_sigma2 += found->covariance.diagonal().head<3>().sum() / 3;
      centre_sigma2 += found->covariance.diagonal().tail<3>().sum() / 3;
      for (int i = 0; i < 6; ++i) within += std::abs(error[i]) <= 3 * std::sqrt(found->covariance(i, i));
    }
    const double runs = kRuns - failed, deg = 57.29577951;
    hueline::test::expect(state, failed == 0 && within > 5 * kRuns, "images are posed, to what they state");
    state.counters["failed"] = failed;
    state.counters["turn_deg_rms"] = std::sqrt(turn2 / runs) * deg;
    state.counters["turn_deg_stated"] = std::sqrt(turn_sigma2 / runs) * deg;
    state.counters["centre_mm_rms"] = std::sqrt(centre2 / runs) * 1e3;
    state.counters["centre_mm_stated"] = std::sqrt(centre_sigma2 / runs) * 1e3;
    state.counters["within_3sigma_%"] = 100.0 * within / (6 * runs);
  }
}
/// Calibrates the mounting of a scanner in a hundred simulated drives in both directions. The argument is the length of
/// the street in metres.
void boresight_trials(benchmark::State& state) {
  const int kRuns = hueline::test::sized(100, 1);
  for (auto _ : state) {
    std::array<double, 6> squares{};
    std::array<int, 3> within{};
    double turn2 = 0, lever2 = 0, together = 0;
    int found_ones = 0;
    for (std::uint32_t run = 0; run < static_cast<std::uint32_t>(kRuns); ++run) {
      test::PassesSetting setting;
      setting.seed = 7000 + run;
      setting.length_m = static_cast<double>(state.range(0));
      const auto passes = test::simulate_passes(setting);
      const auto found = find_boresight(passes.drive, {});
      if (!found.ok()) continue;
      ++found_ones;
      const Eigen::VectorXd error = test::boresight_error(*found, passes);
      turn2 += error.head<3>().squaredNorm();
      lever2 += error.segment<2>(3).squaredNorm();
      together += error.dot(found->covariance.llt().solve(error));
      for (std::size_t i = 0; i < 6; ++i) {
        const double over = std::abs(error[static_cast<Eigen::Index>(i)]) / found->scanners[0].sigma[i];
        squares[i] += over * over;
        for (std::size_t k = 0; k < 3; ++k) within[k] += over <= static_cast<double>(k + 1);
      }
    }
    hueline::test::expect(state, found_ones == kRuns && within[2] > 5 * kRuns,
                          "mountings are found, to what they state");
    state.counters["found"] = found_ones;
    state.counters["turn_deg_rms"] = std::sqrt(turn2 / found_ones) * 57.29577951;
    state.counters["lever_plane_mm_rms"] = std::sqrt(lever2 / found_ones) * 1e3;
    state.counters["nees_of_6"] = together / found_ones;
    constexpr const char* kNames[] = {"turn_x", "turn_y", "turn_z", "lever_x", "lever_y", "lever_z"};
    for (std::size_t i = 0; i < 6; ++i)
      state.counters[std::string(kNames[i]) + "_over_sigma_rms"] = std::sqrt(squares[i] / found_ones);
    for (std::size_t k = 0; k < 3; ++k)
      state.counters[fmt::format("within_{}sigma_%", k + 1)] = 100.0 * within[k] / (6.0 * found_ones);
  }
}
void metres(benchmark::internal::Benchmark* b) {
  b->ArgName("metres")->Arg(120);
  if (!hueline::test::is_brief()) b->Arg(400);
}
BENCHMARK(boresight_trials)->Apply(metres)->Iterations(1)->Unit(benchmark::kSecond);

/// Measures objects with a calibrated lens and mounting, from 20 views of the board.
void measured_objects(benchmark::State& state) {
  for (auto _ : state) {
    const auto measured = test::measure_objects(static_cast<int>(state.range(0)), 20, {}, 5);
    hueline::test::expect(state, measured.points == state.range(0) && measured.plane_rms_m < 0.1,
                          "every object is measured, to centimetres");
    state.counters["points"] = measured.points;
    state.counters["plane_rms_m"] = measured.plane_rms_m;
    state.counters["height_rms_m"] = measured.height_rms_m;
  }
}
BENCHMARK(measured_objects)->Arg(13)->Arg(1000)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(resection_trials)->ArgName("lens")->DenseRange(0, 3)->Iterations(1)->Unit(benchmark::kSecond);
void ways(benchmark::internal::Benchmark* b) {
  using Ways = std::vector<std::int64_t>;
  b->ArgNames({"way", "fisheye"})->ArgsProduct({hueline::test::sized(Ways{0, 1, 2, 3, 4, 5}, Ways{4}), {0, 1}});
}
BENCHMARK(lens_views)->Apply(ways)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(lens_trials)->ArgName("fisheye")->Arg(0)->Arg(1)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace hueline::calibration
