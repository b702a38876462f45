// Adjustment of grey levels to laser intensities, in a street of two painted walls. The test computes the images ray by
// ray.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "calibration/mount/head_adjustment.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr double kWall_m = 6, kSpeed = 8;
const Eigen::Vector3d kHead(0.1, 0.3, 0.2);

struct Street {
  std::vector<AlignmentLens> lenses;
  std::vector<AlignmentShot> shots;
  Transform<Body, CameraHead> truth{Eigen::Quaterniond(Eigen::AngleAxisd(1.57, Eigen::Vector3d::UnitZ())), kHead};
};

/// Paint of the walls, 0 to 1. It is as soft as the blur of a pixel.
double paint(double y, double z, double seed) {
  return 0.5 + 0.2 * std::sin(2.6 * y + 4.2 * z + seed) + 0.15 * std::sin(-5.8 * y + 3.4 * z + 3 * seed) +
         0.15 * std::sin(1.6 * y - 6.2 * z + 2 * seed);
}

/// `gain` is the gain of the images, different for each lens, with light loss towards the corners. `late_s` is how much
/// later than their times the images are taken.
Street street(double late_s, double gain, bool has_relation) {
  Street out;
  for (const double side : {1.0, -1.0}) {
    AlignmentLens lens;
    lens.values.width = 320;
    lens.values.height = 240;
    lens.values.focal_px = {200, 200};
    lens.values.principal_point_px = {159.5, 119.5};
    lens.max_angle = 1.0;
    Eigen::Matrix3d R;  // head: x forward, y left, z up; lens: x right, y down, z to the side
    R.col(0) = Eigen::Vector3d(side, 0, 0);
    R.col(1) = Eigen::Vector3d(0, 0, -1);
    R.col(2) = Eigen::Vector3d(0, side, 0);
    lens.T_head_lens.rotation = Eigen::Quaterniond(R);
    out.lenses.push_back(lens);
  }
  std::mt19937_64 random(7);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  // The lenses are equal and have no distortion.
  std::vector<Eigen::Vector3d> directions;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) directions.emplace_back((u - 159.5) / 200, (v - 119.5) / 200, 1);
  for (int moment = 0; moment < 5; ++moment) {
    const double seed = 1.7 * moment;
    auto samples = std::make_shared<std::vector<LaserSample>>();
    for (int i = 0; i < 30000; ++i) {
      const Eigen::Vector3d p(uniform(0, 1) < 0.5 ? -kWall_m : kWall_m, uniform(-6, 6), uniform(-4.5, 4.5));
      const double intensity =
          has_relation ? 0.8 * paint(p.y(), p.z(), seed + p.x()) + uniform(-0.03, 0.03) : uniform(0, 1);
      samples->push_back({p.cast<float>(), static_cast<float>(intensity), 0, 0});
    }
    for (std::size_t l = 0; l < 2; ++l) {
      AlignmentShot shot;
      shot.lens = l;
      shot.samples = samples;
      shot.velocity_body = {0, kSpeed, 0};
      shot.image.width = 320;
      shot.image.height = 240;
      const Transform<Body, Lens> T = out.truth * out.lenses[l].T_head_lens;
      for (int v = 0; v < 240; ++v)
        for (int u = 0; u < 320; ++u) {
          const Eigen::Vector3d from = T.translation + Eigen::Vector3d(0, kSpeed * late_s, 0),
                                along = T.rotation * directions[static_cast<std::size_t>(v * 320 + u)];
          const double wall = along.x() > 0 ? kWall_m : -kWall_m;
          const Eigen::Vector3d p = from + along * ((wall - from.x()) / along.x());
          const double lost = 1 - 0.3 * (std::pow(u - 160, 2) + std::pow(v - 120, 2)) / (200.0 * 200.0);
          shot.image.pixels.push_back(
              static_cast<std::uint8_t>(250 * gain * (l ? 0.7 : 1.0) * lost * paint(p.y(), p.z(), seed + wall) + 0.5));
        }
      out.shots.push_back(std::move(shot));
    }
  }
  return out;
}

Transform<Body, CameraHead> half_a_degree_off(Transform<Body, CameraHead> head) {
  head.rotation =
      head.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * kRadPerDeg, Eigen::Vector3d(1, -2, 1.5).normalized()));
  return head;
}

TEST(HeadAdjustment, FindsTurnAndTimeWhateverTheGain) {
  for (const double gain : {1.0, 0.25}) {
    const Street made = street(0.012, gain, true);
    const auto found = adjust_head(made.lenses, made.shots, half_a_degree_off(made.truth), 0, true, {});
    ASSERT_TRUE(found.ok()) << found.error().message;
    const double error = found->T_body_head.rotation.angularDistance(made.truth.rotation) / kRadPerDeg;
    const Eigen::Vector4d sigma = found->covariance.diagonal().cwiseSqrt();
    std::printf("  gain %.2f: %.4f deg, %.3f ms off; sigma %.4f %.4f %.4f deg, %.3f ms; %zu patches, %d steps\n", gain,
                error, (found->time_offset_s - 0.012) * 1e3, sigma[0] / kRadPerDeg, sigma[1] / kRadPerDeg,
                sigma[2] / kRadPerDeg, sigma[3] * 1e3, found->patches, found->steps);
    EXPECT_LT(error, 0.01);
    EXPECT_NEAR(found->time_offset_s, 0.012, 2e-4);
    EXPECT_GT(sigma.minCoeff(), 0);
    EXPECT_LT(sigma.head<3>().maxCoeff(), 0.02 * kRadPerDeg) << "a sigma so large is met by anything";
  }
}

TEST(HeadAdjustment, KeepsTheTimeWhereItIsTakenForTrue) {
  const Street made = street(0, 1, true);
  const auto found = adjust_head(made.lenses, made.shots, half_a_degree_off(made.truth), 0, false, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LT(found->T_body_head.rotation.angularDistance(made.truth.rotation), 0.01 * kRadPerDeg);
  EXPECT_EQ(found->time_offset_s, 0);
  EXPECT_EQ(found->covariance(3, 3), 0);
}

TEST(HeadAdjustment, RefusesWhereIntensityDoesNotFollowGrey) {
  const Street made = street(0, 1, false);
  const auto found = adjust_head(made.lenses, made.shots, half_a_degree_off(made.truth), 0, true, {});
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::Unavailable);
  EXPECT_NE(found.error().message.find("patches"), std::string::npos) << found.error().message;
}

}  // namespace
}  // namespace hueline::calibration
