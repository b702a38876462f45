// Space resection compared with simulated points, with OpenCV's, and with a board of another simulator.
#include "calibration/mount/resection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

#include "calibration/mount/correspondence_file.hpp"
#include "calibration/mount/mount_report.hpp"
#include "config/key_reader.hpp"
#include "core/mounting.hpp"
#include "runtime/lens_values.hpp"
#include "tests/calibration/mount/measured_objects.hpp"
#include "tests/calibration/mount/simulated_points.hpp"

namespace hueline::calibration {
namespace {

using runtime::lens_values;
using test::simulate_points;

TEST(Resection, GrunertsEquationsHoldTheTruth) {
  const auto lens = test::plane_lens();
  for (std::uint32_t seed = 1; seed < 40; ++seed) {
    const auto shot = simulate_points(lens, {.count = 3, .noise_px = 0, .noise_m = 0, .seed = seed});
    std::array<Eigen::Vector3d, 3> rays, places;
    for (std::size_t i = 0; i < 3; ++i) {
      rays[i] = *lens_values(lens).direction(shot.points[i].pixel);
      places[i] = shot.points[i].p_scanner;
    }
    double nearest = 1e9;
    for (const auto& T : resect_three(rays, places))
      nearest = std::min(nearest, (T.inverse().translation - shot.T_scanner_lens.translation).norm());
    EXPECT_LT(nearest, 1e-5) << seed;
  }
}

TEST(Resection, FindsThePoseWithoutAGuess) {
  for (const auto& lens : {test::plane_lens(), test::fisheye_lens()}) {
    for (std::uint32_t seed = 1; seed < 6; ++seed) {
      const auto shot = simulate_points(lens, {.count = 8, .noise_px = 0, .noise_m = 0, .seed = seed});
      const auto found = resect(lens_values(lens), shot.points, {});
      ASSERT_TRUE(found.ok()) << found.error().message;
      EXPECT_LT(found->T_scanner_lens.rotation.angularDistance(shot.T_scanner_lens.rotation), 1e-7);
      EXPECT_LT((found->T_scanner_lens.translation - shot.T_scanner_lens.translation).norm(), 1e-6);
    }
  }
}

/// The full proof is resection_trials in calibration_bench.
TEST(Resection, IsAsGoodAsItSays) {
  const auto lens = test::large_plane_lens();
  int outside = 0;
  double turn2 = 0, centre2 = 0, turn_sigma2 = 0, centre_sigma2 = 0;
  constexpr int kRuns = 30;
  for (std::uint32_t seed = 1; seed <= kRuns; ++seed) {
    const auto shot = simulate_points(lens, {.count = 20, .noise_px = 1, .noise_m = 0.005, .seed = seed});
    const auto found = resect(lens_values(lens), shot.points, {.sigma_px = 1, .sigma_point_m = 0.005});
    ASSERT_TRUE(found.ok()) << found.error().message;
    const auto error = test::pose_error(found->T_scanner_lens, shot.T_scanner_lens);
    for (int i = 0; i < 6; ++i) outside += std::abs(error[i]) > 3 * std::sqrt(found->covariance(i, i));
    turn2 += error.head<3>().squaredNorm() / (3 * kRuns);
    centre2 += error.tail<3>().squaredNorm() / (3 * kRuns);
    turn_sigma2 += found->covariance.diagonal().head<3>().sum() / (3 * kRuns);
    centre_sigma2 += found->covariance.diagonal().tail<3>().sum() / (3 * kRuns);
  }
  std::printf("  turn %.4f deg rms an axis (stated %.4f), centre %.2f mm (stated %.2f)\n", std::sqrt(turn2) * 57.2958,
              std::sqrt(turn_sigma2) * 57.2958, std::sqrt(centre2) * 1e3, std::sqrt(centre_sigma2) * 1e3);
  EXPECT_LE(outside, 4) << "of " << 6 * kRuns;
  EXPECT_NEAR(turn2 / turn_sigma2, 1, 0.5);
  EXPECT_NEAR(centre2 / centre_sigma2, 1, 0.5);
  EXPECT_LT(std::sqrt(turn2) * 57.2958, 0.02);
  EXPECT_LT(std::sqrt(centre2), 0.005);
}

/// Tests all three axes together, and the centre in space.
TEST(Resection, PointsTakenAsAdvisedFixTheMount) {
  const auto lens = test::large_plane_lens();
  double turn2 = 0, centre2 = 0;
  Eigen::Vector3d axes2 = Eigen::Vector3d::Zero();
  constexpr int kRuns = 100;
  for (std::uint32_t seed = 1; seed <= kRuns; ++seed) {
    const auto shot = simulate_points(lens, test::good_points(seed));
    const auto found = resect(lens_values(lens), shot.points, {.sigma_px = 1, .sigma_point_m = 0.005});
    ASSERT_TRUE(found.ok()) << found.error().message;
    const auto error = test::pose_error(found->T_scanner_lens, shot.T_scanner_lens);
    turn2 += error.head<3>().squaredNorm() / kRuns;
    centre2 += error.tail<3>().squaredNorm() / kRuns;
    axes2 += error.head<3>().cwiseAbs2() / kRuns;
  }
  std::printf("  turn %.4f deg rms, the worst axis %.4f; centre %.2f mm rms in space\n", std::sqrt(turn2) * 57.2958,
              std::sqrt(axes2.maxCoeff()) * 57.2958, std::sqrt(centre2) * 1e3);
  EXPECT_LT(std::sqrt(turn2) * 57.2958, 0.02);
  EXPECT_LT(std::sqrt(centre2), 0.005);
}

TEST(Resection, EqualsOpencvOnTheSamePoints) {
  const auto lens = test::plane_lens();
  for (std::uint32_t seed = 1; seed < 5; ++seed) {
    const auto shot = simulate_points(lens, {.count = 20, .noise_px = 1, .noise_m = 0.005, .seed = seed});
    const auto found = resect(lens_values(lens), shot.points, {.outlier_sigma = 20});
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_EQ(found->used, 20);
    std::vector<cv::Point3d> places;
    std::vector<cv::Point2d> pixels;
    for (const auto& p : shot.points) {
      places.emplace_back(p.p_scanner.x(), p.p_scanner.y(), p.p_scanner.z());
      pixels.emplace_back(p.pixel.x(), p.pixel.y());
    }
    const cv::Mat camera = (cv::Mat_<double>(3, 3) << lens.focal_px.x(), 0, lens.principal_point_px.x(), 0,
                            lens.focal_px.y(), lens.principal_point_px.y(), 0, 0, 1);
    const cv::Mat distortion(1, 5, CV_64F, const_cast<double*>(lens.distortion.data()));
    cv::Mat turn, shift;
    ASSERT_TRUE(cv::solvePnP(places, pixels, camera, distortion, turn, shift, false, cv::SOLVEPNP_SQPNP));
    cv::solvePnPRefineLM(places, pixels, camera, distortion, turn, shift,
                         {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 500, 1e-16});
    const Eigen::Vector3d w(turn.at<double>(0), turn.at<double>(1), turn.at<double>(2));
    const Transform<Lens, Scanner> T{Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())),
                                     {shift.at<double>(0), shift.at<double>(1), shift.at<double>(2)}};
    EXPECT_LT(T.inverse().rotation.angularDistance(found->T_scanner_lens.rotation), 1e-7);
    EXPECT_LT((T.inverse().translation - found->T_scanner_lens.translation).norm(), 1e-6);
  }
}

