// The watch over mounting and times as the pipeline feeds it: a street of two painted walls, whose images the test
// computes ray by ray.
#include "runtime/drive_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/geodesy.hpp"

namespace hueline::runtime {
namespace {

using calibration::CalibrationWatchConfig;

constexpr double kWall_m = 6;
constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 107;
const CalibrationWatchConfig kWatched{.images_per_s = 2};
constexpr SensorId kLaser = 3, kLeft = 4, kRight = 5;

GpsTime at(double s) { return gps_time_ns(1'400'000'000'000'000'000) + from_seconds(s); }

fusion::RigGeometry rig(nanoseconds row_time = nanoseconds(0)) {
  fusion::RigGeometry out;
  fusion::LaserMount& laser = out.lasers.emplace_back();
  laser.sensor = kLaser;
  laser.T_body_scanner = {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, -0.5, 0.5)};
  out.head.T_body_head = {Eigen::Quaterniond(Eigen::AngleAxisd(1.57, Eigen::Vector3d::UnitZ())), {0.1, 0.3, 0.2}};
  for (const double side : {1.0, -1.0}) {
    fusion::LensMount& lens = out.head.lenses.emplace_back();
    lens.camera = side > 0 ? kLeft : kRight;
    lens.row_time = row_time;
    lens.intrinsics.width = kWidth;
    lens.intrinsics.height = kHeight;
    lens.intrinsics.focal_px = {kFocal, kFocal};
    lens.intrinsics.principal_point_px = {(kWidth - 1) / 2.0, (kHeight - 1) / 2.0};
    lens.intrinsics.max_angle = 1.0;
    Eigen::Matrix3d R;  // head: x forward, y left, z up; lens: x right, y down, z to the side
    R.col(0) = Eigen::Vector3d(side, 0, 0);
    R.col(1) = Eigen::Vector3d(0, 0, -1);
    R.col(2) = Eigen::Vector3d(0, side, 0);
    lens.T_head_lens.rotation = Eigen::Quaterniond(R);
  }
  return out;
}

/// Paint of the walls, 0 to 1.
double paint(double y, double z, double wall) {
  return 0.5 + 0.2 * std::sin(2.6 * y + 4.2 * z + wall) + 0.15 * std::sin(-5.8 * y + 3.4 * z + 3 * wall) +
         0.15 * std::sin(1.7 * y - 6.2 * z + 2 * wall);
}

/// A drive along the street, to the north. What the images truly show may differ from the rig.
struct Street {
  double speed = 8;  // m/s
  double drift_at_s = 1e9, turn_z_deg = 0, late_s = 0;
  double row_time_s = 0;  // from one row to the next; the exposure's time is that of the middle row
  bool has_right_camera = true;

  Eigen::Vector3d place(double s) const { return {0, speed * s, 0}; }

  fusion::Trajectory trajectory(double until_s) const {
    fusion::Trajectory out({});
    const Geodetic origin{0.84, 0.2, 500};
    const auto T_ecef_enu = ecef_from_enu(origin);
    for (int i = -20; i <= static_cast<int>(until_s * 20) + 20; ++i) {
      InsSolution solution;
      solution.time = at(i * 0.05);
      solution.position = to_geodetic(T_ecef_enu * Point<Enu>{place(i * 0.05)});
      solution.velocity_enu = {0, speed, 0};
      solution.is_good = true;
      out.add(solution);
    }
    return out;
  }

