// The watch over mounting and times, in a street of two painted walls. The test computes the images ray by ray.
#include "calibration/mount/calibration_watch.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr double kWall_m = 6, kSpeed = 8, kExposuresPerSecond = 2;
constexpr int kWidth = 320, kHeight = 240;
const Eigen::Vector3d kHead(0.1, 0.3, 0.2);

class Random {
 public:
  explicit Random(unsigned seed) : source_(seed) {}
  double uniform(double from, double to) { return from + (to - from) * static_cast<double>(source_() >> 11) * 0x1p-53; }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(source_() % count); }

 private:
  std::mt19937_64 source_;
};

GpsTime at_exposure(int number) {
  return gps_time_ns(1'400'000'000'000'000'000 + static_cast<std::int64_t>(number * 1e9 / kExposuresPerSecond));
}

Transform<Body, CameraHead> rig_head() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(1.57, Eigen::Vector3d::UnitZ())), kHead};
}

/// A lens to the left and one to the right.
std::vector<AlignmentLens> lenses() {
  std::vector<AlignmentLens> out;
  for (const double side : {1.0, -1.0}) {
    AlignmentLens lens;
    lens.values.width = kWidth;
    lens.values.height = kHeight;
    lens.values.focal_px = {200, 200};
    lens.values.principal_point_px = {159.5, 119.5};
    lens.max_angle = 1.0;
    Eigen::Matrix3d R;  // head: x forward, y left, z up; lens: x right, y down, z to the side
    R.col(0) = Eigen::Vector3d(side, 0, 0);
    R.col(1) = Eigen::Vector3d(0, 0, -1);
    R.col(2) = Eigen::Vector3d(0, side, 0);
    lens.T_head_lens.rotation = Eigen::Quaterniond(R);
    out.push_back(lens);
  }
  return out;
}

/// Paint of the walls, 0 to 1.
double paint(double y, double z, double seed) {
  return 0.5 + 0.2 * std::sin(2.6 * y + 4.2 * z + seed) + 0.15 * std::sin(-5.8 * y + 3.4 * z + 3 * seed) +
         0.15 * std::sin(1.6 * y - 6.2 * z + 2 * seed);
}

/// Both lenses at one exposure, of a head that is turned by `turn` (about its own axes) from the rig, and images that
/// are taken `late_s` later than they say. The laser sees the paint with noise and under a light of its own.
std::vector<AlignmentShot> shots_at(int number, const Eigen::Vector3d& turn, double late_s) {
  Random random(static_cast<unsigned>(100 + number));
  const double seed = 1.7 * number;
  auto samples = std::make_shared<std::vector<LaserSample>>();
  for (int i = 0; i < 20000; ++i) {
    const double side = random.uniform(-1, 1) < 0 ? -kWall_m : kWall_m, y = random.uniform(-6, 6),
                 z = random.uniform(-4.5, 4.5);
    const double intensity =
        0.7 * paint(y, z, seed + side) + 0.1 * std::sin(0.7 * y + seed) + random.uniform(-0.15, 0.15);
    samples->push_back({Eigen::Vector3d(side, y, z).cast<float>(), static_cast<float>(intensity), 0, 0});
  }
  HeadCorrection by = HeadCorrection::Zero();
  by.head<3>() = turn;
  const Transform<Body, CameraHead> T_body_head = corrected(rig_head(), by);
  const auto all = lenses();
  std::vector<AlignmentShot> out;
  for (std::size_t l = 0; l < all.size(); ++l) {
    AlignmentShot shot;
    shot.lens = l;
    shot.samples = samples;
    shot.velocity_body = {0, kSpeed, 0};
    shot.image.width = kWidth;
    shot.image.height = kHeight;
    const Transform<Body, Lens> T = T_body_head * all[l].T_head_lens;
    const Eigen::Vector3d from = T.translation + Eigen::Vector3d(0, kSpeed * late_s, 0);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector3d along = T.rotation * Eigen::Vector3d((u - 159.5) / 200, (v - 119.5) / 200, 1);
        const double wall = along.x() > 0 ? kWall_m : -kWall_m;
        const Eigen::Vector3d p = from + along * ((wall - from.x()) / along.x());
        const double grey = 200 * paint(p.y(), p.z(), seed + wall) + random.uniform(-4, 4);
        shot.image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0)));
      }
    out.push_back(std::move(shot));
  }
  return out;
}

CalibrationWatch watch() { return {lenses(), rig_head(), CalibrationWatchConfig{}}; }

/// What the lenses say at each of `count` exposures, from exposure `first` on.
std::vector<WatchedShot> look(int first, int count, const Eigen::Vector3d& turn, double late_s) {
  const CalibrationWatch one = watch();
  std::vector<WatchedShot> out;
  for (int i = first; i < first + count; ++i) {
    WatchedShot sum;
    for (const AlignmentShot& shot : shots_at(i, turn, late_s))
      sum += one.look_at(shot, (i + 2 * static_cast<int>(shot.lens)) % 4);
    out.push_back(sum);
  }
  return out;
}

constexpr int kMinute = static_cast<int>(60 * kExposuresPerSecond);

/// A minute as the rig says.
const std::vector<WatchedShot>& right_minute() {
  static const std::vector<WatchedShot> kMade = look(0, kMinute, Eigen::Vector3d::Zero(), 0);
  return kMade;
}

