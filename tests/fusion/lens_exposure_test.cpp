#include "fusion/lens_exposure.hpp"

#include <gtest/gtest.h>

namespace hueline::fusion {
namespace {

LensMount lens_at(std::uint32_t x, std::uint32_t y) {
  LensMount lens;
  lens.x_offset = x;
  lens.y_offset = y;
  lens.intrinsics.width = 100;
  lens.intrinsics.height = 80;
  return lens;
}

TEST(LensExposure, EachLensHasTheReportOfItsPartOfTheImage) {
  Exposure exposure;
  exposure.duration = nanoseconds(3000);
  EXPECT_EQ(report_of(exposure.image, lens_at(0, 0)), nullptr);
  EXPECT_EQ(duration_of(exposure, lens_at(0, 0)), nanoseconds(3000)) << "the rig's";
  EXPECT_EQ(lateness_of(exposure, lens_at(0, 0)), nanoseconds(0));
  exposure.image.reported = {{.region = {0, 0, 100, 80}, .duration = nanoseconds(1000)},
                             {.region = {100, 0, 100, 80}, .duration = nanoseconds(5000)},
                             {.region = {0, 80, 100, 80}, .gain = 2}};
  EXPECT_EQ(lateness_of(exposure, lens_at(0, 0)), nanoseconds(-1000));
  EXPECT_EQ(lateness_of(exposure, lens_at(100, 0)), nanoseconds(1000));
  // A lens whose image lies a little beside the part that the camera gives it.
  EXPECT_EQ(lateness_of(exposure, lens_at(96, 3)), nanoseconds(1000));
  // The camera says nothing of how long it was exposed, and nothing at all.
  EXPECT_EQ(report_of(exposure.image, lens_at(0, 80))->gain, 2);
  EXPECT_EQ(lateness_of(exposure, lens_at(0, 80)), nanoseconds(0));
  EXPECT_EQ(report_of(exposure.image, lens_at(100, 80)), nullptr);
}

TEST(LensExposure, AReportOfTheWholeImageIsThatOfEachLens) {
  Exposure exposure;
  exposure.duration = nanoseconds(7000);
  exposure.image.reported = {{.duration = nanoseconds(7000)}};
  for (const auto& lens : {lens_at(0, 0), lens_at(500, 600)}) {
    EXPECT_EQ(duration_of(exposure, lens), nanoseconds(7000));
    EXPECT_EQ(lateness_of(exposure, lens), nanoseconds(0));
  }
}

}  // namespace
}  // namespace hueline::fusion
