#include "score/scorer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/earth.hpp"
#include "sim/generate.hpp"
#include "sim/ins_model.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::score {
namespace {

using sim::TrueReturn;
using sim::Vec3;

/// One short furnished drive. Claims are made from its truth and spoilt by known amounts.
class ScorerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new sim::TemporaryFolder("hueline-score");
    scenario_ = new sim::Scenario(sim::small_scenario());
    scenario_->noise = false;
    scenario_->duration_s = 1.2;
    auto drive = sim::generate(*scenario_, folder_->path());
    ASSERT_TRUE(drive.ok()) << drive.error().message;
    drive_ = new sim::Drive(std::move(*drive));
    auto reader = sim::TruthReader::open(drive_->cache_dir + "/truth.bin");
    ASSERT_TRUE(reader.ok());
    exposures_ = reader->header().exposures;
    for (;;) {
      auto packet = reader->next_packet();
      if (!packet.ok()) break;
      returns_.insert(returns_.end(), packet->begin(), packet->end());
    }
    outlook_ = new Outlook(*scenario_, exposures_);
  }
  static void TearDownTestSuite() {
    delete outlook_;
    delete drive_;
    delete scenario_;
    delete folder_;
  }
  static Scorer open() {
    auto scorer = Scorer::open(*scenario_, drive_->cache_dir, {.ray_returns = 4000, .seed = 1, .threads = 2});
    EXPECT_TRUE(scorer.ok());
    return std::move(*scorer);
  }
  static Vec3 place(const TrueReturn& r) { return {r.east, r.north, r.up}; }
  /// Returns what a perfect program says of a return, coloured by the lens of `sight`.
  static PointClaim perfect(const TrueReturn& r, const std::optional<Outlook::Sight>& sight) {
    PointClaim out;
    out.claim.fired_gps_ns = r.fired_gps_ns;
    out.claim.channel = r.channel;
    out.is_coloured = sight.has_value();
    out.latency_ms = 1500;
    out.claim.place_ecef = T_ecef_scene() * Vec3{r.beam_east, r.beam_north, r.beam_up};
    if (!sight) return out;
    out.claim.exposure = sight->exposure;
    out.claim.lens = static_cast<std::uint8_t>(sight->lens);
    out.claim.u = sight->pixel.u;
    out.claim.v = sight->pixel.v;
    out.claim.red = r.red, out.claim.green = r.green, out.claim.blue = r.blue;
    return out;
  }
  /// Returns a lens that has the return in its image; with `truly`, one from which nothing hides it.
  static std::optional<Outlook::Sight> sight_of(const TrueReturn& r, bool truly) {
    for (const std::uint32_t e : outlook_->nearest_exposures(r.fired_gps_ns, 9))
      for (std::size_t lens = 0; lens < outlook_->lens_count(); ++lens)
        if (const auto sight = outlook_->sight(e, lens, place(r));
            sight && (!truly || outlook_->look(*sight, place(r)).met == Outlook::Met::Place))
          return sight;
    return std::nullopt;
  }
  static sim::Pose T_ecef_scene() {
    const sim::GeodeticPlace origin = sim::scene_origin(*scenario_);
    return {sim::R_ecef_enu(origin), sim::ecef_from_geodetic(origin)};
  }
  static void add_exposures(Scorer& scorer, double late_ns, Vec3 shift_enu) {
    for (const auto& e : exposures_) {
      const sim::Pose T{{e.R_enu_head}, Vec3{e.p_enu_head[0], e.p_enu_head[1], e.p_enu_head[2]} + shift_enu};
      const sim::Pose turned{sim::rotation_z(sim::radians(0.25)) * T.R, T.p};
      scorer.add(ExposureClaim{e.number, e.exposure_mid_gps_ns + static_cast<sim::GpsNs>(late_ns), 3000,
                               T_ecef_scene() * turned});
    }
  }
  static double value(const ScenarioScore& score, const char* metric) {
    const Figure& figure = score.figures.at(metric);
    EXPECT_TRUE(figure.value) << metric << ": " << figure.reason;
    return figure.value.value_or(-1);
  }
  static inline sim::TemporaryFolder* folder_ = nullptr;
  static inline sim::Scenario* scenario_ = nullptr;
  static inline sim::Drive* drive_ = nullptr;
  static inline Outlook* outlook_ = nullptr;
  static inline std::vector<sim::TrueExposure> exposures_;
  static inline std::vector<TrueReturn> returns_;
};

