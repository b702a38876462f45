// Automatic exposure and rolling shutter: their effects on images, and that the truth contains them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/camera_model.hpp"
#include "sim/generate.hpp"
#include "sim/judge.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

Scenario quiet_scenario() {
  Scenario s = small_scenario();
  s.noise = false;
  s.camera.tone_curve = ToneCurve::Linear;
  s.camera.vignetting = 0;
  return s;
}

struct Made {
  explicit Made(const Scenario& s) : scenario(s), motion(s), world(s, motion), camera(s, motion, world) {}
  Scenario scenario;
  Motion motion;
  World world;
  PanoramicCamera camera;
};

/// A drive that enters the tunnel after a second or two and leaves it before the end.
Scenario tunnel_drive() {
  Scenario s = quiet_scenario();
  s.scene = SceneKind::Tunnel;
  s.street.curve_deg = 0;
  s.street.sky_brightness = 2;
  s.duration_s = 10;
  s.drive.speed = 12;
  s.tunnel.from_m = 20;
  s.tunnel.length_m = 50;
  s.camera.auto_exposure = true;
  s.camera.rate_hz = 4;
  return s;
}

TEST(AutoExposure, OpensInTheDarkAndClosesInTheSunWithADelay) {
  const Made made(tunnel_drive());
  const auto along = [&](std::size_t n) { return made.motion.along(made.camera.exposure_mid(n)); };
  double outside = 0, inside = 0;
  std::size_t first_inside = 0;
  for (std::size_t n = 0; n < made.camera.exposure_count(); ++n) {
    const double s = along(n), gain = made.camera.lens_gains(n)[0];
    EXPECT_GE(gain, 1 / made.scenario.camera.auto_exposure_limit);
    EXPECT_LE(gain, made.scenario.camera.auto_exposure_limit);
    if (s < 5) outside = gain;
    if (s > 50 && s < 60) inside = gain;
    if (first_inside == 0 && s > 24) first_inside = n;
  }
  EXPECT_GT(inside, 3 * outside);
  // The first image in the dark is still exposed for the light.
  EXPECT_LT(made.camera.lens_gains(first_inside)[5], 0.5 * inside);
  // The lens that looks at the sky has a smaller gain than those that look at the road.
  EXPECT_LT(made.camera.lens_gains(0)[5], 0.8 * made.camera.lens_gains(0)[0]);
}

TEST(AutoExposure, DeliversItsTargetAndTheTruthHasItsGain) {
  const TemporaryFolder folder("hueline-autoexposure");
  Scenario scenario = quiet_scenario();
  scenario.street.sky_brightness = 3;
  scenario.camera.auto_exposure = true;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok());
  const auto truth = TruthReader::open(drive->cache_dir + "/truth.bin");
  ASSERT_TRUE(truth.ok());
  const Made made(scenario);
  scenario.camera.auto_exposure = false;
  const Made plain(scenario);
  const auto adapted = made.camera.expose(0, 2), fixed = plain.camera.expose(0, 2);
  for (std::size_t lens = 0; lens < 6; ++lens) {
    const float gain = truth->header().exposures[0].lens_gain[lens];
    EXPECT_EQ(gain, made.camera.lens_gains(0)[lens]);
    EXPECT_EQ(plain.camera.lens_gains(0)[lens], 1.0f);
    double mean = 0, wrong = 0, compared = 0;
    for (std::size_t v = 0; v < 64; ++v)
      for (std::size_t u = 0; u < 76; ++u) {
        const std::size_t at = (lens / 3 * 64 + v) * 228 + lens % 3 * 76 + u;
        mean += adapted[at] / 255.0 / (64 * 76);
        if (fixed[at] < 20 || fixed[at] == 255 || adapted[at] == 255) continue;
        wrong = std::max(wrong, std::abs(adapted[at] - static_cast<double>(gain) * fixed[at]));
        ++compared;
      }
    EXPECT_NEAR(mean, scenario.camera.auto_exposure_target, 0.06) << lens;
    EXPECT_LE(wrong, 0.6 + 0.5 * static_cast<double>(gain)) << lens;
    EXPECT_TRUE(compared > 100 || lens == 5) << lens;
  }
}

