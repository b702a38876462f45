// Alignment of image and laser without targets, on a real pair with a pose that somebody else has published.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <fstream>

#include "calibration/mount/alignment.hpp"
#include "core/angle.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::calibration {
namespace {

TEST(RealAlignment, FindsThePublishedPoseFromTwoDegreesOff) {
  HUELINE_REQUIRE_DATA("lidar_camera/0.pcd");
  const auto image = read_grey_image((data_file.parent_path() / "0.png").string());
  ASSERT_TRUE(image.ok()) << image.error().message;
  std::ifstream in(data_file);
  std::vector<Eigen::Vector3f> points;
  std::vector<float> intensity;
  bool has_begun = false;
  for (std::string line; std::getline(in, line);) {
    float x, y, z, i;
    if (has_begun && std::sscanf(line.c_str(), "%f %f %f %f", &x, &y, &z, &i) == 4) {
      points.emplace_back(x, y, z);
      intensity.push_back(i);
    }
    has_begun = has_begun || line.rfind("DATA", 0) == 0;
  }
  ASSERT_GT(points.size(), 70000u);

  // center_camera-intrinsic.json and top_center_lidar-to-center_camera-extrinsic.json.
  AlignmentLens lens;
  lens.values.model = LensModel::Brown;
  lens.values.width = static_cast<std::uint32_t>(image->width);
  lens.values.height = static_cast<std::uint32_t>(image->height);
  lens.values.focal_px = {2109.75, 2071.72};
  lens.values.principal_point_px = {949.828, 576.237};
  lens.values.distortion = {-0.10814499855041504, 0.1386680006980896, -0.0037975700106471777, -0.004841269925236702, 0};
  lens.max_angle = 0.7;
  Eigen::Matrix3d R;
  R << 0.0125908, -0.999895, -0.00713773, 0.0119283, 0.00728786, -0.999902, 0.99985, 0.0125045, 0.0120187;
  const Transform<CameraHead, Body> published{Eigen::Quaterniond(R).normalized(), {-0.0322306, -0.352079, -0.574468}};
  const Transform<Body, CameraHead> truth = published.inverse();

  AlignmentShot shot;
  shot.image = *image;
  shot.samples = std::make_shared<const std::vector<LaserSample>>(laser_samples(points, intensity));
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 1.5).normalized();
  const Transform<Body, CameraHead> start{truth.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(2 * kRadPerDeg, axis)),
                                          truth.translation};
  AlignmentConfig config;
  config.groups = 0;
  config.use_relation = false;  // one image has too few patches for this step
  const auto found = align_head({lens}, {shot}, start, config);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const double error_deg = found->T_body_head.rotation.angularDistance(truth.rotation) / kRadPerDeg;
  std::printf("  %.3f deg from the published pose; score %.4f at the start, %.4f found\n", error_deg,
              found->score_start, found->score);
  EXPECT_LT(error_deg, 0.3);
  EXPECT_GT(found->score, 1.1 * found->score_start);
}

}  // namespace
}  // namespace hueline::calibration
