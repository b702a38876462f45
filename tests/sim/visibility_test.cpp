// Compares which exposures saw a return with the images themselves.
#include "sim/visibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

#include "sim/camera_model.hpp"
#include "sim/generate.hpp"
#include "sim/sight_file.hpp"
#include "sim/truth_file.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

/// A busy street with images that are large enough, without noise, in linear light.
Scenario busy_scenario() {
  Scenario s = small_scenario();
  s.noise = false;
  s.scene = SceneKind::Traffic;
  s.street.road_width_m = 14;
  s.street.moving_cars = 3;
  s.street.moving_car_speed = 11;
  s.drive.lane_offset_m = 5.25;
  s.duration_s = 1.6;
  s.laser.vertical_offsets = false;
  s.camera.tone_curve = ToneCurve::Linear;
  s.camera.vignetting = 0;
  s.camera.auto_exposure = true;
  s.camera.lens_width = 306;
  s.camera.lens_height = 256;
  return s;
}

class VisibilityTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder("hueline-visibility");
    auto drive = generate(busy_scenario(), folder_->path());
    ASSERT_TRUE(drive.ok()) << drive.error().message;
    drive_ = new Drive(std::move(*drive));
    auto truth = TruthReader::open(drive_->cache_dir + "/truth.bin");
    ASSERT_TRUE(truth.ok());
    header_ = new TruthHeader(truth->header());
    returns_ = new std::vector<TrueReturn>;
    for (std::size_t n = 0;;) {
      auto packet = truth->next_packet();
      if (!packet.ok()) break;
      for (const auto& r : *packet)
        if (n++ % 7 == 0) returns_->push_back(r);
    }
  }
  static void TearDownTestSuite() {
    delete returns_;
    delete header_;
    delete drive_;
    delete folder_;
  }
  static inline TemporaryFolder* folder_ = nullptr;
  static inline Drive* drive_ = nullptr;
  static inline TruthHeader* header_ = nullptr;
  static inline std::vector<TrueReturn>* returns_ = nullptr;
};

TEST_F(VisibilityTest, ImagesShowWhatIsVisibleAndSomethingElseWhereItIsNot) {
  const Scenario scenario = busy_scenario();
  const Motion motion(scenario);
  const World world(scenario, motion);
  const Visibility visibility(scenario, motion, world);
  const RigTruth rig = rig_truth(scenario);
  const std::size_t number = 1;
  const auto image = PanoramicCamera(scenario, motion, world).expose(number, 2);
  const TrueExposure& exposure = header_->exposures[number];
  std::map<Sight, std::vector<double>> off;
  for (const TrueReturn& r : *returns_)
    for (std::size_t index = 0; index < rig.lenses.size(); ++index) {
      const Sight sight = visibility.sight(r, index, number);
      if (sight == Sight::Outside) continue;
      const TrueLens& lens = rig.lenses[index];
      const Pose T{{exposure.R_enu_head}, {exposure.p_enu_head[0], exposure.p_enu_head[1], exposure.p_enu_head[2]}};
      const auto pixel = lens.project(inverse(T * lens.T_head_lens) * Vec3{r.east, r.north, r.up});
      ASSERT_TRUE(pixel && lens.contains(*pixel));
      const int u = std::clamp(static_cast<int>(std::lround(pixel->u)), 0, 305),
                v = std::clamp(static_cast<int>(std::lround(pixel->v)), 0, 255);
      const std::size_t channel = v % 2 == 0 ? (u % 2 == 0 ? 0 : 1) : (u % 2 == 0 ? 1 : 2);
      const double expected = std::min(255.0f, 255 * exposure.lens_gain[index] * r.light[channel]);
      const double got =
          image[static_cast<std::size_t>(rig.row_of(index) + v) * static_cast<std::size_t>(rig.image_width()) +
                static_cast<std::size_t>(rig.column_of(index) + u)];
      off[sight].push_back(std::abs(got - expected) / std::max(10.0, expected));
    }
  const auto median = [](std::vector<double> x) {
    std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2), x.end());
    return x[x.size() / 2];
  };
  ASSERT_GT(off[Sight::Visible].size(), 5000u);
  ASSERT_GT(off[Sight::Occluded].size(), 100u);
  ASSERT_GT(off[Sight::OwnVehicle].size(), 100u);
  ASSERT_GT(off[Sight::Moved].size(), 20u);
  EXPECT_LT(median(off[Sight::Visible]), 0.06);
  EXPECT_GT(median(off[Sight::Occluded]), 0.2);
  EXPECT_GT(median(off[Sight::OwnVehicle]), 0.4);
}