TEST_F(ScorerTest, WhatIsBeforeAndBehindAPlaceIsSeen) {
  std::size_t asked = 0;
  for (std::size_t i = 0; i < returns_.size(); i += 61) {
    const TrueReturn& r = returns_[i];
    const auto sight = sight_of(r, true);
    if (!sight || sight->distance_m < 2) continue;
    const auto& e = exposures_[sight->exposure];
    const Vec3 head{e.p_enu_head[0], e.p_enu_head[1], e.p_enu_head[2]};
    // At a place one metre nearer there is only air; at a place one metre farther, something is in between.
    for (const double metres : {-1.0, 1.0}) {
      const Vec3 other = place(r) + metres * normalised(place(r) - head);
      const auto moved = outlook_->sight(sight->exposure, sight->lens, other);
      if (!moved) continue;
      const auto met = outlook_->look(*moved, other).met;
      // The lens is a few centimetres away from the head's centre, so its ray may miss the thing along an outline.
      asked += met == (metres < 0 ? Outlook::Met::Behind : Outlook::Met::Before) ? 1 : 0;
    }
  }
  EXPECT_GT(asked, 2 * returns_.size() / 61 * 6 / 10);
}

TEST(Outlook, APaneHidesWhatItHardlyLetsThrough) {
  sim::Scenario scenario = sim::small_scenario();
  scenario.street.curve_deg = 0;
  scenario.street.furnished = false;
  scenario.street.glazed_fronts = 1;
  const sim::Motion motion(scenario);
  const sim::GpsNs mid = scenario.sensors_begin_gps_ns() + 200'000'000;
  const sim::Pose T = motion.T_enu_body(mid) * sim::rig_truth(scenario).T_body_head;
  sim::TrueExposure exposure;
  exposure.exposure_mid_gps_ns = mid;
  exposure.R_enu_head = T.R.m;
  exposure.p_enu_head = {T.p.x, T.p.y, T.p.z};
  exposure.lens_gain.assign(6, 1.0f);
  const Outlook outlook(scenario, {exposure});
  std::size_t through = 0, hidden = 0;
  for (double azimuth = 0; azimuth < 360; azimuth += 0.2)
    for (const double down : {0.02, 0.05, 0.09, 0.14}) {
      const double a = sim::radians(azimuth);
      const sim::World::Ray ray{T.p, normalised(Vec3{std::sin(a), std::cos(a), -down}), 0.01, 100};
      sim::Seen seen;
      outlook.world().look(outlook.world().moment(mid), {&ray, 1}, 0, {&seen, 1});
      if (!outlook.world().surfaces()[seen.surface].starts_with("room")) continue;
      const Vec3 place = ray.origin + seen.distance_m * ray.direction;
      for (std::size_t lens = 0; lens < outlook.lens_count(); ++lens)
        if (const auto sight = outlook.sight(0, lens, place)) {
          const Outlook::Look look = outlook.look(*sight, place);
          if (std::abs(look.seen.distance_m - sight->distance_m) > 0.01) continue;  // seen past another frame
          const bool is_hidden = look.seen.transmitted < 0.5f;
          EXPECT_EQ(look.met, is_hidden ? Outlook::Met::Before : Outlook::Met::Place) << look.seen.transmitted;
          ++(is_hidden ? hidden : through);
        }
    }
  EXPECT_GT(through, 100u);
  EXPECT_GT(hidden, 20u);
}

