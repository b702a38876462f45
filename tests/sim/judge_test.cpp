#include "sim/judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "sim/earth.hpp"
#include "sim/generate.hpp"
#include "sim/ins_model.hpp"
#include "sim/vehicle.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

/// One drive for all tests: no noise, no vignetting, furnished street.
class JudgeTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder("hueline-judge");
    scenario_ = new Scenario(small_scenario());
    scenario_->noise = false;
    scenario_->camera.vignetting = 0;
    scenario_->camera.lens_width = 152;
    scenario_->camera.lens_height = 128;
    auto drive = generate(*scenario_, folder_->path());
    ASSERT_TRUE(drive.ok()) << drive.error().message;
    drive_ = new Drive(std::move(*drive));
  }
  static void TearDownTestSuite() {
    delete drive_;
    delete scenario_;
    delete folder_;
  }
  static Judge open(const Judge::Config& config = {}) {
    auto judge = Judge::open(*scenario_, drive_->cache_dir + "/truth.bin", config);
    EXPECT_TRUE(judge.ok());
    return std::move(*judge);
  }
  static std::vector<TrueReturn> returns(std::size_t every) {
    auto reader = TruthReader::open(drive_->cache_dir + "/truth.bin");
    std::vector<TrueReturn> out;
    for (std::size_t n = 0;;) {
      auto packet = reader->next_packet();
      if (!packet.ok()) return out;
      for (const auto& r : *packet)
        if (n++ % every == 0) out.push_back(r);
    }
  }
  static inline TemporaryFolder* folder_ = nullptr;
  static inline Scenario* scenario_ = nullptr;
  static inline Drive* drive_ = nullptr;
};

/// Computes from the scenario alone, separately from the judge, the pixel of each lens that shows a true place.
struct Seer {
  explicit Seer(const Scenario& s) : motion(s), rig(rig_truth(s)) {}
  std::optional<TruePixel> pixel(const CameraExposure& e, std::size_t lens, Vec3 p_enu) const {
    const Pose T =
        motion.T_enu_body(e.exposure_start_gps_ns + e.exposure_ns / 2) * rig.T_body_head * rig.lenses[lens].T_head_lens;
    const auto p = rig.lenses[lens].project(inverse(T) * p_enu);
    return p && rig.lenses[lens].contains(*p) ? p : std::nullopt;
  }
  Motion motion;
  RigTruth rig;
};

TEST_F(JudgeTest, TrueClaimsHaveNoErrorAndShiftedOnesHaveTheirs) {
  Judge judge = open();
  const Seer seer(*scenario_);
  const auto& e = drive_->exposures[1];
  std::size_t claims = 0;
  for (const TrueReturn& r : returns(31))
    for (std::uint8_t lens = 0; lens < 6; ++lens) {
      const auto pixel = seer.pixel(e, lens, {r.beam_east, r.beam_north, r.beam_up});
      if (!pixel) continue;
      Claim claim;
      claim.fired_gps_ns = r.fired_gps_ns + 900;  // the wire carries whole microseconds
      claim.channel = r.channel;
      claim.exposure = e.number;
      claim.lens = lens;
      claim.u = pixel->u;
      claim.v = pixel->v;
      claim.red = r.red, claim.green = r.green, claim.blue = r.blue;
      const auto verdict = judge.judge(claim);
      ASSERT_TRUE(verdict);
      // The unit of the truth file makes an error of 0.5 um at a distance of 0.5 m or more.
      EXPECT_LT(verdict->error_px, 2e-3);
      EXPECT_EQ(verdict->colour_difference, 0);
      EXPECT_EQ(verdict->surface, r.surface);
      judge.add(claim);
      // One pixel along the columns near the centre is 1 / focal length radians.
      if (std::hypot(pixel->u - 76, pixel->v - 64) < 8) {
        claim.u += 0.25;
        claim.green = static_cast<std::uint8_t>(claim.green ^ 8);
        const auto shifted = judge.judge(claim);
        const double expected = 0.25 / seer.rig.lenses[lens].focal_x * 8000 / (2 * kPi);
        EXPECT_NEAR(shifted->error_px, expected, 0.02 * expected);
        EXPECT_EQ(shifted->colour_difference, 8);
      }
      ++claims;
    }
  EXPECT_GT(claims, 500u);
  EXPECT_EQ(judge.all().error_px.count(), claims);
  EXPECT_LT(judge.all().error_px.rms(), 5e-4);
  std::uint64_t by_lens = 0;
  for (const auto& f : judge.by_lens()) by_lens += f.error_px.count();
  EXPECT_EQ(by_lens, claims);
  EXPECT_EQ(judge.unmatched(), 0u);
}

