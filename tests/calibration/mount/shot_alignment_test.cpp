// Alignment of one image with one laser cloud: scenes of boxes and markings whose image and cloud the test computes ray
// by ray, and a real pair with a pose that somebody else has published.
#include "calibration/mount/shot_alignment.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <random>

#include "calibration/mount/shot_pairs.hpp"
#include "core/angle.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::calibration {
namespace {

/// A box along the axes of the scanner. `albedo` is what camera and laser see of it.
struct Box {
  Eigen::Vector3d least, most;
  double albedo = 0.5;
};

/// The scanner stands 2 m above the ground, x forward, y to the left, z up.
struct Scene {
  std::vector<Box> boxes;
  double marking = 0.8;  ///< albedo of the lines on the ground; the ground itself has 0.25
};

struct Hit {
  double distance = std::numeric_limits<double>::infinity();
  double albedo = 0;
  double shade = 1;  ///< of the face, for the camera; the laser has its own light
};

constexpr double kGround_m = -2, kFarthest_m = 90;

std::optional<Hit> hit_of(const Scene& scene, const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  Hit out;
  for (const Box& box : scene.boxes) {
    double in = 0, leave = std::numeric_limits<double>::infinity();
    int face = 0;
    for (int i = 0; i < 3; ++i) {
      const double a = (box.least[i] - from[i]) / along[i], b = (box.most[i] - from[i]) / along[i];
      if (std::min(a, b) > in) {
        in = std::min(a, b);
        face = i;
      }
      leave = std::min(leave, std::max(a, b));
    }
    if (in > 0 && in < leave && in < out.distance) out = {in, box.albedo, face == 0 ? 0.7 : face == 1 ? 0.9 : 1.1};
  }
  const double to_ground = (kGround_m - from.z()) / along.z();
  if (to_ground > 0 && to_ground < out.distance) {
    const Eigen::Vector3d p = from + to_ground * along;
    const bool is_marked = (std::abs(std::remainder(p.y(), 3.5)) < 0.12 && std::remainder(p.x(), 6) > 0) ||
                           (std::abs(p.x() - 18) < 1.5 && std::remainder(p.y() + 0.3, 1.2) > 0);
    out = {to_ground, is_marked ? scene.marking : 0.25, 1};
  }
  if (!(out.distance < kFarthest_m)) return std::nullopt;
  return out;
}

class Random {
 public:
  explicit Random(unsigned seed) : source_(seed) {}
  double uniform(double from, double to) { return from + (to - from) * static_cast<double>(source_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 source_;
};

/// A street: posts and cars at random places, houses on both sides.
Scene street(unsigned seed) {
  Random random(seed);
  Scene out;
  for (int i = 0; i < 24; ++i) {
    const double x = random.uniform(8, 40), y = (i % 2 ? 1 : -1) * random.uniform(3, 12),
                 wide = random.uniform(0.1, 0.3);
    const double high = random.uniform(0, 4), albedo = random.uniform(0.05, 0.9);
    out.boxes.push_back({{x, y, kGround_m}, {x + wide, y + wide, high}, albedo});
  }
  for (int i = 0; i < 12; ++i) {
    const double x = random.uniform(9, 45), y = (i % 2 ? 1 : -1) * random.uniform(2.5, 9),
                 albedo = random.uniform(0.05, 0.9);
    out.boxes.push_back({{x, y, kGround_m}, {x + 4.3, y + 1.8, kGround_m + 1.5}, albedo});
  }
  for (int i = 0; i < 8; ++i) {
    const double x = 12 + 9.0 * (i / 2), y = i % 2 ? 13 : -23, high = random.uniform(3, 12),
                 albedo = random.uniform(0.2, 0.8);
    out.boxes.push_back({{x, y, kGround_m}, {x + 8, y + 10, high}, albedo});
  }
  return out;
}

const Eigen::Vector3d kLensInScanner(0.3, 0.1, -0.25);

/// The lens looks forward, a little to the left and down.
Transform<Lens, Scanner> true_pose() {
  Eigen::Matrix3d R;
  R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d(0.6, 1, 0.2).normalized())) * Eigen::Quaterniond(R);
  return {q, -(q * kLensInScanner)};
}

/// The image and the cloud of two scenes, which are the same for a true shot. A cloud of 64 rings, as that of a
/// Velodyne HDL-64; an image of 60 degrees with shade, light loss towards the corners and noise.
Shot shot_of(const Scene& seen, const Scene& measured, unsigned seed) {
  Random random(seed);
  Shot out;
  out.lens.width = 640;
  out.lens.height = 400;
  out.lens.focal_px = {550, 550};
  out.lens.principal_point_px = {322, 198};
  out.lens.distortion = {-0.1, 0.02, 0, 0, 0};
  out.max_angle = 0.75;
  out.image.width = 640;
  out.image.height = 400;
  const Eigen::Matrix3d R_scanner_lens = true_pose().rotation.conjugate().toRotationMatrix();
  for (int v = 0; v < 400; ++v)
    for (int u = 0; u < 640; ++u) {
      const auto along = out.lens.direction(Eigen::Vector2d(u, v));
      const auto hit = along ? hit_of(seen, kLensInScanner, R_scanner_lens * *along) : std::nullopt;
      const double light = 1 - 0.4 * (std::pow(u - 320, 2) + std::pow(v - 200, 2)) / (320.0 * 320.0);
      const double grey = light * (hit ? 200 * hit->albedo * hit->shade : 230) + random.uniform(-3, 3);
      out.image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0)));
    }
  for (int ring = 0; ring < 64; ++ring)
    for (int k = 0; k < 450; ++k) {
      const double elevation = (2 - 26.8 * ring / 63) * kRadPerDeg, azimuth = (k * 0.2 - 45) * kRadPerDeg;
      const Eigen::Vector3d along(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                  std::sin(elevation));
      const auto hit = hit_of(measured, Eigen::Vector3d::Zero(), along);
      const double noise_m = random.uniform(-0.02, 0.02), noise = random.uniform(0.9, 1.1);
      if (!hit) continue;
      out.p_scanner.push_back(((hit->distance + noise_m) * along).cast<float>());
      out.intensity.push_back(static_cast<float>(100 * hit->albedo * noise));
    }
  return out;
}

