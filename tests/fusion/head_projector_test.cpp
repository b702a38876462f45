#include "fusion/head_projector.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/coloured_point.hpp"
#include "tests/fusion/drive.hpp"

namespace hueline::fusion {
namespace {

/// Compares the float path of a full-size Ladybug lens with the exact model, up to fields of view that no lens of today
/// has.
TEST(FloatLens, EqualsTheExactModelToAThousandthOfAPixel) {
  for (const LensModel model : {LensModel::Brown, LensModel::KannalaBrandt}) {
    for (const double field : {0.6, 1.2, 1.5, 1.9, 2.3, 2.49}) {
      LensMount mount = test::ladybug_rig(model).head.lenses[1];
      mount.intrinsics.width = 2448;
      mount.intrinsics.height = 2048;
      mount.intrinsics.focal_px *= 4.5;
      mount.intrinsics.principal_point_px *= 8;
      mount.intrinsics.max_angle = field;
      ASSERT_EQ(mount.intrinsics.validate(), "");
      EXPECT_LT(FloatLens(mount).largest_error_px(CameraModel(mount.intrinsics)), 2e-3) << "field " << field;
    }
  }
}

TEST(HeadProjector, TheNearestAxisWinsAndAMissingImageIsPassedOver) {
  const CameraHeadGeometry head = test::ladybug_rig(LensModel::KannalaBrandt).head;
  const HeadProjector projector(head, ColourMethod::Lens);
  const std::uint8_t has_image[] = {1}, has_none[] = {0};
  Sight sight;
  ASSERT_TRUE(projector.see(10, 0, 0, has_image, 0, sight));
  EXPECT_EQ(sight.lens, 0);
  ASSERT_TRUE(projector.see(3, -9, 0, has_image, 0, sight));  // 72 degrees to the right
  EXPECT_EQ(sight.lens, 1);
  ASSERT_TRUE(projector.see(0.5f, 0, 10, has_image, 0, sight));
  EXPECT_EQ(sight.lens, 5);
  EXPECT_FALSE(projector.see(0.1f, 0, -10, has_image, 0, sight));  // no lens looks down
  EXPECT_FALSE(projector.see(10, 0, 0, has_none, 0, sight));
  EXPECT_FALSE(projector.see(0, 0, 0, has_image, 0, sight));
}

TEST(HeadProjector, ManyPlacesAtOnceAreSeenAsOneByOne) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> along(-20, 20);
  for (const LensModel model : {LensModel::Brown, LensModel::KannalaBrandt}) {
    CameraHeadGeometry head = test::ladybug_rig(model).head;
    head.lenses[0].row_time = nanoseconds(80'000);
    head.lenses[3].row_time = nanoseconds(-30'000);
    head.lenses[1].masks = {{{40, 40}, {200, 40}, {200, 150}, {40, 150}}};
    const HeadProjector projector(head, ColourMethod::Lens);
    const std::vector<std::uint8_t> has_image(projector.cameras().size(), 1);
    HeadMotion motion{.velocity = {14, 0.3f, -0.2f}, .rate = {0.1f, -0.2f, 0.6f}};
    motion.lateness[0] = -0.002f;  // beside its rolling shutter
    motion.lateness[2] = 0.006f;
    const RelativeHead at{{0, 1, 0, -1, 0, 0, 0, 0, 1}, {0.5f, -2, 0.25f}};
    for (const std::size_t count : {0ul, 1ul, 15ul, 16ul, 4003ul}) {
      RelativePlaces places;
      for (std::size_t i = 0; i < count; ++i) {
        places.x.push_back(along(random));
        places.y.push_back(along(random));
        places.z.push_back(0.3f * along(random));
      }
      for (const std::uint32_t blind : {0u, 4u}) {
        Sights sights;
        projector.see_each(at, motion, places, has_image.data(), blind, sights);
        std::size_t seen = 0, seen_one_by_one = 0;
        for (std::size_t i = 0; i < count; ++i) {
          const auto [x, y, z] = at.place(places.x[i], places.y[i], places.z[i]);
          Sight sight;
          const bool is_seen = projector.see(x, y, z, has_image.data(), blind, sight, motion);
          seen_one_by_one += is_seen;
          if (sights.lens[i] == kNoLens) continue;
          ++seen;
          ASSERT_TRUE(is_seen);
          ASSERT_EQ(sights.lens[i], sight.lens);
          ASSERT_EQ(sights.x[i], sight.x);
          ASSERT_EQ(sights.y[i], sight.y);
          ASSERT_EQ(sights.border_px[i], sight.border_px);
        }
        if (count > 100) {
          EXPECT_GT(seen, seen_one_by_one * 8 / 10) << blind;
          EXPECT_GT(seen_one_by_one, count / 2);
        }
      }
    }
  }
}

TEST(HeadProjector, OneLensSeesManyPlacesAtOnceAsOneByOne) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> along(-20, 20);
  for (const LensModel model : {LensModel::Brown, LensModel::KannalaBrandt}) {
    const HeadProjector projector(test::ladybug_rig(model).head, ColourMethod::Lens);
    for (const std::size_t count : {0ul, 1ul, 17ul, 4003ul}) {
      std::vector<float> x(count), y(count), z(count);
      for (std::size_t i = 0; i < count; ++i) x[i] = along(random), y[i] = along(random), z[i] = along(random);
      for (const FloatLens& lens : projector.lenses()) {
        LensSights sights;
        const bool any = lens.project_each(x, y, z, sights);
        std::size_t seen = 0;
        for (std::size_t i = 0; i < count; ++i) {
          Sight sight;
          const bool is_seen = lens.project(x[i], y[i], z[i], sight);
          seen += is_seen;
          if (!any) {
            ASSERT_FALSE(is_seen);
            continue;
          }
          ASSERT_EQ(sights.border_px[i] > kLeastBorder_px, is_seen);
          if (!is_seen) continue;
          ASSERT_EQ(sights.x[i], sight.x);
          ASSERT_EQ(sights.y[i], sight.y);
          ASSERT_EQ(sights.border_px[i], sight.border_px);
          const auto& t = lens.t_lens_head;
          const auto& R = lens.R_lens_head;
          EXPECT_NEAR(sights.cosine[i], (R[6] * x[i] + R[7] * y[i] + R[8] * z[i] + t[2]) / sight.distance, 1e-5);
        }
        if (count > 100) {
          EXPECT_GT(seen, count / 10);
        }
      }
    }
  }
}

TEST(HeadProjector, ShowsWhatItsNearestPixelShowsWithoutTheMaskAndTheBorder) {
  CameraHeadGeometry head = test::ladybug_rig(LensModel::KannalaBrandt).head;
  for (LensMount& lens : head.lenses) lens.masks = {{{100, 100}, {200, 100}, {200, 150}, {100, 150}}};
  const HeadProjector projector(head, ColourMethod::Lens);
  const std::vector<std::uint8_t> has_image(projector.cameras().size(), 1);
  const PixelMask masked(head.lenses[0].masks, 306, 256, 0);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> along(-1, 1);
  std::size_t at_border = 0, beside_mask = 0;
  for (int i = 0; i < 200'000; ++i) {
    const float x = along(random), y = along(random), z = along(random);
    Sight sight;
    if (!projector.see(x, y, z, has_image.data(), 0, sight)) continue;
    // Of the pixels around the nearest one, the first square that reaches beyond the border or into the mask.
    const int column = static_cast<int>(std::lround(sight.x)), row = static_cast<int>(std::lround(sight.y));
    int clear = kSampleReach + 1;
    bool is_border = false;
    for (int dy = -kSampleReach; dy <= kSampleReach; ++dy)
      for (int dx = -kSampleReach; dx <= kSampleReach; ++dx) {
        const int u = column + dx, v = row + dy, away = std::max(std::abs(dx), std::abs(dy));
        const bool is_inside = u >= 0 && v >= 0 && u < 306 && v < 256;
        if (is_inside && !masked.covers(static_cast<std::uint32_t>(u), static_cast<std::uint32_t>(v))) continue;
        if (away < clear) is_border = !is_inside;
        clear = std::min(clear, away);
      }
    ASSERT_GT(clear, kPixelReach) << sight.x << ' ' << sight.y;
    const bool is_at_margin = projector.lenses()[sight.lens].is_at_margin(sight.x, sight.y);
    if (clear <= kSampleReach && !is_at_margin) {
      // A sample reads kSampleReach pixels only to the side on which its place lies beside the nearest pixel.
      ASSERT_TRUE(is_border && clear == kSampleReach) << sight.x << ' ' << sight.y;
      ASSERT_GE(sight.border_px, static_cast<float>(kSampleReach));
    }
    at_border += is_border && clear == kPixelReach + 1;
    beside_mask += !is_border && clear == kPixelReach + 1;
  }
  EXPECT_GT(at_border, 100u);
  EXPECT_GT(beside_mask, 100u);
}

TEST(HeadProjector, ALensThatIsLateSeesAPlaceFromWhereItIsThen) {
  const CameraHeadGeometry head = test::ladybug_rig(LensModel::KannalaBrandt).head;
  const HeadProjector projector(head, ColourMethod::Lens);
  const std::vector<std::uint8_t> has_image(projector.cameras().size(), 1);
  HeadMotion motion{.velocity = {20, -3, 0.5f}, .rate = {0.05f, -0.1f, 0.5f}};
  motion.lateness.fill(0.005f);
  std::size_t seen = 0;
  for (int turn = 0; turn < 36; ++turn) {
    const double angle = turn * std::numbers::pi / 18, dt = 0.005;
    const Eigen::Vector3d place(8 * std::cos(angle), 8 * std::sin(angle), 0.4);
    // After dt the head has moved by velocity dt, and a standing place has turned by rate dt in its axes.
    const Eigen::Vector3d rate(0.05, -0.1, 0.5), velocity(20, -3, 0.5);
    const Eigen::Vector3d then = Eigen::AngleAxisd(rate.norm() * dt, rate.normalized()) * place - velocity * dt;
    Sight late, there;
    if (!projector.see(static_cast<float>(place.x()), static_cast<float>(place.y()), static_cast<float>(place.z()),
                       has_image.data(), 0, late, motion) ||
        !projector.lenses()[late.lens].project(static_cast<float>(then.x()), static_cast<float>(then.y()),
                                               static_cast<float>(then.z()), there))
      continue;
    ++seen;
    EXPECT_NEAR(late.x, there.x, 0.05);
    EXPECT_NEAR(late.y, there.y, 0.05);
  }
  EXPECT_GT(seen, 30u);
}

}  // namespace
}  // namespace hueline::fusion
