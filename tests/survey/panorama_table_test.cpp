#include "survey/panorama_table.hpp"

#include <gtest/gtest.h>

#include <string>

namespace hueline::survey {
namespace {

DrivePanorama sample() {
  DrivePanorama one;
  one.exposure = 12;
  one.time = gps_time_ns(1'440'331'213'251'137'000);
  one.centre = {0.84, 0.2, 567.6};
  one.view.shape.width = 4096;
  one.view.shape.height = 2048;
  one.view.shape.forward_column = 100.25;
  one.view.shape.is_clockwise = false;
  one.view.R_head_view = Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.1, -0.3, 1).normalized());
  return one;
}

std::string line_of(const DrivePanorama& one, const char* name) {
  return panorama_table_line(one, name, {691605.0646, 5334756.5432, 567.6025});
}

TEST(PanoramaTable, GivesBackHowPanoramasAreDrawn) {
  DrivePanorama second = sample();
  second.exposure = 13;
  const auto read =
      parse_panorama_table(panorama_table_head() + line_of(sample(), "a.jpg") + line_of(second, "b.jpg"), "t.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2u);
  EXPECT_LT(abs(*read->at(12).time - sample().time), nanoseconds(1000));
  const fusion::PanoramaView& view = read->at(12).view;
  EXPECT_EQ(view.shape.width, 4096u);
  EXPECT_EQ(view.shape.height, 2048u);
  EXPECT_DOUBLE_EQ(view.shape.forward(), 100.25);
  EXPECT_FALSE(view.shape.is_clockwise);
  EXPECT_LT(view.R_head_view.angularDistance(sample().view.R_head_view), 1e-9);
}

TEST(PanoramaTable, RefusesWhatIsNoPanorama) {
  const auto said = [](const std::string& from, const std::string& to) {
    std::string text = panorama_table_head() + line_of(sample(), "a.jpg");
    text.replace(text.find(from), from.size(), to);
    const auto read = parse_panorama_table(text, "t.csv");
    return read.ok() ? "" : read.error().message;
  };
  EXPECT_EQ(said("a.jpg", "b.jpg"), "");
  EXPECT_NE(said(",4096,2048,", ",4096,1000,").find("t.csv:2: width_px is not twice height_px"), std::string::npos);
  EXPECT_NE(said(",0.93937", ",0.5").find("are no rotation"), std::string::npos) << line_of(sample(), "a");
  EXPECT_NE(said("width_px", "wide").find("width_px"), std::string::npos);
  const std::string line = line_of(sample(), "a.jpg");
  EXPECT_NE(parse_panorama_table(panorama_table_head() + line + line, "t.csv").error().message.find("twice"),
            std::string::npos);
}

TEST(ExposureChoice, ReadsNumbersRangesAndSteps) {
  const auto all = ExposureChoice::parse("all");
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->every, 1);
  EXPECT_TRUE(all->has_number(4711));
  EXPECT_EQ(ExposureChoice::parse("every:5")->every, 5);
  const auto some = ExposureChoice::parse("3,7,20-30");
  ASSERT_TRUE(some.ok());
  for (const std::uint32_t number : {3u, 7u, 20u, 25u, 30u}) EXPECT_TRUE(some->has_number(number));
  for (const std::uint32_t number : {0u, 4u, 19u, 31u}) EXPECT_FALSE(some->has_number(number));
  for (const char* wrong : {"", "every:", "every:0", "every:-1", "3,", ",3", "5-3", "1-2-3", "a", "3 4", "99999999999"})
    EXPECT_EQ(ExposureChoice::parse(wrong).error().code, ErrorCode::Invalid) << wrong;
}

}  // namespace
}  // namespace hueline::survey
