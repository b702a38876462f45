#include "fusion/single_shot.hpp"

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <map>

#include "tests/fusion/drive.hpp"
#include "tests/support/pcd.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;

Image read_png(const std::filesystem::path& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  Image image;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) return image;
  png.format = PNG_FORMAT_RGB;
  std::vector<std::byte> pixels(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr) == 0) return image;
  image.width = png.width;
  image.height = png.height;
  image.stride = 3 * png.width;
  image.format = PixelFormat::Rgb8;
  image.is_complete = true;
  image.buffer = Buffer::copy_of(pixels);
  return image;
}

/// The calibration that comes with the recording (lidar_camera/*.json).
CameraIntrinsics recorded_intrinsics(const Image& image) {
  CameraIntrinsics k;
  k.model = LensModel::Brown;
  k.width = image.width;
  k.height = image.height;
  k.focal_px = {2109.75, 2071.72};
  k.principal_point_px = {949.828, 576.237};
  k.distortion = {-0.10814499855041504, 0.1386680006980896, -0.0037975700106471777, -0.004841269925236702, 0};
  return k;
}
Transform<Lens, Scanner> recorded_extrinsics() {
  Matrix3 R;
  R << 0.0125908, -0.999895, -0.00713773, 0.0119283, 0.00728786, -0.999902, 0.99985, 0.0125045, 0.0120187;
  return {Eigen::Quaterniond(R).normalized(), {-0.0322306, -0.352079, -0.574468}};
}