Transform<Lens, Scanner> turned(const Transform<Lens, Scanner>& T, double deg, const Eigen::Vector3d& about) {
  const Eigen::Quaterniond by(Eigen::AngleAxisd(deg * kRadPerDeg, about.normalized()));
  return {by * T.rotation, by * T.translation};
}

double error_deg(const ShotAlignment& found, const Transform<Lens, Scanner>& truth) {
  return found.T_lens_scanner.rotation.angularDistance(truth.rotation) * kDegPerRad;
}

std::string doubts_of(const ShotAlignment& found) {
  std::string out;
  for (const std::string& doubt : found.doubts) out += doubt + "; ";
  return out;
}

TEST(ShotAlignment, FindsTheRotationOfAStreetFromTwoDegreesOff) {
  const Scene scene = street(3);
  const Shot shot = shot_of(scene, scene, 1);
  for (const Eigen::Vector3d& about : {Eigen::Vector3d(1, 0.4, -0.3), Eigen::Vector3d(-0.2, -1, 0.6)}) {
    const auto found = align_shot(shot, turned(true_pose(), 2, about), {});
    ASSERT_TRUE(found.ok()) << found.error().message;
    std::printf("  %.3f deg off, sigma %.3f deg; %zu pairs, %zu outlines, %d of %d elsewhere\n",
                error_deg(*found, true_pose()), found->sigma() * kDegPerRad, found->pairs, found->outlines,
                found->elsewhere, found->subsets);
    EXPECT_TRUE(found->is_determined()) << doubts_of(*found);
    EXPECT_LT(error_deg(*found, true_pose()), 0.12);
    EXPECT_LT(error_deg(*found, true_pose()), 3 * found->sigma() * kDegPerRad);
    EXPECT_GT(found->score, 1.5 * found->score_start);
    // The centre of the lens keeps its place.
    const Eigen::Vector3d centre = found->T_lens_scanner.inverse().translation;
    EXPECT_LT((centre - kLensInScanner).norm(), 1e-9);
  }
}

