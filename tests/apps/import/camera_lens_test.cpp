// The lens that a CameraInfo states for images of a given size, and which CameraInfo belongs to which images.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "apps/import/camera_lens.hpp"
#include "apps/import/rectified_place.hpp"
#include "tests/rosbag/camera_message.hpp"

namespace hueline {
namespace {

using apps::CameraFacts;
using apps::ImportedLens;
using fusion::LensModel;
using test::CameraInfo;

CameraFacts facts_of(const CameraInfo& info) {
  const std::string bytes = test::camera_info(drivers::RosEncoding::Cdr, 0, info).bytes();
  return apps::take_camera_info({std::as_bytes(std::span(bytes)), drivers::RosEncoding::Cdr});
}
ImportedLens lens(const CameraInfo& info, std::uint32_t width = 160, std::uint32_t height = 120,
                  bool is_rectified = false) {
  const CameraFacts facts = facts_of(info);
  EXPECT_EQ(facts.why, "");
  return apps::lens_of(&facts, is_rectified, width, height);
}
void expect_matrix(const ImportedLens& one, double fx, double fy, double cx, double cy) {
  EXPECT_EQ(one.why, "");
  EXPECT_NEAR(one.lens.focal_px.x(), fx, 1e-9);
  EXPECT_NEAR(one.lens.focal_px.y(), fy, 1e-9);
  EXPECT_NEAR(one.lens.principal_point_px.x(), cx, 1e-9);
  EXPECT_NEAR(one.lens.principal_point_px.y(), cy, 1e-9);
}

TEST(CameraLens, IsThatOfTheCameraInfo) {
  const auto one = lens({.distortion = {-0.3, 0.1, 0.001, 0.002, 0.01}});
  expect_matrix(one, 80, 81, 79.5, 60);
  EXPECT_EQ(one.lens.model, LensModel::Brown);
  EXPECT_EQ(one.lens.distortion, (std::array<double, 5>{-0.3, 0.1, 0.001, 0.002, 0.01}));
  EXPECT_EQ(one.lens.width, 160u);
  EXPECT_EQ(one.remark, "");
}

// The first pixel of the smaller image covers two by two of the larger one, whose common centre is at (0.5, 0.5).
TEST(CameraLens, IsScaledToTheImage) {
  const CameraInfo twice{.width = 320, .height = 240, .fx = 160, .fy = 162, .cx = 159.5, .cy = 120.5};
  const auto scaled = lens(twice);
  expect_matrix(scaled, 80, 81, 79.5, 60);
  EXPECT_EQ(scaled.remark, "scaled from 320 x 240 px");
  CameraInfo binned = twice;
  binned.binning = 2;
  expect_matrix(lens(binned), 80, 81, 79.5, 60);
  // A driver that joined pixels, and names the joined size with the matrix of it.
  expect_matrix(lens({.binning = 2}), 80, 81, 79.5, 60);
}

TEST(CameraLens, IsThatOfThePartThatWasSent) {
  CameraInfo part{.width = 360, .height = 240, .cx = 179.5, .cy = 120};
  part.part_x = 100, part.part_y = 60, part.part_width = 160, part.part_height = 120;
  const auto cut = lens(part);
  expect_matrix(cut, 80, 81, 79.5, 60);
  EXPECT_EQ(cut.remark, "it is the part of 160 x 120 px from (100, 60) on");
  part.part_x = 300;
  EXPECT_EQ(lens(part).why,
            "the part of 160 x 120 px from (300, 60) on that its CameraInfo names lies outside its 360 x 240");
}

TEST(CameraLens, OfAnImageOfAnotherShapeIsNotKnown) {
  EXPECT_EQ(lens({.width = 160, .height = 100}).why,
            "its CameraInfo is that of 160 x 100 px, an image of another shape: the images were cut");
}

TEST(CameraLens, OfRectifiedImagesIsPWithoutDistortion) {
  CameraInfo info{.distortion = {-0.3, 0.1, 0, 0, 0}};
  info.P = {70, 0, 78, -8.4, 0, 71, 58, 0, 0, 0, 1, 0};  // that of the right camera of a pair
  const auto one = lens(info, 160, 120, true);
  expect_matrix(one, 70, 71, 78, 58);
  EXPECT_EQ(one.lens.distortion, (std::array<double, 5>{}));
  EXPECT_EQ(one.remark, "the images are rectified, so it is that of P");
  expect_matrix(lens(info), 80, 81, 79.5, 60);
  info.P.fill(0);
  EXPECT_EQ(lens(info, 160, 120, true).why,
            "its images are rectified, and its CameraInfo has no P: the values are those of K");
  EXPECT_TRUE(apps::is_rectified("/left/image_rect_color/compressed"));
  EXPECT_TRUE(apps::is_rectified("/left/rect"));
  EXPECT_FALSE(apps::is_rectified("/direct/image_raw"));
}

TEST(CameraLens, TellsADistortionThatIsNotRead) {
  expect_matrix(lens({.model = "rational_polynomial", .distortion = {0.1, 0, 0, 0, 0, 0, 0, 0}}), 80, 81, 79.5, 60);
  const auto twelve = lens({.distortion = {0, 0, 0, 0, 0, 0, 0, 0, 0.3, 0.1, 0, 0}});
  EXPECT_EQ(twelve.why, "its CameraInfo: the lens has 12 numbers of distortion; its model has 5: k1 k2 p1 p2 k3");
  EXPECT_EQ(twelve.lens.focal_px.x(), 80) << "the matrix is known all the same";
  const auto other = lens({.model = "thin_prism", .distortion = {0.1}});
  EXPECT_NE(other.why.find("thin_prism is not read; allowed: plumb_bob"), std::string::npos) << other.why;
  const auto fisheye = lens({.model = "equidistant", .distortion = {0.1, 0.2, 0.3, 0.4}});
  EXPECT_EQ(fisheye.why, "");
  EXPECT_EQ(fisheye.lens.model, LensModel::KannalaBrandt);
}

TEST(CameraLens, OfTheRationalModelIsTheNearestOfOurs) {
  // As depth cameras state theirs.
  const std::vector<double> k{0.47, -2.46, 7e-4, -5e-4, 1.41, 0.35, -2.29, 1.34};
  const auto found = lens({.model = "rational_polynomial", .distortion = k});
  EXPECT_EQ(found.why, "");
  EXPECT_TRUE(found.remark.starts_with("the lens of its CameraInfo has the model rational; the")) << found.remark;
  const fusion::CameraModel model(found.lens);
  for (const double x : {-0.9, -0.3, 0.0, 0.5, 0.95})
    for (const double y : {-0.7, 0.0, 0.2, 0.7}) {
      const double q = x * x + y * y;
      const double radial = (1 + q * (k[0] + q * (k[1] + q * k[4]))) / (1 + q * (k[5] + q * (k[6] + q * k[7])));
      const double u = x * radial + 2 * k[2] * x * y + k[3] * (q + 2 * x * x),
                   v = y * radial + k[2] * (q + 2 * y * y) + 2 * k[3] * x * y;
      const auto pixel = model.project({{x, y, 1}});
      ASSERT_TRUE(pixel) << x << " " << y;
      EXPECT_NEAR(pixel->x(), 80 * u + 79.5, 0.1) << x << " " << y;
      EXPECT_NEAR(pixel->y(), 81 * v + 60, 0.1) << x << " " << y;
    }
}

TEST(CameraLens, KnowsTheWordsThatDriversHaveForModels) {
  for (const char* word : {"kannala_brandt", "KANNALA_BRANDT4", "opencv_fisheye", "Equidistant"}) {
    const auto fisheye = lens({.model = word, .distortion = {0.1, 0.2, 0.3, 0.4}});
    EXPECT_EQ(fisheye.why, "") << word;
    EXPECT_EQ(fisheye.lens.model, LensModel::KannalaBrandt) << word;
  }
  const auto pinhole = lens({.model = "pinhole", .distortion = {-0.1, 0, 0, 0, 0}});
  EXPECT_EQ(pinhole.why, "");
  EXPECT_EQ(pinhole.lens.model, LensModel::Brown);
}

TEST(CameraLens, OfRectifiedImagesSaysHowTheirCameraIsPlaced) {
  const auto doubt = [](const test::CameraInfo& info, bool is_rectified = true) {
    const CameraFacts facts = facts_of(info);
    return apps::lens_of(&facts, is_rectified, 160, 120).doubt;
  };
  test::CameraInfo info;
  info.P = {80, 0, 79.5, 0, 0, 80, 60, 0, 0, 0, 1, 0};
  EXPECT_EQ(doubt(info), "");
  info.P[3] = -80 * 0.54;  // a second camera, 0.54 m to the right
  EXPECT_TRUE(
      doubt(info).starts_with("its images are rectified: P of its CameraInfo places them 0.540 m to the right of "
                              "and 0.000 m below the first camera. The frame"))
      << doubt(info);
  EXPECT_EQ(doubt(info, false), "");
  const double c = std::cos(0.01), s = std::sin(0.01);
  info.P[3] = 0;
  info.R = {c, 0, s, 0, 1, 0, -s, 0, c};
  EXPECT_TRUE(doubt(info).starts_with("its images are rectified: they are turned by 0.57 deg against the camera (R of"))
      << doubt(info);
  info.R = {};
  EXPECT_EQ(doubt(info), "") << "it is not given";
}

/// Two cameras of a pair, 0.2 m apart, turned by half a degree each to be parallel.
TEST(CameraLens, ThePlaceOfRectifiedImagesShowsByThePairsFrames) {
  CameraInfo left, right;
  left.frame = "left", right.frame = "right";
  const double c = std::cos(0.009), s = std::sin(0.009);
  left.R = {c, 0, s, 0, 1, 0, -s, 0, c};
  right.R = {c, 0, -s, 0, 1, 0, s, 0, c};
  left.P = right.P = {80, 0, 79.5, 0, 0, 80, 60, 0, 0, 0, 1, 0};
  right.P[3] = -80 * 0.2;
  const auto facts = [&] { return std::map{std::pair{std::string("l"), facts_of(left)}, {"r", facts_of(right)}}; };
  Eigen::Isometry3d T_left_right = Eigen::Isometry3d::Identity();
  const apps::PlaceInFrame tree = [&](const std::string& of,
                                      const std::string& in) -> std::optional<Eigen::Isometry3d> {
    EXPECT_EQ(of, "right");
    EXPECT_EQ(in, "left");
    return T_left_right;
  };
  const auto found = [&](const CameraInfo& of) { return apps::rectified_place(facts_of(of), facts(), tree); };
  // Parallel frames: those of the rectified cameras.
  T_left_right.translation() = Eigen::Vector3d(0.2, 0, 0);
  for (const CameraInfo& one : {left, right}) {
    const auto known = found(one);
    ASSERT_TRUE(known);
    EXPECT_TRUE(known->T_frame_lens.isApprox(Eigen::Isometry3d::Identity()));
  }
  // Frames turned as the two R say: those of the cameras. A point ahead of the rectified camera is beside their axis.
  const Eigen::AngleAxisd turn(0.018, Eigen::Vector3d::UnitY());
  T_left_right.linear() = turn.toRotationMatrix().transpose();
  T_left_right.translation() = Eigen::Vector3d(0.2 * c, 0, 0.2 * s);
  const auto known = found(left);
  ASSERT_TRUE(known);
  EXPECT_LT((known->T_frame_lens * Eigen::Vector3d(0, 0, 10) - Eigen::Vector3d(-10 * s, 0, 10 * c)).norm(), 1e-9);
  // Frames of a drawing, which are neither, show nothing.
  T_left_right.linear().setIdentity();
  T_left_right.translation() = Eigen::Vector3d(0.23, 0, 0);
  EXPECT_FALSE(found(left));
  EXPECT_FALSE(found(right));
  // One frame for both is that of the first camera.
  right.frame = "left";
  EXPECT_FALSE(found(right)) << "whether it is turned does not show";
  left.R = right.R = CameraInfo().R;
  ASSERT_TRUE(found(right));
  EXPECT_LT((found(right)->T_frame_lens.translation() - Eigen::Vector3d(0.2, 0, 0)).norm(), 1e-9);
  EXPECT_FALSE(found(left)) << "there is nothing to know";
}

TEST(CameraLens, OfValuesThatNoLensHasIsNotKnown) {
  EXPECT_EQ(facts_of({.fx = 0, .fy = 0}).why, "its focal lengths are 0, as of a camera that was not calibrated");
  EXPECT_EQ(facts_of({.cx = std::numeric_limits<double>::quiet_NaN()}).why, "some of its values are no numbers");
  EXPECT_EQ(facts_of({.distortion = {std::numeric_limits<double>::infinity()}}).why,
            "some of its values are no numbers");
  const auto wild = lens({.fx = 1e7});
  EXPECT_NE(wild.why.find("focal_px"), std::string::npos) << wild.why;
  EXPECT_TRUE(wild.lens.validate().empty()) << "a rig can be written";
  EXPECT_EQ(apps::lens_of(nullptr, false, 160, 120).why, "the recording does not say its calibration");
  const std::string cut = test::camera_info(drivers::RosEncoding::Cdr, 0, {}).bytes().substr(0, 200);
  EXPECT_EQ(apps::take_camera_info({std::as_bytes(std::span(cut)), drivers::RosEncoding::Cdr}).why,
            "it does not have the form of its type");
}

TEST(CameraLens, IsTakenFromTheCameraInfoOfTheFrame) {
  const auto of_frame = [](const std::string& frame) { return facts_of({.frame = frame}); };
  std::map<std::string, CameraFacts> facts{{"/left/ir_info", of_frame("ir")}};
  const auto found = [&](const std::string& frame) {
    return apps::find_facts(facts, "/left/image_raw/compressed", frame, true);
  };
  EXPECT_EQ(found("camera").topic, "") << "of another camera";
  EXPECT_EQ(found("").topic, "/left/ir_info");
  facts["/left/camera_info"] = of_frame("other");
  EXPECT_EQ(found("camera").topic, "/left/camera_info") << "the name by ROS's convention";
  EXPECT_FALSE(found("camera").is_of_frame);
  facts["/calibration"] = of_frame("/camera");
  EXPECT_EQ(found("camera").topic, "/calibration");
  EXPECT_TRUE(found("camera").is_of_frame);
  facts["/left/small/camera_info"] = facts["/left/a_info"] = of_frame("camera");
  EXPECT_EQ(found("camera").topic, "/left/a_info") << "that which lies nearest";
}

}  // namespace
}  // namespace hueline