  Exposure exposure(double s, std::size_t lens) const {
    const fusion::RigGeometry geometry = rig();
    const fusion::LensMount& mount = geometry.head.lenses[lens];
    const bool is_drifted = s >= drift_at_s;
    Transform<Body, CameraHead> T_body_head = geometry.head.T_body_head;
    if (is_drifted)
      T_body_head.rotation =
          T_body_head.rotation * Eigen::AngleAxisd(turn_z_deg * kRadPerDeg, Eigen::Vector3d::UnitZ());
    const Transform<Body, Lens> T = T_body_head * mount.T_head_lens;
    // Each pixel in plain numbers: a test's Eigen is slow under the sanitizers.
    const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
    const double right[] = {R(0, 0), R(1, 0), R(2, 0)}, down[] = {R(0, 1), R(1, 1), R(2, 1)};
    std::vector<std::byte> pixels(static_cast<std::size_t>(kWidth) * kHeight);
    std::byte* pixel = pixels.data();
    for (int v = 0; v < kHeight; ++v) {
      const double row_s = row_time_s * (v - (kHeight - 1) / 2.0), below = (v - (kHeight - 1) / 2.0) / kFocal;
      const Eigen::Vector3d centre = T.translation + place(s + row_s + (is_drifted ? late_s : 0));
      const double from[] = {centre.x(), centre.y(), centre.z()};
      double left[3];  // the direction of the column u = 0 of this row, and so on
      for (int k = 0; k < 3; ++k) left[k] = R(k, 2) + below * down[k] - (kWidth - 1) / 2.0 / kFocal * right[k];
      for (int u = 0; u < kWidth; ++u) {
        const double beside = u / kFocal, x = left[0] + beside * right[0], y = left[1] + beside * right[1],
                     z = left[2] + beside * right[2];
        const double wall = x > 0 ? kWall_m : -kWall_m, distance = (wall - from[0]) / x;
        *pixel++ = static_cast<std::byte>(
            std::clamp(220 * paint(from[1] + distance * y, from[2] + distance * z, wall), 0.0, 255.0));
      }
    }
    Exposure out;
    out.camera = mount.camera;
    out.exposure_mid = at(s);
    out.timing = ExposureTiming::EventMark;
    out.image.width = out.image.stride = kWidth;
    out.image.height = kHeight;
    out.image.format = PixelFormat::Mono8;
    out.image.is_complete = true;
    out.image.buffer = Buffer::copy_of(pixels);
    return out;
  }

  /// 10 ms of returns from both walls.
  StampedLaserBatch batch(double s) const {
    std::mt19937_64 source(static_cast<std::uint64_t>(std::lround(s * 1000)));
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(source() >> 11) * 0x1p-53;
    };
    const Eigen::Vector3d from = place(s) + rig().lasers[0].T_body_scanner.translation;
    StampedLaserBatch out;
    out.sensor = kLaser;
    out.time = at(s);
    for (int i = 0; i < 400; ++i) {
      LaserReturn r;
      r.time_offset_ns = i * 25'000;
      const double wall = i % 2 ? kWall_m : -kWall_m, y = uniform(-6, 6), z = uniform(-4.5, 4.5);
      const Eigen::Vector3d here = from + Eigen::Vector3d(0, speed * r.time_offset_ns * 1e-9, 0);
      const Eigen::Vector3d p(wall, place(s).y() + y, z), beam = p - here;
      r.x = static_cast<float>(beam.x());
      r.y = static_cast<float>(beam.y());
      r.z = static_cast<float>(beam.z());
      r.range_m = static_cast<float>(beam.norm());
      r.reflectivity =
          static_cast<std::uint8_t>(std::clamp(180 * paint(p.y(), p.z(), wall) + uniform(-25, 25), 0.0, 255.0));
      out.returns.push_back(r);
    }
    return out;
  }
};

/// Drives a street past the watch, and returns what it told, with the second in which it did.
std::vector<std::pair<double, Fault>> drive(const Street& street, double until_s, DriveWatch& watch) {
  const fusion::Trajectory trajectory = street.trajectory(until_s + 1);
  std::vector<std::pair<double, Fault>> out;
  for (int i = 0; i <= static_cast<int>(until_s); ++i) {
    for (int k = -16; k < 16; ++k) watch.add(street.batch(i + 0.01 * k));
    watch.add(street.exposure(i, 0));
    if (street.has_right_camera) watch.add(street.exposure(i, 1));
    watch.advance(at(i + 0.2), trajectory, [&](GpsTime time) { return time <= at(i + 0.3); });
    for (Fault& fault : watch.take_faults()) out.emplace_back(i, std::move(fault));
  }
  return out;
}