TEST(ShotAlignment, DoesNotAlignACloudWithTheImageOfAnotherPlace) {
  Scene other = street(11);
  for (Box& box : other.boxes) {
    box.least.x() += 1.7;
    box.most.x() += 1.7;
  }
  const Shot shot = shot_of(street(3), other, 1);
  const auto found = align_shot(shot, turned(true_pose(), 1, {1, 1, 0}), {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->is_determined());
  EXPECT_NE(doubts_of(*found).find("deg"), std::string::npos) << doubts_of(*found);
}

/// Equal posts at equal angles fit at many rotations.
TEST(ShotAlignment, DoesNotChooseAmongTheRotationsOfAFence) {
  Scene fence;
  fence.marking = 0.25;
  for (int i = -40; i <= 40; ++i) {
    const double azimuth = 1.0 * i * kRadPerDeg, x = 20 * std::cos(azimuth), y = 20 * std::sin(azimuth);
    fence.boxes.push_back({{x, y - 0.06, -30}, {x + 0.1, y + 0.06, 30}, 0.1});
  }
  const Shot shot = shot_of(fence, fence, 1);
  const auto found = align_shot(shot, turned(true_pose(), 2, {0.2, 1, 0}), {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->is_determined());
}

TEST(ShotAlignment, LeavesOutWhatNoScannerMeasures) {
  const Scene scene = street(3);
  Shot shot = shot_of(scene, scene, 1);
  const auto expected = laser_pairs(shot.p_scanner, shot.intensity, true_pose(), shot.lens, shot.max_angle);
  for (const float strange :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30F, 0.0F}) {
    shot.p_scanner.emplace_back(strange, strange, strange);
    shot.intensity.push_back(7);
  }
  const auto found = laser_pairs(shot.p_scanner, shot.intensity, true_pose(), shot.lens, shot.max_angle);
  EXPECT_GT(expected.pairs.size(), 10000u);
  EXPECT_EQ(found.pairs.size(), expected.pairs.size());
}

TEST(ShotAlignment, SaysThatAnEmptyRoadHasNoOutlines) {
  Scene road;
  road.marking = 0.25;
  const auto found = align_shot(shot_of(road, road, 1), true_pose(), {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->is_determined());
  EXPECT_NE(doubts_of(*found).find("0 outlines in the image"), std::string::npos) << doubts_of(*found);
}

TEST(ShotAlignment, RefusesWhatItCannotUse) {
  const Scene scene = street(3);
  Shot shot = shot_of(scene, scene, 1);
  const Transform<Lens, Scanner> behind = turned(true_pose(), 180, Eigen::Vector3d::UnitY());
  const auto away = align_shot(shot, behind, {});
  ASSERT_FALSE(away.ok());
  EXPECT_EQ(away.error().code, ErrorCode::Unavailable);
  EXPECT_EQ(align_shot(shot, true_pose(), {.search_deg = 0}).error().code, ErrorCode::Invalid);
  Shot larger = shot;
  larger.lens.width = 1280;
  EXPECT_EQ(align_shot(larger, true_pose(), {}).error().code, ErrorCode::Invalid);
  shot.intensity.pop_back();
  EXPECT_EQ(align_shot(shot, true_pose(), {}).error().code, ErrorCode::Invalid);
}

TEST(ShotAlignment, FindsThePublishedPoseOfARealShot) {
  HUELINE_REQUIRE_DATA("lidar_camera/0.pcd");
  auto image = read_grey_image((data_file.parent_path() / "0.png").string());
  ASSERT_TRUE(image.ok()) << image.error().message;
  Shot shot;
  std::ifstream in(data_file);
  bool has_begun = false;
  for (std::string line; std::getline(in, line);) {
    float x, y, z, i;
    if (has_begun && std::sscanf(line.c_str(), "%f %f %f %f", &x, &y, &z, &i) == 4) {
      shot.p_scanner.emplace_back(x, y, z);
      shot.intensity.push_back(i);
    }
    has_begun = has_begun || line.rfind("DATA", 0) == 0;
  }
  ASSERT_GT(shot.p_scanner.size(), 70000u);
  // center_camera-intrinsic.json and top_center_lidar-to-center_camera-extrinsic.json.
  shot.lens.model = LensModel::Brown;
  shot.lens.width = static_cast<std::uint32_t>(image->width);
  shot.lens.height = static_cast<std::uint32_t>(image->height);
  shot.lens.focal_px = {2109.75, 2071.72};
  shot.lens.principal_point_px = {949.828, 576.237};
  shot.lens.distortion = {-0.10814499855041504, 0.1386680006980896, -0.0037975700106471777, -0.004841269925236702, 0};
  shot.max_angle = 0.7;
  shot.image = std::move(*image);
  Eigen::Matrix3d R;
  R << 0.0125908, -0.999895, -0.00713773, 0.0119283, 0.00728786, -0.999902, 0.99985, 0.0125045, 0.0120187;
  const Transform<Lens, Scanner> published{Eigen::Quaterniond(R).normalized(), {-0.0322306, -0.352079, -0.574468}};
  const auto found = align_shot(shot, turned(published, 2, {1, -2, 1.5}), {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  std::printf("  %.3f deg from the published pose, sigma %.3f deg; score %.4f at the start, %.4f found\n",
              error_deg(*found, published), found->sigma() * kDegPerRad, found->score_start, found->score);
  EXPECT_TRUE(found->is_determined()) << doubts_of(*found);
  EXPECT_LT(error_deg(*found, published), 0.3);
}

}  // namespace
}  // namespace hueline::calibration
