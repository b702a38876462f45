// A trajectory that was calculated after the drive takes the place of the POS's solutions: points come to their true
// places, and files that do not belong to the drive are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulate/point_claim.hpp"
#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "core/calendar.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/post_trajectory.hpp"
#include "runtime/recording.hpp"
#include "sim/generate.hpp"
#include "sim/ins_model.hpp"
#include "sim/judge.hpp"
#include "sim/true_trajectory.hpp"
#include "sim/wire/timeline.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::test {
namespace {

using runtime::PostTrajectory;
using testing::HasSubstr;

class PostProcessed : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scenario_ = new sim::Scenario(config::load_scenario(HUELINE_SOURCE_DIR "/tests/scenarios/short_flawless.yaml"));
    // A POS that is worse than usual, so that its errors cannot be taken for anything else.
    scenario_->ins.position_sigma_m = 0.3;
    scenario_->ins.heading_sigma_deg = 0.1;
    const auto drive =
        sim::generate(*scenario_, (std::filesystem::temp_directory_path() / "hueline-post-trajectory-drive").string());
    ASSERT_TRUE(drive.ok());
    drive_ = new sim::Drive(*drive);
    auto judge = sim::Judge::open(*scenario_, drive_->cache_dir + "/truth.bin", {});
    ASSERT_TRUE(judge.ok());
    judge_ = new sim::Judge(std::move(*judge));
    rig_ = new config::Rig(config::parse_rig(apps::simulated_rig(*scenario_, {}, "lens"), "rig"));
    const TemporaryFolder folder;
    const std::string path = (folder / "true.sbet").string();
    ASSERT_TRUE(sim::write_true_trajectory(*scenario_, *drive_, path).ok());
    std::ifstream in(path, std::ios::binary);
    for (std::array<double, 17> record; in.read(reinterpret_cast<char*>(record.data()), sizeof(record));)
      true_.push_back(record);
    ASSERT_GT(true_.size(), 5000u);
  }

  /// Writes the true trajectory. `change` may change the 17 numbers of a record.
  std::string write(const std::function<void(std::array<double, 17>&)>& change = {}) {
    const std::string path = (folder_ / "sbet.out").string();
    std::ofstream out(path, std::ios::binary);
    for (std::array<double, 17> record : true_) {
      if (change) change(record);
      out.write(reinterpret_cast<const char*>(record.data()), sizeof(record));
    }
    return path;
  }
  static constexpr std::size_t kTime = 0, kLatitude = 1, kLongitude = 2, kHeight = 3, kRoll = 7, kPitch = 8,
                               kHeading = 9, kWander = 10;

  struct Places : runtime::ProductSink {
    sim::Spread errors;
    std::uint64_t points = 0;
    double path_m = 0;
    std::optional<InsSolution> last;
    void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override {
      const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(block.origin);
      for (const ColouredPoint& point : block.points) {
        ++points;
        sim::Claim claim = apps::claim_of(point, T_ecef_enu, 0, false);
        const auto truth = judge_->true_return(claim.channel, claim.fired_gps_ns);
        if (!truth) continue;
        const auto scene = sim::scene_origin(*scenario_);
        const sim::Vec3 place = sim::ecef_from_geodetic(scene) +
                                sim::R_ecef_enu(scene) * sim::Vec3{truth->beam_east, truth->beam_north, truth->beam_up};
        errors.add(length(place - *claim.place_ecef));
      }
    }
    void on_solution(const InsSolution& solution) override { last = solution; }
  };

  template <class Use>
  static Status packets(const Use& use) {
    sim::TimelineConfig config;
    config.laser_model = scenario_->laser.model;
    const auto timeline = sim::build_timeline(*drive_, config);
    if (!timeline.ok()) return timeline.error();
    return apps::for_each_simulated_packet(*drive_, *timeline, *rig_, use);
  }

  /// Drives with the POS's solutions, or with the trajectory.
  static Places drive(PostTrajectory* trajectory) {
    Places places;
    runtime::Pipeline pipeline(*rig_, 1, places, trajectory);
    std::uint64_t sequence = 0;
    EXPECT_TRUE(packets([&](const Packet& packet) {
                  Packet numbered = packet;
                  numbered.sequence = sequence++;
                  pipeline.process(numbered);
                  return true;
                }).ok());
    pipeline.flush();
    return places;
  }

  static Result<std::unique_ptr<PostTrajectory>> open(const PostTrajectory::Config& config) {
    return PostTrajectory::open(config, [](const std::function<void(const InsSolution&)>& use) {
      return runtime::for_each_solution(
          *rig_, [](const auto& take) { return packets(take); }, use);
    });
  }

  test::TemporaryFolder folder_;
  static inline sim::Scenario* scenario_ = nullptr;
  static inline sim::Drive* drive_ = nullptr;
  static inline sim::Judge* judge_ = nullptr;
  static inline config::Rig* rig_ = nullptr;
  static inline std::vector<std::array<double, 17>> true_;
};