TEST_F(JudgeTest, WhatCannotBeMatchedIsCounted) {
  Judge judge = open();
  const TrueReturn r = returns(1)[1000];
  Claim claim;
  claim.fired_gps_ns = r.fired_gps_ns;
  claim.channel = r.channel;
  claim.is_panorama_pixel = true;
  EXPECT_TRUE(judge.judge(claim));
  for (const auto& spoil :
       std::vector<void (*)(Claim&)>{[](Claim& c) { c.channel = 40; }, [](Claim& c) { c.fired_gps_ns += 27'000; },
                                     [](Claim& c) { c.exposure = 9; }, [](Claim& c) { c.lens = 6; }}) {
    Claim wrong = claim;
    spoil(wrong);
    judge.add(wrong);
  }
  EXPECT_EQ(judge.unmatched(), 4u);
  EXPECT_EQ(judge.all().error_px.count(), 0u);
  Scenario other = *scenario_;
  other.seed = 2;
  EXPECT_EQ(Judge::open(other, drive_->cache_dir + "/truth.bin", {}).error().code, ErrorCode::Invalid);
}

TEST_F(JudgeTest, PanoramaByHand) {
  const Judge judge = open();
  const auto ahead = judge.panorama_pixel({1, 0, 0}), right = judge.panorama_pixel({0, -2, 0}),
             up = judge.panorama_pixel({0, 0, 1});
  EXPECT_NEAR(ahead.u, 3999.5, 1e-9);
  EXPECT_NEAR(ahead.v, 1999.5, 1e-9);
  EXPECT_NEAR(right.u, 5999.5, 1e-9);
  EXPECT_NEAR(up.v, -0.5, 1e-9);
  EXPECT_NEAR(judge.panorama_pixel({-1, -1e-9, 0}).u, 7999.5 - 1e-6, 1e-5);
  const Vec3 d = normalised({-0.3, 0.8, -0.2});
  EXPECT_LT(angle_between(judge.panorama_direction(judge.panorama_pixel(d)), d), 1e-14);
  // A shift of two pixels along the horizon.
  EXPECT_NEAR(angle_between(judge.panorama_direction({100, 1999.5}), judge.panorama_direction({102, 1999.5})),
              2 * 2 * kPi / 8000, 1e-12);
}

TEST_F(JudgeTest, FindsTheTruthOfAFiring) {
  const Judge judge = open();
  for (const TrueReturn& r : returns(997)) {
    const auto found = judge.true_return(r.channel, r.fired_gps_ns + 400);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->surface, r.surface);
    EXPECT_EQ(found->green, r.green);
    EXPECT_NEAR(found->east, r.east, 1e-6);
    EXPECT_NEAR(found->up, r.up, 1e-6);
    EXPECT_EQ(found->beam_north, r.beam_north);
  }
  EXPECT_FALSE(judge.true_return(40, returns(1)[0].fired_gps_ns));
}