TEST_F(ScorerTest, PerfectClaimsHaveNoError) {
  Scorer scorer = open();
  add_exposures(scorer, 0, {});
  for (const TrueReturn& r : returns_) scorer.add(perfect(r, sight_of(r, true)));
  const auto score = scorer.finish("perfect", {}, [](double) {});
  EXPECT_EQ(value(score, "placed_share"), 1);
  EXPECT_EQ(value(score, "misplaced_share"), 0);
  EXPECT_LT(value(score, "place_rms_m"), 1e-5);
  EXPECT_EQ(value(score, "visible_coloured_share"), 1) << "what was visible was coloured";
  EXPECT_GT(value(score, "coloured_share"), 0.8);
  EXPECT_LT(value(score, "coloured_share"), 1) << "something is always hidden";
  EXPECT_EQ(value(score, "wrong_surface_share"), 0);
  EXPECT_EQ(value(score, "visible_coloured_share_bound"), 1) << "every exposure was there";
  EXPECT_NEAR(value(score, "coloured_share_bound"), value(score, "coloured_share"), 0.01)
      << "who colours what was seen reaches the bound; the sample against all points";
  EXPECT_EQ(value(score, "hole_visible_coloured_share"), 1);
  EXPECT_EQ(value(score, "hole_coloured_share"), value(score, "hole_coloured_share_bound"));
  EXPECT_LT(value(score, "hole_coloured_share_bound"), 1) << "the vehicle hides places that no other exposure sees";
  EXPECT_GT(value(score, "wrong_surface_share_bound"), 0) << "something is in an image and hidden in all";
  EXPECT_LT(value(score, "wrong_surface_share_bound"), 1 - value(score, "coloured_share_bound") + 0.01);
  EXPECT_LT(value(score, "flicker_de00_p90"), 1e-5);
  EXPECT_LT(value(score, "colour_de00_p95"), 1e-5);
  EXPECT_LT(value(score, "exposure_seam_de00"), 1e-5);
  EXPECT_LT(value(score, "reprojection_rms_px"), 0.05) << "pixel of the hit against pixel of the wire's 2 mm";
  EXPECT_EQ(value(score, "exposure_time_rms_us"), 0);
  EXPECT_NEAR(value(score, "pose_attitude_rms_deg"), 0.25, 1e-9);
  EXPECT_NEAR(value(score, "latency_p99_ms"), 1500, 15);
  EXPECT_FALSE(score.figures.at("unexplained_bytes").value);
  EXPECT_EQ(score.pictures.size(), 3u);
}

TEST_F(ScorerTest, KnownErrorsComeBackAsFigures) {
  Scorer scorer = open();
  add_exposures(scorer, 5000, {0.03, 0, -0.04});
  std::uint64_t hidden = 0, coloured = 0, number = 0;
  for (const TrueReturn& r : returns_) {
    const auto sight = sight_of(r, false);  // any lens that has it in its image, hidden or not
    PointClaim claim = perfect(r, sight);
    // Every second point is 12 steps too bright.
    if (coloured % 2 == 0) claim.claim.red = claim.claim.green = claim.claim.blue = 255;
    if (sight && r.surface != 1) {
      ++coloured;
      hidden += outlook_->look(*sight, place(r)).met != Outlook::Met::Place ? 1 : 0;
    }
    // One point in ten is put 2 m off, one in ten 3 cm off, and one in ten is stamped between two firings.
    const Vec3 up = T_ecef_scene().R * Vec3{0, 0, 1};
    ++number;
    if (number % 10 == 0) claim.claim.place_ecef = *claim.claim.place_ecef + 2 * up;
    if (number % 10 == 5) claim.claim.place_ecef = *claim.claim.place_ecef + 0.03 * up;
    if (number % 10 == 7) claim.claim.fired_gps_ns += 27'000;
    scorer.add(claim);
  }
  const auto score = scorer.finish("spoilt", {}, [](double) {});
  const double share = static_cast<double>(hidden) / static_cast<double>(coloured);
  EXPECT_GT(share, 0.01);
  EXPECT_NEAR(value(score, "wrong_surface_share"), share, 0.015) << "the sample against all points";
  EXPECT_NEAR(value(score, "exposure_time_rms_us"), 5, 1e-9);
  EXPECT_EQ(value(score, "exposure_time_coverage_95"), 1) << "5 us at a sigma of 3 us is inside 1.96 sigma";
  EXPECT_EQ(value(score, "exposure_time_coverage_1s"), 0);
  EXPECT_NEAR(value(score, "pose_position_rms_m"), 0.05, 1e-6);
  EXPECT_NEAR(value(score, "misplaced_share"), 0.2, 0.02);
  EXPECT_NEAR(value(score, "place_rms_m"), 0.03 / std::sqrt(8), 0.002);
  EXPECT_NEAR(value(score, "colour_de00_over20_share"), 0.5, 0.1) << "white against the street";
}

