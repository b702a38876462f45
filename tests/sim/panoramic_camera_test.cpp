#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/camera_model.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

Scenario linear_scenario() {
  Scenario s = small_scenario();
  s.camera.tone_curve = ToneCurve::Linear;
  s.camera.vignetting = 0;
  s.noise = false;
  return s;
}

std::vector<std::uint8_t> expose(const Scenario& scenario, std::size_t number = 1) {
  const Motion motion(scenario);
  const World world(scenario, motion);
  return PanoramicCamera(scenario, motion, world).expose(number, 2);
}

TEST(PanoramicCamera, NoiseIsThatOfItsElectrons) {
  Scenario scenario = linear_scenario();
  const auto quiet = expose(scenario);
  scenario.noise = true;
  scenario.camera.full_well_electrons = 400;  // so strong that rounding to 8 bits does not matter
  scenario.camera.read_noise_electrons = 5;
  const auto noisy = expose(scenario);
  double sum = 0, sum2 = 0, n = 0;
  for (std::size_t i = 0; i < quiet.size(); ++i) {
    if (quiet[i] < 40 || quiet[i] > 160) continue;  // not near clipping
    const double light = quiet[i] / 255.0;
    const double sigma = 255 * std::sqrt(light * 400 + 25) / 400;
    const double z = (noisy[i] - quiet[i]) / sigma;
    sum += z;
    sum2 += z * z;
    ++n;
  }
  ASSERT_GT(n, 10'000);
  EXPECT_NEAR(sum / n, 0, 0.03);
  EXPECT_NEAR(std::sqrt(sum2 / n), 1, 0.03);
}

TEST(PanoramicCamera, TwoExposuresOfAStandingVehicleDifferByNoiseAlone) {
  Scenario scenario = linear_scenario();
  scenario.street.moving_cars = 0;
  scenario.drive.stand_s = 100;
  scenario.drive.accelerate_s = 60;
  EXPECT_EQ(expose(scenario, 0), expose(scenario, 1));
  scenario.noise = true;
  EXPECT_NE(expose(scenario, 0), expose(scenario, 1));
}

TEST(PanoramicCamera, VignettingTakesItsShareAtTheCorner) {
  Scenario scenario = linear_scenario();
  const auto plain = expose(scenario);
  scenario.camera.vignetting = 0.5;
  const auto dimmed = expose(scenario);
  // The brightness that the six lens images lose: half at the far corner, nothing in the middle.
  double most = 0, middle = 1;
  const int width = 3 * 76;
  for (int lens = 0; lens < 6; ++lens)
    for (int v = 0; v < 64; ++v)
      for (int u = 0; u < 76; ++u) {
        const auto at = static_cast<std::size_t>((lens / 3 * 64 + v) * width + lens % 3 * 76 + u);
        if (plain[at] < 100 || plain[at] == 255) continue;
        const double loss = 1 - static_cast<double>(dimmed[at]) / plain[at];
        most = std::max(most, loss);
        if (std::hypot(u - 38, v - 32) < 5) middle = std::min(middle, loss);
      }
  EXPECT_NEAR(most, 0.5, 0.05);
  EXPECT_NEAR(middle, 0.0, 0.02);
}

TEST(PanoramicCamera, MotionBlurKeepsTheLight) {
  Scenario scenario = linear_scenario();
  scenario.camera.antialias = false;
  scenario.camera.exposure_us = 20'000;
  const auto sharp = expose(scenario);
  scenario.camera.blur_samples = 6;
  const auto blurred = expose(scenario);
  EXPECT_NE(sharp, blurred);
  const double a = std::accumulate(sharp.begin(), sharp.end(), 0.0),
               b = std::accumulate(blurred.begin(), blurred.end(), 0.0);
  EXPECT_NEAR(b / a, 1, 0.01);
}

}  // namespace
}  // namespace hueline::sim