TEST_F(JudgeTest, PlacesAreComparedInEcef) {
  Judge judge = open();
  const TrueReturn r = returns(1)[500];
  const GeodeticPlace origin = scene_origin(*scenario_);
  Claim claim;
  claim.fired_gps_ns = r.fired_gps_ns;
  claim.channel = r.channel;
  claim.is_panorama_pixel = true;
  claim.place_ecef =
      R_ecef_enu(origin) * Vec3{r.beam_east, r.beam_north, r.beam_up + 0.03} + ecef_from_geodetic(origin);
  EXPECT_NEAR(judge.judge(claim)->place_error_m, 0.03, 1e-6);
}

/// Laser and camera must show the same world: the colours in the laser's truth fit the raw image best where the points
/// project to, and fit worse the farther the image is shifted.
TEST_F(JudgeTest, RenderedPixelsShowWhatTheLaserHit) {
  const Seer seer(*scenario_);
  const Judge judge = open();
  const auto& e = drive_->exposures[1];
  std::ifstream in(drive_->cache_dir + "/" + e.image_file, std::ios::binary);
  const std::string image{std::istreambuf_iterator<char>(in), {}};
  constexpr int kReach = 2;
  std::array<std::array<double, 2 * kReach + 1>, 2> misfit{};  // shifted along u, and along v
  std::size_t count = 0;
  for (const TrueReturn& r : returns(1)) {
    if (judge.surfaces()[r.surface].rfind("crown", 0) == 0) continue;  // leaves are smaller than a pixel
    for (std::size_t lens = 0; lens < 6; ++lens) {
      const auto pixel = seer.pixel(e, lens, {r.east, r.north, r.up});
      if (!pixel || pixel->u < 5 || pixel->v < 5 || pixel->u > 146 || pixel->v > 122) continue;
      ++count;
      for (std::size_t axis = 0; axis < 2; ++axis)
        for (int shift = -kReach; shift <= kReach; ++shift) {
          const auto u = std::lround(pixel->u + (axis == 0 ? shift : 0)),
                     v = std::lround(pixel->v + (axis == 1 ? shift : 0));
          const int expected = v % 2 == 0 ? (u % 2 == 0 ? r.red : r.green) : (u % 2 == 0 ? r.green : r.blue);
          const auto at = static_cast<std::size_t>((seer.rig.row_of(lens) + v) * seer.rig.image_width() +
                                                   seer.rig.column_of(lens) + u);
          misfit[axis][static_cast<std::size_t>(shift + kReach)] +=
              std::min(40, std::abs(static_cast<int>(static_cast<unsigned char>(image[at])) - expected));
        }
    }
  }
  ASSERT_GT(count, 10000u);
  for (const auto& m : misfit) {
    const double vertex = 0.5 * (m[1] - m[3]) / (m[1] - 2 * m[2] + m[3]);
    std::printf("mean misfit %.2f %.2f %.2f %.2f %.2f of 255 at shifts -2 .. 2 px, least at %.2f px\n",
                m[0] / static_cast<double>(count), m[1] / static_cast<double>(count), m[2] / static_cast<double>(count),
                m[3] / static_cast<double>(count), m[4] / static_cast<double>(count), vertex);
    EXPECT_LT(std::abs(vertex), 0.1);
    EXPECT_LT(m[2], 0.93 * std::min(m[1], m[3]));
    EXPECT_LT(std::max(m[1], m[3]), std::min(m[0], m[4]));
  }
}

TEST(Spread, FiguresOfAKnownList) {
  Spread spread;
  for (int i = 1; i <= 1000; ++i) spread.add(i * 1e-3);
  EXPECT_EQ(spread.count(), 1000u);
  EXPECT_NEAR(spread.quantile(0.95), 0.95, 0.012);
  EXPECT_NEAR(spread.quantile(0.5), 0.5, 0.007);
  EXPECT_EQ(spread.max(), 1.0);
  EXPECT_NEAR(spread.rms(), 1e-3 * std::sqrt(1001 * 2001 / 6.0), 1e-9);
  EXPECT_EQ(Spread().quantile(0.5), 0);
}

}  // namespace
}  // namespace hueline::sim