TEST_F(ScorerTest, WhatIsNotGivenIsMissed) {
  Scorer scorer = open();
  for (std::size_t i = 0; i < returns_.size(); ++i)
    if (i % 4 != 0) scorer.add(perfect(returns_[i], sight_of(returns_[i], true)));
  const auto score = scorer.finish("lost", {}, [](double) {});
  EXPECT_NEAR(value(score, "placed_share"), 0.75, 0.01);
  EXPECT_NEAR(value(score, "visible_coloured_share"), 0.75, 0.03);
  EXPECT_FALSE(score.figures.at("exposure_time_rms_us").value);
  EXPECT_EQ(score.figures.at("exposure_time_rms_us").reason, "no exposure was stamped");
}

TEST_F(ScorerTest, TheBoundsAreOfTheExposuresThatCame) {
  const auto bounds = [](std::uint32_t last, bool has_image, int neighbours) {
    auto scorer = Scorer::open(*scenario_, drive_->cache_dir,
                               {.ray_returns = 2000, .seed = 1, .neighbours = neighbours, .threads = 2});
    EXPECT_TRUE(scorer.ok());
    for (const auto& e : exposures_) {
      const sim::Pose T{{e.R_enu_head}, Vec3{e.p_enu_head[0], e.p_enu_head[1], e.p_enu_head[2]}};
      if (e.number > last) break;
      scorer->add(ExposureClaim{e.number, e.exposure_mid_gps_ns, 3000, T_ecef_scene() * T, has_image});
    }
    return scorer->finish("bounds", {}, [](double) {});
  };
  const auto all = bounds(99, true, 4), one = bounds(0, true, 4), near = bounds(99, true, 0),
             blind = bounds(99, false, 4);
  EXPECT_GT(value(all, "coloured_share_bound"), value(one, "coloured_share_bound") + 0.05);
  EXPECT_GT(value(one, "coloured_share_bound"), 0.05);
  EXPECT_LT(value(one, "visible_coloured_share_bound"), 0.97) << "the other exposures saw more";
  EXPECT_LE(value(near, "coloured_share_bound"), value(all, "coloured_share_bound")) << "a window of one exposure";
  EXPECT_GT(value(near, "wrong_surface_share_bound"), value(all, "wrong_surface_share_bound"));
  EXPECT_EQ(value(blind, "coloured_share_bound"), 0) << "images that were broken give nothing";
  EXPECT_FALSE(blind.figures.at("wrong_surface_share_bound").value);
}

TEST(ScorerOfTraffic, WhatIsToldMovingIsHeldAgainstWhatMoves) {
  const sim::TemporaryFolder folder("hueline-score-traffic");
  sim::Scenario scenario = sim::small_scenario();
  scenario.scene = sim::SceneKind::Traffic;
  scenario.street.road_width_m = 14;
  scenario.drive.lane_offset_m = 5.25;
  const auto drive = sim::generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok()) << drive.error().message;
  auto scorer = Scorer::open(scenario, drive->cache_dir, {.ray_returns = 100});
  ASSERT_TRUE(scorer.ok()) << scorer.error().message;
  auto reader = sim::TruthReader::open(drive->cache_dir + "/truth.bin");
  ASSERT_TRUE(reader.ok());
  std::uint64_t still = 0, told = 0, moving = 0, missed = 0;
  for (;;) {
    const auto packet = reader->next_packet();
    if (!packet.ok()) break;
    for (const TrueReturn& r : *packet) {
      PointClaim claim;
      claim.claim.fired_gps_ns = r.fired_gps_ns;
      claim.claim.channel = r.channel;
      const bool is_odd = r.channel % 4 == 1;  // a quarter of the rings says the opposite
      claim.moving = r.is_moving != is_odd ? 250 : 10;
      if (r.surface != 1) {
        moving += r.is_moving ? 1 : 0;
        missed += r.is_moving && is_odd ? 1 : 0;
        still += r.is_moving ? 0 : 1;
        told += !r.is_moving && is_odd ? 1 : 0;
      }
      scorer->add(claim);
    }
  }
  const auto score = scorer->finish("traffic", {}, [](double) {});
  ASSERT_GT(moving, 100u);
  ASSERT_GT(told, 100u);
  const double of_still = 1 - static_cast<double>(told) / static_cast<double>(still),
               of_moving = 1 - static_cast<double>(missed) / static_cast<double>(moving);
  EXPECT_LT(of_moving, 0.99);
  EXPECT_NEAR(*score.figures.at("static_accuracy").value, of_still, 1e-12);
  EXPECT_NEAR(*score.figures.at("dynamic_accuracy").value, of_moving, 1e-12);
}

}  // namespace
}  // namespace hueline::score
