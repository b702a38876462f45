#include "calibration/targets/station_orientation.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/calibration/targets/simulated_scan.hpp"

namespace hueline::calibration {
namespace {

using testing::Test;

/// One station, simulated once: a coarse panorama, with fine windows around targets, decoys and clutter.
const SimulatedStation& simulated(int station) {
  const auto make = [](int index) {
    sim::StaticSiteConfig site;
    site.seed = 7;
    site.station = index;
    site.radius_m = index % 2 ? 0.145 : 0.0725;
    sim::StaticScannerConfig scanner;
    scanner.step_deg = 0.5;
    scanner.window_step_deg = 0.0135;
    scanner.window_half_deg = 0.2;
    return simulate_station(site, scanner);
  };
  static const SimulatedStation stations[] = {make(0), make(1)};
  return stations[station];
}

Result<StationResult> orient(const SimulatedStation& station, std::vector<SurveyedTarget> targets,
                             const TargetsConfig& config = {}) {
  const SurveyedStation stations[] = {station.station()};
  return orient_station(MemoryScan(station.xyz), stations, 0, targets, config);
}

void expect_refused(const Result<StationResult>& result, const std::string& words) {
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::Invalid);
  EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
}

TEST(StationOrientation, FindsEveryTargetThatWasHitAndNoDecoy) {
  for (int i = 0; i < 2; ++i) {
    const SimulatedStation& station = simulated(i);
    const auto result = orient(station, station.targets());
    ASSERT_TRUE(result.ok()) << result.error().message;
    const Eigen::Vector3d place = eigen(station.site->place_survey);
    for (std::size_t k = 0; k < result->targets.size(); ++k) {
      const TargetOutcome& outcome = result->targets[k];
      if (station.truth[k].hits >= 4) {
        EXPECT_TRUE(outcome.is_found()) << station.site->spheres[k].name << ": " << outcome.reason;
      }
      if (!outcome.is_found()) continue;
      const Eigen::Vector3d truth = place + eigen(station.site->spheres[k].centre);
      EXPECT_LT((result->adjusted.orientation.survey_from_scanner(outcome.centre_scanner) - truth).norm(), 0.04)
          << station.site->spheres[k].name;
    }
    // The scanner's place must be within five of the sigmas that the adjustment states.
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LT(std::abs(result->adjusted.orientation.T_survey_scanner.translation[axis] - place[axis]),
                5 * std::sqrt(result->adjusted.covariance(3 + axis, 3 + axis)));
    EXPECT_EQ(result->points_read, station.xyz.size() / 3);
  }
}

TEST(StationOrientation, IsTheSameWithAnyNumberOfThreads) {
  const SimulatedStation& station = simulated(0);
  TargetsConfig config;
  config.threads = 1;
  const auto one = orient(station, station.targets(), config);
  config.threads = 5;
  const auto five = orient(station, station.targets(), config);
  ASSERT_TRUE(one.ok() && five.ok());
  EXPECT_EQ(one->adjusted.orientation.T_survey_scanner.translation,
            five->adjusted.orientation.T_survey_scanner.translation);
  EXPECT_EQ(one->adjusted.covariance, five->adjusted.covariance);
  EXPECT_EQ(one->ring_points, five->ring_points);
}

TEST(StationOrientation, AMovedTargetIsRejectedByName) {
  const SimulatedStation& station = simulated(1);
  auto targets = station.targets();
  targets[1].position.xyz.x() += 0.09;
  const auto result = orient(station, targets);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->targets[1].state, TargetState::Rejected) << name(result->targets[1].state);
  EXPECT_FALSE(result->targets[1].reason.empty());
  EXPECT_EQ(result->targets[0].state, TargetState::Used);
}

TEST(StationOrientation, RefusesWhatDoesNotBelongTogether) {
  const SimulatedStation& station = simulated(0);
  const auto good = station.targets();

  auto swapped = good;
  for (auto& target : swapped) std::swap(target.position.xyz.x(), target.position.xyz.y());
  auto station_swapped = station.station();
  std::swap(station_swapped.position.xyz.x(), station_swapped.position.xyz.y());
  const SurveyedStation stations[] = {station_swapped};
  expect_refused(orient_station(MemoryScan(station.xyz), stations, 0, swapped, {}), "swapped");

  auto feet = good;
  for (auto& target : feet)
    target.position.xyz =
        station.station().position.xyz + (target.position.xyz - station.station().position.xyz) * 3.2808;
  expect_refused(orient(station, feet), "station S01");

  auto millimetres = good;
  for (auto& target : millimetres)
    target.position.xyz =
        station.station().position.xyz + (target.position.xyz - station.station().position.xyz) * 1000;
  expect_refused(orient(station, millimetres), "millimetres");

  auto raised = station.station();
  raised.position.xyz.z() += 1.7;
  const SurveyedStation without_height[] = {raised};
  expect_refused(orient_station(MemoryScan(station.xyz), without_height, 0, good, {}), "station S01");

  expect_refused(orient(station, {good.begin(), good.begin() + 2}), "2 surveyed targets to orient by; at least 3");

  SimulatedStation in_millimetres = station;
  for (float& value : in_millimetres.xyz) value *= 1000;
  expect_refused(orient(in_millimetres, good), "millimetres");
}