TEST_F(PostProcessed, PointsComeToTheirTruePlaces) {
  const Places before = drive(nullptr);
  auto trajectory = open({write(), {}, false, {}});
  ASSERT_TRUE(trajectory.ok()) << trajectory.error().message;
  const Places after = drive(trajectory->get());
  EXPECT_TRUE((*trajectory)->status().ok());
  EXPECT_GT(before.errors.count(), 1000u);
  EXPECT_GE(after.points, before.points);
  EXPECT_GT(before.errors.rms(), 0.1);
  EXPECT_LT(after.errors.rms(), 0.002);
  EXPECT_LT(after.errors.max(), 0.02) << "the scanner sends azimuths in steps of 0.01 deg";
  const auto& comparison = (*trajectory)->comparison();
  EXPECT_EQ(comparison.heading, "platform heading minus wander angle");
  EXPECT_GT(comparison.compared, 100u);
  EXPECT_GT(std::hypot(comparison.rms_enu[0], comparison.rms_enu[1]), 0.1);
  ASSERT_FALSE(comparison.stretches.empty());
  // What comes long before and after the drive does not belong to it.
  EXPECT_LT(after.last->time, gps_time_ns(drive_->ins.back().gps_ns + 4'000'000'000));
}

/// The wander angle of these files is 0.02 rad.
TEST_F(PostProcessed, AHeadingThatIsWrittenOtherwiseIsReadAsThePosSays) {
  for (const std::pair<double, std::string>& way :
       {std::pair<double, std::string>(-1, "platform heading"), {-2, "platform heading plus wander angle"}}) {
    auto trajectory = open({write([&](auto& v) { v[kHeading] += way.first * v[kWander]; }), {}, false, {}});
    ASSERT_TRUE(trajectory.ok()) << trajectory.error().message;
    EXPECT_EQ((*trajectory)->comparison().heading, way.second);
    EXPECT_LT(drive(trajectory->get()).errors.rms(), 0.002) << way.second;
  }
}

TEST_F(PostProcessed, UtcTimesAreFoundAndRead) {
  const auto to_utc = [](auto& v) { v[kTime] -= 18; };
  const auto refused = open({write(to_utc), {}, false, {}});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::Invalid);
  EXPECT_THAT(refused.error().message, HasSubstr("--trajectory-time utc"));
  auto trajectory = open({write(to_utc), {}, true, {}});
  ASSERT_TRUE(trajectory.ok()) << trajectory.error().message;
  EXPECT_LT(drive(trajectory->get()).errors.rms(), 0.002);
}

TEST_F(PostProcessed, TheTrajectoryOfAnotherPointOfTheVehicle) {
  const std::string path = write([&](auto& v) {
    // 1.5 m before and 0.8 m above the POS's point, on a nearly level road.
    v[kLatitude] += 1.5 * std::cos(v[kHeading]) / 6.37e6;
    v[kLongitude] += 1.5 * std::sin(v[kHeading]) / (6.387e6 * std::cos(v[kLatitude]));
    v[kHeight] += 0.8;
  });
  auto other = open({path, {}, false, {}}), moved = open({path, {}, false, {{0, 1.5, 0.8}}});
  ASSERT_TRUE(other.ok() && moved.ok());
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR((*other)->comparison().mean_body[i] - (*moved)->comparison().mean_body[i],
                (std::array<double, 3>{0, 1.5, 0.8}[i]), 0.05);
  EXPECT_LT(drive(moved->get()).errors.rms(), 0.05);
}

TEST_F(PostProcessed, FilesOfAnotherDriveAreRefused) {
  const auto refused = [&](const std::function<void(std::array<double, 17>&)>& change) {
    const auto opened = open({write(change), {}, false, {}});
    return opened.ok() ? std::string() : opened.error().message;
  };
  EXPECT_THAT(refused([](auto& v) { v[kTime] += 7200; }), HasSubstr("of another drive"));
  EXPECT_THAT(refused([](auto& v) { v[kLatitude] += 1e-4; }), HasSubstr("of another drive"));
  EXPECT_THAT(refused([](auto& v) { v[kLatitude] += 3e-6; }), HasSubstr("lies 19.")) << "in metres";
  EXPECT_THAT(refused([](auto& v) { v[kHeight] -= 48; }), HasSubstr("m below where the POS was"));
  EXPECT_THAT(refused([](auto& v) { v[kHeading] += 1.5708; }), HasSubstr("for the axes of the POS"));
  EXPECT_THAT(refused([](auto& v) { std::swap(v[kRoll], v[kPitch]), v[kRoll] += 0.3; }),
              HasSubstr("for the axes of the POS"));
}

TEST_F(PostProcessed, AFileThatHasNoAccuraciesOfTheTrajectoryIsRefused) {
  const std::string sbet = write();
  const auto accuracies = [&](double later) {
    const std::string path = (folder_ / "smrmsg.out").string();
    std::ofstream out(path, std::ios::binary);
    for (const auto& record : true_) {
      std::array<double, 10> sigma{record[kTime] + later, 0.02, 0.02, 0.03, 0.01, 0.01, 0.01, 1, 1, 2};
      out.write(reinterpret_cast<const char*>(sigma.data()), sizeof(sigma));
    }
    return path;
  };
  auto trajectory = open({sbet, accuracies(0), false, {}});
  ASSERT_TRUE(trajectory.ok()) << trajectory.error().message;
  EXPECT_EQ((*trajectory)->comparison().with_sigma, (*trajectory)->comparison().records);
  const auto late = open({sbet, accuracies(900), false, {}});
  ASSERT_FALSE(late.ok());
  EXPECT_THAT(late.error().message, HasSubstr("none is within 2 s"));
  const std::string text = (folder_ / "solution.pos").string();
  std::ofstream(text) << std::string(400, '%') << "\n";
  const auto read = open({text, {}, false, {}});
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.error().message, HasSubstr("is a text"));
  const auto twice = open({sbet, sbet, false, {}});
  ASSERT_FALSE(twice.ok()) << "a trajectory is no file of accuracies";
  EXPECT_EQ(twice.error().code == ErrorCode::Invalid || twice.error().code == ErrorCode::Malformed, true);
}

TEST_F(PostProcessed, WhereItHasNothingPointsHaveNoPlace) {
  const double middle =
      to_seconds(to_gps_week(gps_time_ns((drive_->begin_gps_ns + drive_->end_gps_ns) / 2)).time_of_week);
  auto trajectory = open({write([&](auto& v) {
                            if (v[kTime] > middle) v[kLatitude] = 9;  // impossible: left out
                          }),
                          {},
                          false,
                          {}});
  ASSERT_TRUE(trajectory.ok()) << trajectory.error().message;
  EXPECT_GT((*trajectory)->comparison().left_out, 1000u);
  EXPECT_THAT((*trajectory)->comparison().text(), HasSubstr("covers"));
  const Places half = drive(trajectory->get());
  EXPECT_GT(half.points, 500u);
  EXPECT_LT(half.points, drive(nullptr).points * 3 / 4);
  EXPECT_LT(half.errors.rms(), 0.002);
}

}  // namespace
}  // namespace hueline::test
