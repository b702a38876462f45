// Proofs that take long: many runs against known truth. Counters are the result; times are beside the point.
//   calibration_bench --benchmark_filter=lens_trials
#include <benchmark/benchmark.h>

#include <cmath>

#include "calibration/lens/lens_calibration.hpp"
#include "tests/calibration/simulated_boards.hpp"

namespace hueline::calibration {
namespace {

/// 200 calibrations of one lens from boards with corner noise: how many have focal lengths and principal point within 0.3 px and within
/// three of their own sigma.
void lens_trials(benchmark::State& state) {
  const bool is_fisheye = state.range(0) != 0;
  const fusion::CameraIntrinsics lens = is_fisheye ? test::fisheye_lens() : test::plane_lens();
  constexpr int kRuns = 200;
  test::SimulatedBoards what;
  what.board = {BoardKind::Chessboard, 14, 10, 0.04, 0, ""};
  what.views = 40;
  what.noise_px = 0.1;
  for (auto _ : state) {
    int within_px = 0, within_sigma = 0, values_within_sigma = 0, failed = 0;
    double noise2 = 0, square = 0, sigma2 = 0;
    for (std::uint32_t run = 0; run < kRuns; ++run) {
      what.seed = 1000 + run;
      const auto found = calibrate_lens(what.board, test::simulate_boards(lens, what), lens.width, lens.height,
                                        {.model = is_fisheye ? LensModel::KannalaBrandt : LensModel::Brown});
      if (!found.ok()) {
        ++failed;
        continue;
      }
      const auto ours = found->adjusted.lens.parameters();
      const double truth[4] = {lens.focal_px.x(), lens.focal_px.y(), lens.principal_point_px.x(), lens.principal_point_px.y()};
      bool near = true, honest = true;
      for (int i = 0; i < 4; ++i) {
        const double error = ours[static_cast<std::size_t>(i)] - truth[i], sigma = std::sqrt(found->adjusted.covariance(i, i));
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
    state.counters["failed"] = failed;
    state.counters["all4_within_0.3px_%"] = 100.0 * within_px / kRuns;
    state.counters["all4_within_3sigma_%"] = 100.0 * within_sigma / kRuns;
    state.counters["values_within_3sigma_%"] = 100.0 * values_within_sigma / (4 * kRuns);
    state.counters["error_rms_px"] = std::sqrt(square / kRuns);
    state.counters["stated_sigma_px"] = std::sqrt(sigma2 / kRuns);
    state.counters["corner_sigma_px"] = std::sqrt(noise2 / kRuns);
  }
}
BENCHMARK(lens_trials)->ArgName("fisheye")->Arg(0)->Arg(1)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace hueline::calibration