TEST(StationOrientation, SaysWhoseScanItIsWhenStationsAreMixedUp) {
  const SimulatedStation &a = simulated(0), &b = simulated(1);
  const SurveyedStation stations[] = {a.station(), b.station()};
  auto targets = a.targets();
  for (const auto& target : b.targets()) targets.push_back(target);
  expect_refused(orient_station(MemoryScan(b.xyz), stations, 0, targets, {}), "its scan is that of station S02");
}

TEST(StationOrientation, RefusesTargetsOnALine) {
  const SimulatedStation& station = simulated(0);
  auto targets = station.targets();
  const Eigen::Vector3d a = targets[0].position.xyz, b = targets[1].position.xyz;
  for (std::size_t i = 2; i < targets.size(); ++i)
    targets[i].position.xyz = a + (b - a) * (0.3 * static_cast<double>(i));
  expect_refused(orient(station, targets), "one line");
}

/// A scanner and a few spheres in a room. The scanner's axes are those of the survey, rotated by 30 degrees about the
/// vertical.
struct Room {
  std::vector<SurveyedTarget> targets;
  SurveyedStation station{"room", {{100, 200, 10}}, {}, {}};
  Eigen::Matrix3d R_survey_scanner = Eigen::AngleAxisd(M_PI / 6, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::vector<float> xyz;

  explicit Room(std::span<const Eigen::Vector3d> from_station) {
    constexpr double kRadius_m = 0.0725, kStep = 0.004;  // rad
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0, 0.003);
    for (const Eigen::Vector3d& place : from_station) {
      targets.push_back(
          {fmt::format("T{}", targets.size() + 1), {station.position.xyz + place}, 0.001, kRadius_m, false, {}});
      const Eigen::Vector3d centre = R_survey_scanner.transpose() * place, sight = centre.normalized();
      const Eigen::Vector3d across = sight.unitOrthogonal(), down = sight.cross(across);
      const double half = kRadius_m / centre.norm();
      for (double a = -half; a < half; a += kStep)
        for (double b = -half; b < half; b += kStep) {
          const Eigen::Vector3d ray = (sight + a * across + b * down).normalized();
          const double along = ray.dot(centre), under = along * along - centre.squaredNorm() + kRadius_m * kRadius_m;
          if (under <= 0) continue;
          const Eigen::Vector3d hit = ray * (along - std::sqrt(under) + noise(random));
          for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(hit[axis]));
        }
    }
  }
  Result<StationResult> orient() const {
    return orient_station(MemoryScan(xyz), std::span(&station, 1), 0, targets, {});
  }
};

TEST(StationOrientation, AFieldOfThreeMetresIsEnough) {
  const Eigen::Vector3d places[] = {{-1.5, 4.0, 0.3}, {1.5, 4.2, -0.2}, {0.0, 4.5, 1.2}, {0.2, 3.4, -1.0}};
  const Room room(places);
  const auto found = room.orient();
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(std::ranges::all_of(found->targets, [](const auto& t) { return t.state == TargetState::Used; }));
  const auto& T = found->adjusted.orientation.T_survey_scanner;
  const double sigma = std::sqrt(found->adjusted.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff());
  EXPECT_GT(sigma * 180 / M_PI, 0.05)
      << "centres known to 6 mm in range, 1.5 m from their middle: that is what the case is about";
  EXPECT_LT(Eigen::AngleAxisd(T.rotation.toRotationMatrix().transpose() * room.R_survey_scanner).angle(), 3 * sigma);
  EXPECT_LT((T.translation - room.station.position.xyz).norm(), 0.01);
}