/// Returns how strongly the image differs from the sky at the points above the roofs (masts, traffic lights, their
/// arms, tree tops), with all points shifted by (du, dv). It is 0 if they fall on sky. Each silhouette is a thin depth
/// edge, so with a wrong projection the points fall beside it.
double silhouette_contrast(const RawView& image, const std::vector<ShotPoint>& shots, int du, int dv) {
  constexpr double kAboveRoofs = 400, kFullContrast = 40;
  const auto grey = [&](int x, int y) {
    const std::uint8_t* p = image.data + static_cast<std::size_t>(y) * image.stride + 3 * x;
    return 0.3 * p[0] + 0.59 * p[1] + 0.11 * p[2];
  };
  std::map<int, double> sky;  // of a row: the median of the row
  double sum = 0;
  int count = 0;
  for (const ShotPoint& p : shots) {
    if (!p.is_in_image || p.v > kAboveRoofs || p.v < 40 || p.u < 40 || p.u > static_cast<float>(image.width) - 41)
      continue;
    const int x = static_cast<int>(std::lround(p.u)) + du, y = static_cast<int>(std::lround(p.v)) + dv;
    if (!sky.contains(y)) {
      std::vector<double> row;
      for (int k = 0; k < static_cast<int>(image.width); k += 8) row.push_back(grey(k, y));
      std::nth_element(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(row.size() / 2), row.end());
      sky[y] = row[row.size() / 2];
    }
    sum += std::min(1.0, std::abs(grey(x, y) - sky[y]) / kFullContrast);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

TEST(RealRecording, DepthEdgesLieOnImageEdges) {
  HUELINE_REQUIRE_DATA("lidar_camera/0.png");
  const Image image = read_png(data_file);
  ASSERT_EQ(image.width, 1920u);
  const auto cloud = read_ascii_pcd(data_file.parent_path() / "0.pcd");
  ASSERT_EQ(cloud.size(), 78238u);
  std::vector<Point<Scanner>> points;
  for (const auto& p : cloud) points.push_back({p});
  const auto shots =
      colour_single_shot(points, recorded_extrinsics(), CameraModel(recorded_intrinsics(image)), view_of(image), {});
  EXPECT_NEAR(
      static_cast<double>(std::count_if(shots.begin(), shots.end(), [](const ShotPoint& p) { return p.is_in_image; })),
      9925, 50);

  // The supplied calibration is itself good to a few pixels, so the contrast must be largest near no shift and fall on
  // all sides.
  Eigen::Vector2i best(99, 99);
  double strongest = 0;
  for (int dv = -24; dv <= 24; dv += 2) {
    for (int du = -24; du <= 24; du += 2) {
      const double contrast = silhouette_contrast(view_of(image), shots, du, dv);
      if (contrast > strongest) {
        strongest = contrast;
        best = {du, dv};
      }
    }
  }
  const auto contrast = [&](int du, int dv) { return silhouette_contrast(view_of(image), shots, du, dv); };
  std::printf(
      "silhouette contrast %.3f, peak %.3f at (%d, %d) px; left 4: %.3f right 4: %.3f up 4: %.3f down 4: %.3f, 12 px: "
      "%.3f %.3f %.3f %.3f\n",
      contrast(0, 0), strongest, best.x(), best.y(), contrast(-4, 0), contrast(4, 0), contrast(0, -4), contrast(0, 4),
      contrast(-12, 0), contrast(12, 0), contrast(0, -12), contrast(0, 12));
  EXPECT_LE(best.cwiseAbs().maxCoeff(), 4);
  // To the right alone it still rises a little, because the recording's calibration lies 2 px to the left of the
  // maximum.
  EXPECT_GT(contrast(0, 0), 0.25 * (contrast(-4, 0) + contrast(4, 0) + contrast(0, -4) + contrast(0, 4)));
  for (const auto& [du, dv] : {std::pair{-12, 0}, {12, 0}, {0, -12}, {0, 12}})
    EXPECT_GT(contrast(0, 0), contrast(du, dv));
}

TEST(RealRecording, ColoursComeFromTheImage) {
  HUELINE_REQUIRE_DATA("lidar_camera/0.png");
  const Image image = read_png(data_file);
  std::vector<Point<Scanner>> points;
  for (const auto& p : read_ascii_pcd(data_file.parent_path() / "0.pcd")) points.push_back({p});
  const auto shots =
      colour_single_shot(points, recorded_extrinsics(), CameraModel(recorded_intrinsics(image)), view_of(image), {});
  const RgbRaster raster = draw_points(shots, view_of(image), {});
  EXPECT_EQ(raster.width, image.width);
  EXPECT_EQ(raster.pixels.size(), 3u * 1920 * 1200);
  std::size_t coloured = 0;
  const RawView view = view_of(image);
  for (const ShotPoint& p : shots) {
    if (p.state != ColourState::Direct) continue;
    ++coloured;
    // The colour lies between the darkest and the brightest of the four pixels around.
    const auto x = static_cast<std::size_t>(p.u), y = static_cast<std::size_t>(p.v);
    const std::uint8_t* q = view.data + y * view.stride + 3 * x;
    const auto [low, high] = std::minmax({q[0], q[3], q[view.stride], q[view.stride + 3]});
    EXPECT_GE(p.red, low);
    EXPECT_LE(p.red, high);
  }
  EXPECT_GT(coloured, 8000u);
}

TEST(SingleShot, WhatIsBehindAWallIsHidden) {
  CameraIntrinsics k;
  k.width = 640;
  k.height = 480;
  k.focal_px = {400, 400};
  k.principal_point_px = {320, 240};
  const Image image = make_image(640, 480, PixelFormat::Rgb8,
                                 [](std::uint32_t x, std::uint32_t y, int c) { return c == 0 ? 0.3 * x : 0.4 * y; });
  Transform<Lens, Scanner> T_lens_scanner;  // the scanner's y axis is the optical axis
  Matrix3 R;
  R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  T_lens_scanner.rotation = Eigen::Quaterniond(R);
  std::vector<Point<Scanner>> points;
  for (int i = -10; i <= 10; ++i) {
    for (int j = -10; j <= 10; ++j) points.push_back({{0.05 * i, 5, 0.05 * j}});  // a wall of 1 m x 1 m, 5 m away
  }
  const std::size_t wall = points.size();
  points.push_back({{0.1, 20, 0.2}});  // behind it
  points.push_back({{6, 20, 0.2}});    // beside it
  points.push_back({{0, -5, 0}});      // behind the camera
  points.push_back({{0, 5.3, 0}});     // on the wall's rough surface
  SingleShotConfig config;
  config.visibility_cell_px = 8;
  const auto shots = colour_single_shot(points, T_lens_scanner, CameraModel(k), view_of(image), config);
  for (std::size_t i = 0; i < wall; ++i) EXPECT_EQ(shots[i].state, ColourState::Direct);
  EXPECT_TRUE(shots[wall].is_hidden);
  EXPECT_EQ(shots[wall].state, ColourState::Outside);
  EXPECT_EQ(shots[wall + 1].state, ColourState::Direct);
  EXPECT_NEAR(shots[wall + 1].u, 320 + 400 * 0.3, 1e-4);
  EXPECT_NEAR(shots[wall + 1].v, 240 - 400 * 0.01, 1e-4);
  EXPECT_NEAR(shots[wall + 1].red, 0.3 * 440, 1.01);
  EXPECT_FALSE(shots[wall + 2].is_in_image);
  EXPECT_FALSE(shots[wall + 3].is_hidden);
}

}  // namespace
}  // namespace hueline::fusion