TEST(AutoExposure, OneShutterForTheHeadMovesTheMiddle) {
  Scenario scenario = tunnel_drive();
  scenario.camera.auto_exposure_sets = CameraConfig::AutoSets::Shutter;
  ASSERT_EQ(scenario.validate(), "");
  const Made made(scenario);
  GpsNs shortest = made.camera.exposure_ns(0), longest = shortest;
  for (std::size_t n = 0; n < made.camera.exposure_count(); ++n) {
    const GpsNs duration = made.camera.exposure_ns(n);
    EXPECT_EQ(duration % 10'000, 0) << "steps of 10 us";
    EXPECT_NEAR(static_cast<double>(duration), 1000 * scenario.camera.exposure_us * made.camera.lens_gains(n)[0], 1);
    EXPECT_EQ(made.camera.exposure_mid(n), made.camera.exposure_start(n) + duration / 2);
    for (const float factor : made.camera.lens_gains(n)) EXPECT_EQ(factor, made.camera.lens_gains(n)[0]);
    shortest = std::min(shortest, duration);
    longest = std::max(longest, duration);
  }
  EXPECT_GT(longest, 3 * shortest) << "it is dark in the tunnel";
}

TEST(AutoExposure, EachLensIsThatOfAFixedExposureAroundItsOwnMiddle) {
  Scenario scenario = quiet_scenario();
  scenario.drive.speed = 12;
  scenario.street.sky_brightness = 3;
  scenario.camera.auto_exposure = true;
  scenario.camera.auto_exposure_sets = CameraConfig::AutoSets::Shutters;
  scenario.camera.exposure_us = 8000;
  scenario.camera.auto_exposure_limit = 3;
  ASSERT_EQ(scenario.validate(), "");
  const Made made(scenario);
  ASSERT_GT(made.camera.exposure_count(), 1u);
  const auto image = made.camera.expose(1, 2);
  const auto& factors = made.camera.lens_gains(1);
  EXPECT_GT(*std::max_element(factors.begin(), factors.end()),
            1.2f * *std::min_element(factors.begin(), factors.end()));
  GpsNs sum = 0;
  for (std::size_t lens = 0; lens < 6; ++lens) {
    Scenario fixed = scenario;
    fixed.camera.auto_exposure = false;
    fixed.camera.exposure_us *= static_cast<double>(factors[lens]);
    fixed.camera.gain *= static_cast<double>(factors[lens]);
    const Made other(fixed);
    const auto there = other.camera.expose(1, 2);
    EXPECT_EQ(made.camera.exposure_mid(1) + made.camera.shutter().lateness(factors, lens),
              other.camera.exposure_mid(1));
    sum += other.camera.exposure_ns(1);
    std::size_t differs = 0;
    for (std::size_t v = 0; v < 64; ++v)
      for (std::size_t u = 0; u < 76; ++u) {
        const std::size_t at = (lens / 3 * 64 + v) * 228 + lens % 3 * 76 + u;
        differs += std::abs(image[at] - there[at]) > 1;  // the gains are multiplied in another order
      }
    EXPECT_EQ(differs, 0u) << lens;
  }
  EXPECT_NEAR(static_cast<double>(made.camera.exposure_ns(1)), static_cast<double>(sum) / 6, 2);
}

TEST(AutoExposure, WhatTheCameraReportsIsKeptWithTheDrive) {
  const TemporaryFolder folder("hueline-reports");
  Scenario scenario = quiet_scenario();
  scenario.street.sky_brightness = 3;
  scenario.camera.auto_exposure = true;
  scenario.camera.reports_exposure = true;
  EXPECT_NE(scenario.validate(), "") << "a raw image says one gain, and each lens has its own";
  scenario.camera.payload = ImagePayload::JpegPlanes;
  for (const auto sets :
       {CameraConfig::AutoSets::Gains, CameraConfig::AutoSets::Shutter, CameraConfig::AutoSets::Shutters}) {
    scenario.camera.auto_exposure_sets = sets;
    ASSERT_EQ(scenario.validate(), "");
    const auto rendered = generate(scenario, folder.path()), read = generate(scenario, folder.path());
    ASSERT_TRUE(rendered.ok() && read.ok());
    const Made made(scenario);
    for (std::size_t n = 0; n < rendered->exposures.size(); ++n) {
      const CameraExposure &e = rendered->exposures[n], &again = read->exposures[n];
      ASSERT_EQ(e.reports.size(), 6u);
      ASSERT_EQ(again.reports.size(), 6u);
      EXPECT_EQ(again.longest_ns, e.longest_ns);
      EXPECT_EQ(e.longest_ns > e.exposure_ns, sets == CameraConfig::AutoSets::Shutters);
      for (std::size_t lens = 0; lens < 6; ++lens) {
        EXPECT_EQ(again.reports[lens].exposure_ns, e.reports[lens].exposure_ns);
        EXPECT_EQ(again.reports[lens].gain, e.reports[lens].gain);
        // Shutter times gain is what the lens makes of the light.
        EXPECT_NEAR(static_cast<double>(e.reports[lens].exposure_ns) / (1000 * scenario.camera.exposure_us) *
                        static_cast<double>(e.reports[lens].gain),
                    made.camera.lens_gains(n)[lens], 1e-5);
      }
    }
  }
}

TEST(RollingShutter, EachRowIsThatOfAGlobalShutterAtItsTime) {
  Scenario scenario = quiet_scenario();
  scenario.camera.antialias = false;
  scenario.drive.speed = 12;
  const auto global = Made(scenario).camera.expose(1, 2);
  scenario.camera.shutter = ShutterKind::Rolling;
  scenario.camera.row_time_us = 800;
  ASSERT_EQ(scenario.validate(), "");
  const auto rolling = Made(scenario).camera.expose(1, 2);
  const auto row_differs = [&](const std::vector<std::uint8_t>& image, std::size_t lens, std::size_t v) {
    const std::size_t from = (lens / 3 * 64 + v) * 228 + lens % 3 * 76;
    return !std::equal(&image[from], &image[from] + 76, &rolling[from]);
  };
  std::size_t sheared = 0;
  for (const int v : {2, 40, 61}) {
    Scenario shifted = scenario;
    shifted.camera.shutter = ShutterKind::Global;
    shifted.camera.first_exposure_s += (v - 31.5) * 800e-6;
    const auto there = Made(shifted).camera.expose(1, 2);
    for (std::size_t lens = 0; lens < 6; ++lens) {
      EXPECT_FALSE(row_differs(there, lens, static_cast<std::size_t>(v))) << lens << " row " << v;
      sheared += row_differs(global, lens, static_cast<std::size_t>(v));
    }
  }
  EXPECT_GE(sheared, 10u);
  // Where nothing moves, nothing is sheared.
  scenario.drive.stand_s = 100;
  scenario.drive.accelerate_s = 60;
  scenario.street.moving_cars = 0;
  const auto standing_rolling = Made(scenario).camera.expose(1, 2);
  scenario.camera.shutter = ShutterKind::Global;
  EXPECT_EQ(Made(scenario).camera.expose(1, 2), standing_rolling);
}

TEST(RollingShutter, TheJudgeLooksFromWhereTheRowWasExposed) {
  const TemporaryFolder folder("hueline-rolling");
  Scenario scenario = quiet_scenario();
  scenario.drive.speed = 12;
  scenario.camera.shutter = ShutterKind::Rolling;
  scenario.camera.row_time_us = 500;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok());
  const std::string file = drive->cache_dir + "/truth.bin";
  auto judge = Judge::open(scenario, file, {});
  auto truth = TruthReader::open(file);
  ASSERT_TRUE(judge.ok() && truth.ok());
  const Motion motion(scenario);
  const RigTruth rig = rig_truth(scenario);
  const TrueLens& lens = rig.lenses[0];
  const TrueExposure& exposure = truth->header().exposures[1];
  int judged = 0;
  double largest_naive = 0;
  for (int packets = 0; packets < 40; ++packets) {
    const auto returns = truth->next_packet();
    ASSERT_TRUE(returns.ok());
    for (const TrueReturn& r : *returns) {
      const Vec3 p{r.beam_east, r.beam_north, r.beam_up};
      const auto row_at = [&](double row) {
        const auto t = exposure.exposure_mid_gps_ns + std::llround((row - 31.5) * 500'000);
        return lens.project(inverse(motion.T_enu_body(t) * rig.T_body_head * lens.T_head_lens) * p);
      };
      const auto naive = row_at(31.5);
      if (!naive || !lens.contains(*naive)) continue;
      // Find by bisection the row on which the point falls when that row is exposed.
      double low = -1, high = 64;
      for (int i = 0; i < 50; ++i) {
        const double middle = (low + high) / 2;
        const auto pixel = row_at(middle);
        (pixel && pixel->v > middle ? low : high) = middle;
      }
      const auto there = row_at((low + high) / 2);
      if (!there || !lens.contains(*there)) continue;
      Claim claim;
      claim.fired_gps_ns = r.fired_gps_ns;
      claim.channel = r.channel;
      claim.exposure = 1;
      claim.lens = 0;
      claim.u = there->u, claim.v = there->v;
      const auto verdict = judge->judge(claim);
      ASSERT_TRUE(verdict);
      EXPECT_LT(verdict->error_px, 0.01);
      claim.u = naive->u, claim.v = naive->v;
      if (const auto off = judge->judge(claim)) largest_naive = std::max(largest_naive, off->error_px);
      ++judged;
    }
  }
  EXPECT_GT(judged, 300);
  EXPECT_GT(largest_naive, 5) << "who takes the middle's pose for every row errs";
}

}  // namespace
}  // namespace hueline::sim
