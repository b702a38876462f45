#include "fusion/head_projector.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace hueline::fusion