TEST(StationOrientation, ANarrowFieldSaysWhatItLeavesOpen) {
  // The field is 3 m long and a tenth as wide.
  const Eigen::Vector3d places[] = {{-1.5, 4.0, 0.0}, {1.5, 4.0, 0.05}, {0.0, 4.0, 0.4}};
  expect_refused(Room(places).orient(), "too near one line");
  expect_refused(Room(places).orient(), "while the centres are known to");
}

/// Target places around two stations, with or without noise.
TEST(Adjustment, StationsThatShareTargetsHelpEachOther) {
  const Orientation truth[] = {
      {{Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(0.02, 0.01, 1).normalized())),
        {512000, 4398000, 1200}},
       1},
      {{Eigen::Quaterniond(Eigen::AngleAxisd(-3.1, Eigen::Vector3d(0.0, 0.03, 1).normalized())),
        {512090, 4398030, 1210}},
       1}};
  std::vector<SurveyedPoint> targets;
  std::vector<CentreObservation> observations;
  const double offsets[5][3] = {{120, 10, 4}, {-60, 90, -8}, {-30, -110, 12}, {70, -60, 1}, {60, 80, 6}};
  for (std::size_t k = 0; k < 5; ++k) {
    const Eigen::Vector3d place =
        truth[0].T_survey_scanner.translation + Eigen::Vector3d(offsets[k][0], offsets[k][1], offsets[k][2]);
    targets.push_back({place, 0.010});
    for (std::size_t s = 0; s < 2; ++s)
      observations.push_back(
          {s, k, truth[s].T_survey_scanner.inverse().rotation * (place - truth[s].T_survey_scanner.translation),
           9e-6 * Eigen::Matrix3d::Identity()});
  }
  Orientation start[] = {truth[0], truth[1]};
  start[1].T_survey_scanner.rotation =
      start[1].T_survey_scanner.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
  start[1].T_survey_scanner.translation += Eigen::Vector3d(3, -2, 1);
  const auto both = adjust(start, targets, observations, {}, false);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_LT((both->stations[1].orientation.T_survey_scanner.translation - truth[1].T_survey_scanner.translation).norm(),
            1e-6);
  EXPECT_LT(both->chi_squared, 1e-6);
  EXPECT_EQ(both->freedom, 30 - 12);
  // One target is moved by 30 mm in one scan, and a clear residual appears there.
  observations[2].centre_scanner.x() += 0.030;
  const auto disturbed = adjust(start, targets, observations, {}, false);
  ASSERT_TRUE(disturbed.ok());
  EXPECT_GT(disturbed->chi_squared, 10);
}

TEST(Adjustment, RodriguesParametersAreThoseOfTheAntisymmetricMatrix) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.1, -0.2, 0.9).normalized()));
  const auto abc = rodrigues_parameters(q);
  ASSERT_TRUE(abc);
  Eigen::Matrix3d S;
  S << 0, -abc->z(), abc->y(), abc->z(), 0, -abc->x(), -abc->y(), abc->x(), 0;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  EXPECT_TRUE(((I - S).inverse() * (I + S)).isApprox(q.toRotationMatrix(), 1e-12));
  EXPECT_TRUE(rotation_from_rodrigues(*abc).toRotationMatrix().isApprox(q.toRotationMatrix(), 1e-12));
  EXPECT_FALSE(rodrigues_parameters(Eigen::Quaterniond(0, 0, 0, 1)));
}

TEST(RingFilter, KeepsWhatAPlainLoopKeeps) {
  std::vector<float> xyz;
  for (int i = 0; i < 10'007; ++i)
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>((i * (37 + 11 * axis) % 4001) / 20.0 - 100));
  xyz[300] = std::nanf("");
  const Ring rings[] = {{80, 80.4}, {20, 20.2}, {80.3, 81}, {150, 150.1}};
  std::vector<Eigen::Vector3f> kept;
  float farthest = 0;
  RingFilter(rings).keep(xyz, kept, farthest);
  std::vector<Eigen::Vector3f> plain;
  double plain_farthest = 0;
  for (std::size_t i = 0; i < xyz.size() / 3; ++i) {
    const double x = xyz[3 * i], y = xyz[3 * i + 1], z = xyz[3 * i + 2], d = std::sqrt(x * x + y * y + z * z);
    if (d > plain_farthest) plain_farthest = d;
    if ((d > 20 && d < 20.2) || (d > 80 && d < 81) || (d > 150 && d < 150.1))
      plain.emplace_back(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  }
  ASSERT_GT(plain.size(), 30u);
  EXPECT_EQ(kept, plain);
  EXPECT_NEAR(std::sqrt(farthest), plain_farthest, 1e-4);
}

}  // namespace
}  // namespace hueline::calibration