/// Drives the right minute, and then one that drifted. Returns the last drift, and when the watch noticed.
CalibrationDrift drive(const std::vector<WatchedShot>& drifted, double& after_s) {
  CalibrationWatch out = watch();
  int number = 0;
  for (const WatchedShot& each : right_minute()) out.add(at_exposure(number++), each);
  EXPECT_TRUE(out.drift() && !out.drift()->has_turned && !out.drift()->is_late) << "before anything drifted";
  CalibrationDrift last;
  after_s = 1e9;
  for (const WatchedShot& each : drifted) {
    out.add(at_exposure(number++), each);
    const auto drift = out.drift();
    if (!drift) continue;
    last = *drift;
    if (last.has_turned || last.is_late) after_s = std::min(after_s, (number - kMinute) / kExposuresPerSecond);
  }
  return last;
}

TEST(CalibrationWatch, NoticesThreeHundredthsOfADegreeAboutEachAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d turn = 0.03 * kRadPerDeg * Eigen::Vector3d::Unit(axis);
    double after_s;
    const CalibrationDrift drift = drive(look(kMinute, kMinute, turn, 0), after_s);
    const Eigen::Vector3d found_deg = drift.change.head<3>() * kDegPerRad,
                          sigma_deg = drift.change_covariance.diagonal().head<3>().cwiseSqrt() * kDegPerRad;
    std::printf("  turned about axis %d: noticed after %.1f s; change %.4f %.4f %.4f deg, sigma %.4f %.4f %.4f\n", axis,
                after_s, found_deg.x(), found_deg.y(), found_deg.z(), sigma_deg.x(), sigma_deg.y(), sigma_deg.z());
    EXPECT_LT(after_s, 60);
    EXPECT_TRUE(drift.has_turned);
    EXPECT_FALSE(drift.is_late);
    EXPECT_LT((drift.change.head<3>() - turn).norm() * kDegPerRad, 0.01);
    EXPECT_LT((drift.change.head<3>() - turn).norm(),
              4 * std::sqrt(drift.change_covariance.topLeftCorner<3, 3>().trace()));
  }
}

TEST(CalibrationWatch, NoticesAMillisecond) {
  double after_s;
  const CalibrationDrift drift = drive(look(kMinute, kMinute, Eigen::Vector3d::Zero(), 0.001), after_s);
  const double sigma_ms = std::sqrt(drift.change_covariance(3, 3)) * 1e3;
  std::printf("  late by 1 ms: noticed after %.1f s; change %.3f ms, sigma %.3f\n", after_s, drift.change[3] * 1e3,
              sigma_ms);
  EXPECT_LT(after_s, 60);
  EXPECT_TRUE(drift.is_late);
  EXPECT_FALSE(drift.has_turned);
  EXPECT_NEAR(drift.change[3] * 1e3, 1, 0.2);
  EXPECT_NEAR(drift.change[3] * 1e3, 1, 4 * sigma_ms);
}

/// Ten hours of driving, put together from stretches of five seconds of two minutes that are as the rig says, drawn at
/// random.
TEST(CalibrationWatch, GivesNoFalseAlarmInTenHours) {
  std::vector<WatchedShot> drawn_from = right_minute();
  for (const WatchedShot& each : look(kMinute, kMinute, Eigen::Vector3d::Zero(), 0)) drawn_from.push_back(each);
  constexpr std::size_t kStretch = static_cast<std::size_t>(5 * kExposuresPerSecond);
  constexpr int kHours = 10;
  CalibrationWatch one = watch();
  Random random(5);
  int number = 0, alarms = 0, looks = 0;
  double most_turn_deg = 0, most_late_ms = 0;
  bool was_alarm = false;
  while (number < kHours * 3600 * static_cast<int>(kExposuresPerSecond)) {
    const std::size_t from = random.below(drawn_from.size() - kStretch);
    for (std::size_t i = 0; i < kStretch; ++i) one.add(at_exposure(number++), drawn_from[from + i]);
    const auto drift = one.drift();
    if (!drift) continue;
    ++looks;
    const bool is_alarm = drift->has_turned || drift->is_late;
    alarms += is_alarm && !was_alarm;
    was_alarm = is_alarm;
    most_turn_deg = std::max(most_turn_deg, drift->change.head<3>().cwiseAbs().maxCoeff() * kDegPerRad);
    most_late_ms = std::max(most_late_ms, std::abs(drift->change[3]) * 1e3);
  }
  std::printf("  %d looks in %d h: %d false alarms; largest change %.4f deg, %.3f ms\n", looks, kHours, alarms,
              most_turn_deg, most_late_ms);
  EXPECT_GT(looks, 7000);
  EXPECT_EQ(alarms, 0);
}

TEST(CalibrationWatch, ForgetsWhatIsOlderThanItsWindow) {
  const auto turned = look(kMinute, kMinute, Eigen::Vector3d(0, 0, 0.1 * kRadPerDeg), 0);
  CalibrationWatch one = watch();
  int number = 0;
  for (const auto* minute : {&right_minute(), &turned})
    for (const WatchedShot& each : *minute) one.add(at_exposure(number++), each);
  ASSERT_TRUE(one.drift());
  EXPECT_TRUE(one.drift()->has_turned);
  for (int round = 0; round < 2; ++round)
    for (const WatchedShot& each : right_minute()) one.add(at_exposure(number++), each);
  ASSERT_TRUE(one.drift());
  EXPECT_FALSE(one.drift()->has_turned);
  EXPECT_LE(one.drift()->to - one.drift()->from, std::chrono::seconds(45));
}

TEST(CalibrationWatch, SaysNothingWithoutARelation) {
  CalibrationWatch one = watch();
  for (int i = 0; i < kMinute; ++i) one.add(at_exposure(i), WatchedShot{});
  EXPECT_FALSE(one.drift());
  EXPECT_TRUE(CalibrationWatchConfig{}.validate().empty());
  CalibrationWatchConfig wrong;
  wrong.window_s = 10;
  EXPECT_NE(wrong.validate().text().find("window_s is 10"), std::string::npos);
}

}  // namespace
}  // namespace hueline::calibration