TEST(DriveWatch, TellsOnceThatTheHeadHasTurned) {
  DriveWatch watch(rig(), kWatched);
  const auto told = drive({.drift_at_s = 65, .turn_z_deg = 0.1}, 105, watch);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_GT(told[0].first, 65);
  EXPECT_LT(told[0].first, 100);
  const Fault& fault = told[0].second;
  EXPECT_EQ(fault.kind, FaultKind::Implausible);
  EXPECT_EQ(fault.sensor, kLeft);
  EXPECT_THAT(fault.detail, testing::HasSubstr("the head has turned since the beginning of the drive by 0."));
  EXPECT_EQ(watch.report().drifts, 1u);
  ASSERT_TRUE(watch.report().last);
  EXPECT_NEAR(watch.report().last->change[2] * kDegPerRad, 0.1, 0.03);
}

TEST(DriveWatch, TellsThatTheImagesHaveBecomeLate) {
  DriveWatch watch(rig(), kWatched);
  const auto told = drive({.drift_at_s = 65, .late_s = 0.004}, 105, watch);
  ASSERT_FALSE(told.empty());
  EXPECT_THAT(told[0].second.detail, testing::HasSubstr(" later than their times"));
  EXPECT_NEAR(watch.report().last->change[3] * 1e3, 4, 1);
}

TEST(DriveWatch, LooksAtTheImagesThatItsRateAllowsAndSaysNothingWhenNothingDrifts) {
  DriveWatch watch(rig(), {.images_per_s = 0.5});
  EXPECT_TRUE(drive({}, 60, watch).empty());
  EXPECT_NEAR(static_cast<double>(watch.report().images), 30, 1);
  EXPECT_GT(watch.report().windows, 0u);
}

/// At 8 m/s the vehicle moves 9 cm from the first row to the last, which looks like a turned head to who does not know.
TEST(DriveWatch, KnowsWhenTheRowsOfARollingShutterAreExposed) {
  const Street street{.row_time_s = 90e-6};
  DriveWatch knows(rig(nanoseconds(90'000)), kWatched), does_not(rig(), kWatched);
  EXPECT_TRUE(drive(street, 60, knows).empty());
  drive(street, 60, does_not);
  const auto turn_deg = [](const DriveWatch& watch) {
    return watch.report().last ? watch.report().last->error.head<3>().norm() * kDegPerRad : std::nan("");
  };
  EXPECT_LT(turn_deg(knows), 0.05);
  EXPECT_GT(turn_deg(does_not), 0.1);
}

TEST(DriveWatch, DoesNotWaitForACameraThatIsGone) {
  DriveWatch watch(rig(), kWatched);
  EXPECT_TRUE(drive({.has_right_camera = false}, 30, watch).empty());
  EXPECT_GT(watch.report().images, 12u);
}

TEST(DriveWatch, AStandingVehicleShowsNothingNew) {
  DriveWatch watch(rig(), kWatched);
  EXPECT_TRUE(drive({.speed = 0.1}, 40, watch).empty());
  EXPECT_EQ(watch.report().images, 0u);
  EXPECT_GT(watch.report().standing, 30u);
  EXPECT_FALSE(watch.report().last);
}

/// Without a watermark nothing is ever decided; what waits is limited.
TEST(DriveWatch, WhatWaitsIsLimited) {
  DriveWatch watch(rig(), kWatched);
  const Street street;
  const Exposure exposure = street.exposure(0, 0), other = street.exposure(0, 1);
  for (int i = 0; i < 200; ++i) {
    Exposure one = i % 2 ? other : exposure;
    one.exposure_mid = at(i);
    watch.add(one);
  }
  EXPECT_GT(watch.report().dropped, 100u);
}

}  // namespace
}  // namespace hueline::runtime