TEST_F(VisibilityTest, SightsOfEveryReturnAreThoseOfTheWorldForAnyNumberOfThreads) {
  Scenario scenario = busy_scenario();
  scenario.duration_s = 0.5;
  scenario.noise = true;  // so that most returns drop out, because every sight costs rays
  scenario.laser.dropout_probability = 0.9;
  scenario.camera.lens_width = 76;
  scenario.camera.lens_height = 64;
  scenario.camera.rate_hz = 20;
  const auto drive = generate(scenario, folder_->path());
  ASSERT_TRUE(drive.ok()) << drive.error().message;
  const auto written = [&](unsigned threads) {
    const std::string path = folder_->path() + "/sights" + std::to_string(threads);
    GenerateOptions options;
    options.threads = threads;
    const Status done = write_sights(scenario, *drive, path, {}, options);
    EXPECT_TRUE(done.ok()) << done.error().message;
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string bytes = written(1);
  EXPECT_EQ(bytes, written(3));
  ASSERT_EQ(bytes.substr(0, 8), "HLSIGHT1");
  std::size_t at = 8;
  const auto number = [&](auto x) {
    std::memcpy(&x, bytes.data() + at, sizeof x);
    at += sizeof x;
    return x;
  };
  const auto exposures = number(std::uint32_t{}), asked = number(std::uint32_t{});
  ASSERT_EQ(exposures, drive->exposures.size());
  ASSERT_EQ(asked, std::min<std::size_t>(9, exposures));

  const Motion motion(scenario);
  const World world(scenario, motion);
  const Visibility visibility(scenario, motion, world);
  auto truth = TruthReader::open(drive->cache_dir + "/truth.bin");
  ASSERT_TRUE(truth.ok());
  std::size_t n = 0, seen_somewhere = 0, unseen = 0;
  for (auto packet = truth->next_packet(); packet.ok(); packet = truth->next_packet()) {
    const auto first = number(std::uint32_t{}), count = number(std::uint32_t{});
    ASSERT_EQ(count, packet->size());
    ASSERT_LE(first + asked, exposures);
    for (const TrueReturn& point : *packet) {
      const auto mask = number(std::uint16_t{});
      if (n++ % 3 != 0) continue;
      for (std::uint32_t k = 0; k < asked; ++k) {
        bool seen = false;
        for (std::size_t lens = 0; lens < rig_truth(scenario).lenses.size(); ++lens)
          seen |= visibility.is_visible(point, lens, first + k);
        ASSERT_EQ((mask >> k & 1) != 0, seen);
      }
      (mask != 0 ? seen_somewhere : unseen) += 1;
    }
  }
  EXPECT_EQ(at, bytes.size());
  EXPECT_GT(seen_somewhere, 1000u);
  EXPECT_GT(unseen, 20u);
}

TEST_F(VisibilityTest, TruthTellsMovingSurfacesAndUnshadedColours) {
  std::size_t moving = 0;
  std::map<std::uint16_t, std::size_t> road;
  for (const TrueReturn& r : *returns_) {
    const std::string& name = header_->surfaces[r.surface];
    EXPECT_EQ(r.is_moving, name.starts_with("moving")) << name;
    moving += r.is_moving;
    // The colour that is seen is the surface's own colour times the light, which is at most that of sun and sky
    // together.
    for (std::size_t k = 0; k < 3; ++k) {
      const double coded = r.albedo[k] / 255.0,
                   albedo = coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
      // glass and paint add reflections of the sky
      const bool mirrors = name.find("car") != std::string::npos || r.is_moving;
      EXPECT_TRUE(mirrors || r.surface == 1 || r.light[k] <= 1.45 * albedo + 0.01) << name;
    }
    if (name == "road") ++road[r.albedo[0]];
  }
  EXPECT_GT(moving, 100u);
  // One surface in sun or shadow has a narrow range of its own colours, beside the paint on it.
  std::size_t all = 0, dark = 0;
  for (const auto& [level, count] : road) {
    all += count;
    if (level > 70 && level < 115) dark += count;
  }
  EXPECT_GT(all, 5000u);
  EXPECT_GT(dark, all * 8 / 10);
}

TEST_F(VisibilityTest, ASceneWithoutTargetsHasNoneAndThePitHasAll) {
  EXPECT_TRUE(header_->targets.empty());
  const TemporaryFolder folder("hueline-pit");
  Scenario scenario = small_scenario();
  scenario.scene = SceneKind::Targets;
  scenario.drive.stand_s = 2;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok());
  auto truth = TruthReader::open(drive->cache_dir + "/truth.bin");
  ASSERT_TRUE(truth.ok());
  ASSERT_EQ(truth->header().targets.size(), 10u);
  std::size_t on_spheres = 0;
  for (;;) {
    const auto packet = truth->next_packet();
    if (!packet.ok()) break;
    for (const TrueReturn& r : *packet)
      for (const SphereTarget& t : truth->header().targets)
        if (r.surface == t.surface) {
          EXPECT_NEAR(length(Vec3{r.east, r.north, r.up} - t.centre), t.radius_m, 4e-4);
          ++on_spheres;
        }
  }
  EXPECT_GT(on_spheres, 20u);
}