TEST(Resection, LeavesOutAndNamesWrongPoints) {
  const auto lens = test::plane_lens();
  auto shot = simulate_points(lens, {.count = 20, .noise_px = 0.5, .noise_m = 0.002, .seed = 3});
  shot.points[4].pixel.x() += 60;
  shot.points[11].p_scanner.z() += 0.5;
  const auto found = resect(lens_values(lens), shot.points, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->is_used[4]);
  EXPECT_FALSE(found->is_used[11]);
  EXPECT_GE(found->used, 17);
}

std::string refusal(const LensValues& lens, const std::vector<Correspondence>& points) {
  const auto found = resect(lens, points, {});
  return found.ok() ? "" : found.error().message;
}

TEST(Resection, RefusesWhatFixesNoPose) {
  const auto lens = test::plane_lens();
  const auto good = simulate_points(lens, {.count = 12, .noise_px = 0.5, .noise_m = 0.002, .seed = 3});
  auto points = good.points;
  points.resize(3);
  EXPECT_THAT(refusal(lens_values(lens), points), testing::HasSubstr("needs 4"));
  points = good.points;
  for (auto& p : points) std::swap(p.p_scanner.x(), p.p_scanner.y());
  EXPECT_THAT(refusal(lens_values(lens), points), testing::HasSubstr("two axes are exchanged"));
  // All points are on one line.
  points = good.points;
  const Eigen::Vector3d a = points[0].p_scanner, b = points[1].p_scanner;
  const fusion::CameraModel camera(lens);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_scanner = a + (b - a) * (0.1 * static_cast<double>(i));
    points[i].pixel = *camera.project(good.T_scanner_lens.inverse() * Point<Scanner>{points[i].p_scanner});
  }
  EXPECT_THAT(refusal(lens_values(lens), points), testing::HasSubstr("near a line"));
  // The pixels of one image with the points of another place.
  points = good.points;
  const auto other = simulate_points(lens, {.count = 12, .seed = 99});
  for (std::size_t i = 0; i < points.size(); ++i) points[i].p_scanner = other.points[i].p_scanner;
  EXPECT_THAT(refusal(lens_values(lens), points), testing::HasSubstr("agree"));
}

