#include "runtime/test_exposure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <utility>

namespace hueline::runtime {
namespace {

using testing::HasSubstr;

/// The shipped rig: one camera that stacks the images of several lenses.
class Exposing : public testing::Test {
 protected:
  const fusion::LensMount& lens(std::size_t i) const { return rig_.geometry.head.lenses.at(i); }
  /// An image whose lenses have one value each; all others are 100.
  Image image(std::vector<std::pair<std::size_t, std::uint8_t>> values, double at_s = 0) const {
    Image out;
    out.sensor = lens(0).camera;
    for (const auto& one : rig_.geometry.head.lenses) {
      out.width = std::max(out.width, one.x_offset + one.intrinsics.width);
      out.height = std::max(out.height, one.y_offset + one.intrinsics.height);
    }
    out.stride = out.width;
    out.is_complete = true;
    out.received = host_time_ns(static_cast<std::int64_t>(at_s * 1e9));
    std::vector<std::byte> pixels(std::size_t{out.stride} * out.height, std::byte{100});
    for (const auto& [i, value] : values)
      for (std::uint32_t y = 0; y < lens(i).intrinsics.height; ++y)
        std::memset(pixels.data() + (lens(i).y_offset + y) * std::size_t{out.stride} + lens(i).x_offset, value,
                    lens(i).intrinsics.width);
    out.buffer = Buffer::copy_of(pixels);
    return out;
  }
  config::Rig rig_ = config::load_rig("street");
  TestExposure exposure_{rig_};
};

TEST_F(Exposing, CountsThePixelsOfEachLens) {
  exposure_.take(image({{0, 7}, {1, 255}}));
  const auto lenses = exposure_.lenses();
  ASSERT_EQ(lenses.size(), rig_.geometry.head.lenses.size());
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    EXPECT_EQ(lenses[i].lens, lens(i).name);
    EXPECT_EQ(lenses[i].count(), std::uint64_t{lens(i).intrinsics.width} * lens(i).intrinsics.height);
  }
  EXPECT_EQ(lenses[0].median(), 7);
  EXPECT_EQ(lenses[0].dark_share(), 1);
  EXPECT_EQ(lenses[0].saturated_share(), 0);
  EXPECT_EQ(lenses[1].median(), 255);
  EXPECT_EQ(lenses[1].saturated_share(), 1);
  EXPECT_EQ(lenses[2].median(), 103);
}

TEST_F(Exposing, TakesOneWholeImageASecond) {
  Image broken = image({{0, 0}});
  broken.is_complete = false;
  exposure_.take(broken);
  EXPECT_TRUE(exposure_.lenses().empty());
  exposure_.take(image({{0, 50}}, 1));
  exposure_.take(image({{0, 60}}, 1.9));
  EXPECT_EQ(exposure_.lenses().at(0).median(), 51);
  exposure_.take(image({{0, 70}}, 2.1));
  EXPECT_EQ(exposure_.lenses().at(0).median(), 71);
}

TEST_F(Exposing, ACapPreventsTheDriveAndPoorLightIsARemark) {
  exposure_.take(image({{0, 1}, {1, 255}}));
  const auto found = check_light(exposure_.lenses());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(found[0].prevents);
  EXPECT_EQ(found[0].about, lens(0).name);
  EXPECT_THAT(found[0].action, HasSubstr("cap"));
  EXPECT_FALSE(found[1].prevents);
  EXPECT_EQ(found[1].about, lens(1).name);
  EXPECT_THAT(found[1].text, HasSubstr("too bright"));
  EXPECT_TRUE(check_light(TestExposure(rig_).lenses()).empty()) << "no image is told by others";
}

}  // namespace
}  // namespace hueline::runtime
