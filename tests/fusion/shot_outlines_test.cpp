#include "fusion/shot_outlines.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/fusion/drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;

/// A red board 5 m away before a blue wall 20 m away. The scanner is 0.5 m to the right of the lens, so that it sees
/// some of the wall that the board hides from the lens.
struct BoardAndWall {
  CameraIntrinsics lens;
  Image image;
  Transform<Lens, Scanner> T_lens_scanner;
  std::vector<Point<Scanner>> places;

  BoardAndWall() {
    lens.width = 640;
    lens.height = 480;
    lens.focal_px = {400, 400};
    lens.principal_point_px = {320, 240};
    // The board reaches from 1 m left of the optical axis to the axis.
    image = make_image(640, 480, PixelFormat::Rgb8, [](std::uint32_t x, std::uint32_t, int c) {
      return x >= 240 && x <= 320 ? (c == 0 ? 200.0 : 20.0) : (c == 2 ? 200.0 : 20.0);
    });
    Eigen::Matrix3d R;
    R << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // the scanner's y axis is the optical axis
    T_lens_scanner.rotation = Eigen::Quaterniond(R);
    T_lens_scanner.translation = {0.5, 0, 0};
    for (int elevation = -8; elevation <= 8; ++elevation)
      for (double azimuth = -0.5; azimuth < 0.5; azimuth += 0.004) {
        const double x = 5 * std::tan(azimuth) + 0.5, distance = x >= -1 && x <= 0 ? 5 : 20;
        places.push_back({{distance * std::tan(azimuth), distance, distance * std::tan(elevation * 0.02)}});
      }
  }
  std::vector<ShotPoint> shot(bool test_visibility) const {
    return colour_single_shot(places, T_lens_scanner, CameraModel(lens), view_of(image),
                              {.test_visibility = test_visibility});
  }
};

TEST(ShotOutlines, PointsThatTheLensCannotSeeHaveTheNearerColourUntilTheyAreRefused) {
  const BoardAndWall scene;
  const auto all = scene.shot(false), tested = scene.shot(true);
  const OutlineFigures figures = judge_outlines(scene.places, all, tested, 10);
  EXPECT_GT(figures.all.judged, 100u);
  EXPECT_EQ(figures.all.judged, figures.kept.judged + figures.refused.judged);
  EXPECT_EQ(figures.all.foreign, figures.kept.foreign + figures.refused.foreign);
  EXPECT_GT(figures.all.share(), 0.3);
  EXPECT_EQ(figures.kept.foreign, 0u);
  EXPECT_GT(figures.refused.share(), 0.3);
}

TEST(ShotOutlines, SidesOfOneColourSayNothing) {
  BoardAndWall scene;
  scene.image = make_image(640, 480, PixelFormat::Rgb8, [](std::uint32_t, std::uint32_t, int) { return 90.0; });
  const OutlineFigures figures = judge_outlines(scene.places, scene.shot(false), scene.shot(true), 10);
  EXPECT_EQ(figures.all.judged, 0u);
  EXPECT_EQ(figures.all.share(), 0.0);
}

TEST(ShotOutlines, TheGapIsThatOfTheRings) {
  const BoardAndWall scene;
  EXPECT_NEAR(ring_gap_px(scene.shot(false)), 400 * 0.02, 1);
  EXPECT_EQ(ring_gap_px({}), 0.0);
}

}  // namespace
}  // namespace hueline::fusion