TEST(CorrespondenceFile, ReadsAndRefuses) {
  const std::string good =
      "# targets\nname,u_px,v_px,x_m,y_m,z_m,lens\nA,10,20,1,2,3,front\nB,11.5,20,1,2.5,3,back\nC,1,2,3,4,5,front\n";
  const auto read = parse_correspondences(good, "points.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[0].points.size(), 2u);
  EXPECT_EQ((*read)[1].points[0].pixel.x(), 11.5);
  const auto refusal_of = [](const std::string& text) {
    const auto found = parse_correspondences(text, "points.csv");
    return found.ok() ? std::string() : found.error().message;
  };
  EXPECT_THAT(refusal_of("u_px,v_px,x_m,y_m\n1,2,3,4\n"), testing::HasSubstr("column 'z_m' is missing"));
  EXPECT_THAT(refusal_of("u_px,v_px,x_mm,y_mm,z_mm\n1,2,3,4,5\n"), testing::HasSubstr("metres"));
  EXPECT_THAT(refusal_of("u_px,v_px,x_m,y_m,z_m\n1,2,3400,4100,5\n"), testing::HasSubstr("millimetres"));
  EXPECT_THAT(refusal_of("u_px,v_px,x_m,y_m,z_m\n1,2,three,4,5\n"), testing::HasSubstr("points.csv:2: x_m is 'three'"));
  EXPECT_THAT(refusal_of("u_px,v_px,x_m,y_m,z_m\n1,2,3,4\n"),
              testing::HasSubstr("points.csv:2: 4 values, the first line names 5 columns"));
  EXPECT_THAT(refusal_of(""), testing::HasSubstr("no line that names the columns"));
  EXPECT_THAT(refusal_of("u_px,v_px,x_m,y_m,z_m\n"), testing::HasSubstr("holds no rows"));
  EXPECT_THAT(refusal_of("u_px,v_px,x_m,y_m,z_m\n1,2,0,0,0\n"), testing::HasSubstr("never filled in"));
}

/// The paper has 13 points and 0.1 m. measured_objects in calibration_bench has a thousand.
TEST(MeasuredObjects, ThirteenCheckPointsThroughTheCalibratedChain) {
  const auto measured = test::measure_objects(13, 8, {}, 5);
  ASSERT_EQ(measured.points, 13);
  std::printf("  13 objects: %.4f m rms in plane, %.4f m in height\n", measured.plane_rms_m, measured.height_rms_m);
  EXPECT_LE(measured.plane_rms_m, 0.05);
  EXPECT_GT(measured.plane_rms_m, 0.005) << "nothing so noisy is measured so well: the noise is missing";
}

TEST(MountReport, TheFragmentIsReadByTheRig) {
  const auto lens = test::plane_lens();
  const auto shot = simulate_points(lens, {.count = 12, .noise_px = 0.5, .noise_m = 0.002, .seed = 3});
  const auto found = resect(lens_values(lens), shot.points, {});
  ASSERT_TRUE(found.ok());
  const auto record =
      mount_record(found->covariance, Eigen::Matrix3d::Identity(), "2026-11-21", {"12 points"}, found->rms_px);
  config::Section root = config::Section::load_text(
      mounting_yaml("T_head_lens", found->T_scanner_lens.rotation, found->T_scanner_lens.translation, record, 0),
      "mount.yaml");
  const auto again = config::read_config<Mounting>(root.section("T_head_lens"));
  EXPECT_LT(again.rotation().angularDistance(found->T_scanner_lens.rotation), 1e-8);
  EXPECT_LT((again.position_m - found->T_scanner_lens.translation).norm(), 1e-6);
}

}  // namespace
}  // namespace hueline::calibration
