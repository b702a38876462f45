#include "fusion/camera_model.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/calib3d.hpp>

namespace hueline::fusion {
namespace {
using std::numbers::pi;

CameraIntrinsics brown() {
  CameraIntrinsics k;
  k.model = LensModel::Brown;
  k.width = 2448;
  k.height = 2048;
  k.focal_px = {1109.75, 1071.72};
  k.principal_point_px = {1219.8, 1036.2};
  k.distortion = {-0.108, 0.0387, -0.0038, -0.0048, 0.002};
  return k;
}
CameraIntrinsics fisheye() {
  CameraIntrinsics k;
  k.model = LensModel::KannalaBrandt;
  k.width = 2448;
  k.height = 2048;
  k.focal_px = {730.5, 731.25};
  k.principal_point_px = {1219.8, 1036.2};
  k.distortion = {-0.035, 0.008, -0.003, 0.0004, 0};
  return k;
}

cv::Matx33d camera_matrix(const CameraIntrinsics& k) {
  return {k.focal_px.x(), 0, k.principal_point_px.x(), 0, k.focal_px.y(), k.principal_point_px.y(), 0, 0, 1};
}

/// Returns directions over the cone up to `angle`, at several distances.
std::vector<Eigen::Vector3d> cone(double angle) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j < 31; ++j) {
      const double a = angle * i / 40.0, turn = 2 * pi * j / 31.0, distance = 1.0 + j;
      points.emplace_back(distance * std::sin(a) * std::cos(turn), distance * std::sin(a) * std::sin(turn),
                          distance * std::cos(a));
    }
  }
  return points;
}

TEST(CameraModel, BrownEqualsOpenCv) {
  const CameraIntrinsics k = brown();
  const CameraModel model(k);
  const auto points = cone(std::min(1.0, model.max_angle()));
  std::vector<cv::Point3d> objects;
  for (const auto& p : points) objects.emplace_back(p.x(), p.y(), p.z());
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(objects, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), camera_matrix(k),
                    std::vector<double>(k.distortion.begin(), k.distortion.end()), pixels);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = model.project({points[i]});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), pixels[i].x, 1e-8);
    EXPECT_NEAR(pixel->y(), pixels[i].y, 1e-8);
  }
}

TEST(CameraModel, KannalaBrandtEqualsOpenCvFisheye) {
  const CameraIntrinsics k = fisheye();
  const CameraModel model(k);
  const auto points = cone(1.5);  // OpenCV divides by z: below 90 degrees only
  std::vector<cv::Point3d> objects;
  for (const auto& p : points) objects.emplace_back(p.x(), p.y(), p.z());
  std::vector<cv::Point2d> pixels;
  const cv::Vec3d zero(0, 0, 0);
  cv::fisheye::projectPoints(objects, pixels, zero, zero, camera_matrix(k), cv::Vec4d(k.distortion.data()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = model.project({points[i]});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), pixels[i].x, 1e-7);
    EXPECT_NEAR(pixel->y(), pixels[i].y, 1e-7);
  }
}

TEST(CameraModel, UnprojectIsTheInverseOverTheWholeField) {
  CameraIntrinsics wide = fisheye();
  wide.max_angle = 2.3;  // beyond 90 degrees: behind the lens's plane
  CameraIntrinsics strong = brown();
  strong.distortion = {-0.30, 0.09, 0.001, -0.002, -0.01};
  for (const CameraIntrinsics& k : {brown(), fisheye(), wide, strong}) {
    const CameraModel model(k);
    for (const auto& p : cone(model.max_angle() * 0.9999)) {
      const auto pixel = model.project({p});
      ASSERT_TRUE(pixel);
      const auto back = model.unproject(*pixel);
      ASSERT_TRUE(back) << p.transpose() << " of field " << model.max_angle();
      // Near the end of an invertible range, the pixel hardly depends on the angle. But the pixel must be reproduced in
      // any case.
      const auto again = model.project({back->xyz});
      ASSERT_TRUE(again);
      EXPECT_LT((*again - *pixel).norm(), 1e-10 * (1000 + pixel->norm()));
      if (std::acos(p.z() / p.norm()) < 0.9 * model.max_angle()) {
        EXPECT_LT((back->xyz - p.normalized()).norm(), 1e-10);
      }
    }
  }
}

TEST(CameraModel, NothingFromBehindOrFromBeyondTheMonotoneRange) {
  const CameraModel plane(brown());
  EXPECT_FALSE(plane.project({{0.1, 0.2, -5}}));  // a pinhole formula would put it inside the image
  EXPECT_FALSE(plane.project({{1, 0, 0}}));
  EXPECT_FALSE(plane.project({{0, 0, 0}}));

  // A barrel distortion without higher terms folds back: r (1 - 0.3 r^2) grows up to r = 1 / sqrt(0.9) only.
  CameraIntrinsics folding = brown();
  folding.distortion = {-0.3, 0, 0, 0, 0};
  const CameraModel model(folding);
  EXPECT_NEAR(std::tan(model.max_angle()), 1 / std::sqrt(0.9), 2e-3);
  EXPECT_TRUE(model.project({{1.0, 0, 1}}));
  EXPECT_FALSE(model.project({{1.5, 0, 1}}));  // its folded pixel, at r = 0.49, lies well inside the image

  CameraIntrinsics fish = fisheye();
  fish.distortion = {-0.2, 0, 0, 0, 0};  // a (1 - 0.2 a^2) grows up to a = 1 / sqrt(0.6)
  const CameraModel equidistant(fish);
  EXPECT_NEAR(equidistant.max_angle(), 1 / std::sqrt(0.6), 2e-3);
  EXPECT_FALSE(equidistant.project({{std::sin(1.5), 0, std::cos(1.5)}}));
  EXPECT_FALSE(equidistant.unproject({1219.8 + 730.5 * 1.2, 1036.2}));
}

TEST(CameraModel, RefusesNonsense) {
  CameraIntrinsics k = brown();
  EXPECT_EQ(k.validate(), "");
  k.focal_px.x() = -3;
  EXPECT_NE(k.validate().text().find("focal_px"), std::string::npos);
  k = brown();
  k.distortion[1] = std::nan("");
  EXPECT_NE(k.validate().text().find("distortion"), std::string::npos);
  k = brown();
  k.width = 0;
  EXPECT_NE(k.validate().text().find("width"), std::string::npos);
}

}  // namespace
}  // namespace hueline::fusion