TEST_F(VisibilityTest, AnOlderCacheIsRenderedAgainAndStrangeFlagsAreRefused) {
  const std::string file = drive_->cache_dir + "/truth.bin";
  std::string bytes;
  {
    std::ifstream in(file, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  const TemporaryFolder folder("hueline-oldtruth");
  const std::string copy = folder.path() + "/truth.bin";
  std::string spoilt = bytes;
  spoilt[7] = '1';
  std::ofstream(copy, std::ios::binary) << spoilt;
  EXPECT_EQ(TruthReader::open(copy).error().code, ErrorCode::Malformed);
  spoilt = bytes;
  spoilt[bytes.size() - 11] = 7;  // flags of the last return
  std::ofstream(copy, std::ios::binary) << spoilt;
  auto reader = TruthReader::open(copy);
  ASSERT_TRUE(reader.ok());

  for (;;) {
    const auto packet = reader->next_packet();
    if (packet.ok()) continue;
    EXPECT_EQ(packet.error().code, ErrorCode::Malformed);
    break;
  }
}

TEST(Generate, ADriveOfAnOlderFormIsMadeAgain) {
  const TemporaryFolder folder("hueline-oldcache");
  Scenario scenario = small_scenario();
  scenario.duration_s = 0.5;
  scenario.camera.first_exposure_s = 0.1;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok());
  std::fstream(drive->cache_dir + "/truth.bin", std::ios::binary | std::ios::in | std::ios::out) << "HLTRUTH1";
  int told = 0;
  const auto again = generate(scenario, folder.path(), [&](const std::string&, double) { ++told; });
  ASSERT_TRUE(again.ok());
  EXPECT_GT(told, 0);
  EXPECT_TRUE(TruthReader::open(again->cache_dir + "/truth.bin").ok());
}

}  // namespace
}  // namespace hueline::sim
