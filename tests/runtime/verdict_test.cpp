#include "runtime/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hueline::runtime {
namespace {

Remark remark(const char* sensor, double begin_s, double end_s) {
  Remark out;
  out.sensor = sensor;
  out.text = "sends nothing";
  out.begin_s = begin_s;
  out.end_s = end_s;
  out.length_m = 10;
  out.place = Geodetic{0.8, 0.2 + begin_s * 1e-6, 400};
  return out;
}

TEST(Verdict, NamesAStretchOnceHoweverManySensorsWereInTrouble) {
  Verdict verdict;
  verdict.grade = Grade::Again;
  verdict.remarks = {remark("pos", 12, 20), remark("pps", 12, 20), remark("laser", 13, 19), remark("camera", 30, 31)};
  const std::string text = verdict.text();
  EXPECT_THAT(text, testing::HasSubstr("pos: sends nothing; pps: sends nothing; laser: sends nothing; and 1 more"));
  EXPECT_THAT(text, testing::HasSubstr("where: 12 s for 8 s and 10 m at"));
  EXPECT_EQ(text.find("13 s for"), std::string::npos) << text;
  EXPECT_EQ(text.find("12 s for"), text.rfind("12 s for")) << text;
  EXPECT_THAT(text, testing::HasSubstr("; 30 s for 1 s"));
}

TEST(Verdict, AShareThatIsJustTooSmallDoesNotLookLikeWhatIsWanted) {
  EXPECT_DOUBLE_EQ(percent_below(0.97996), 97.9);
  for (int tenths = 0; tenths <= 1000; ++tenths) EXPECT_DOUBLE_EQ(percent_below(0.001 * tenths), 0.1 * tenths);
}

}  // namespace
}  // namespace hueline::runtime
