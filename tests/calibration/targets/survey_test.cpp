#include "calibration/targets/survey.hpp"

#include <gtest/gtest.h>

namespace hueline::calibration {
namespace {

const SurveyDefaults kDefaults{0.003, 0.0725};

std::string why(const std::string& csv) {
  const auto targets = parse_targets(csv, "targets.csv", kDefaults);
  return targets.ok() ? "" : targets.error().message;
}

TEST(Survey, ReadsColumnsInAnyOrder) {
  const auto targets = parse_targets(
      "# sphere "
      "centres\nup_m,name,east_m,north_m,role,sigma_m,radius_m,stations\n12.5,T1,512000.125,4398000.5,,0.002,0.145,S01 "
      "S02\r\n13,C1,512100,4398000,check,,,\n",
      "t.csv", kDefaults);
  ASSERT_TRUE(targets.ok()) << targets.error().message;
  ASSERT_EQ(targets->size(), 2u);
  EXPECT_EQ((*targets)[0].position.xyz, Eigen::Vector3d(512000.125, 4398000.5, 12.5));
  EXPECT_EQ((*targets)[0].sigma_m, 0.002);
  EXPECT_EQ((*targets)[0].radius_m, 0.145);
  EXPECT_EQ((*targets)[0].stations, (std::vector<std::string>{"S01", "S02"}));
  EXPECT_TRUE((*targets)[1].is_check);
  EXPECT_EQ((*targets)[1].sigma_m, 0.003);
  EXPECT_EQ((*targets)[1].radius_m, 0.0725);
}

TEST(Survey, RefusesWithFileLineAndRemedy) {
  EXPECT_EQ(why("name,east_m,north_m\nT1,1,2\n"),
            "targets.csv:1: column 'up_m' is missing; the first line must name name, east_m, north_m, up_m");
  EXPECT_NE(why("name,east_ft,north_ft,up_ft\n").find("not in metres"), std::string::npos);
  EXPECT_NE(why("name,east,north,up\n").find("does not say its unit"), std::string::npos);
  EXPECT_NE(why("name,easting_m,northing_m,up_m\n").find("column 'easting_m' is unknown; name it east_m;"),
            std::string::npos);
  EXPECT_NE(why("name,x,y,z\n").find("which axis"), std::string::npos);
  EXPECT_NE(why("name,lat,lon,up_m\n").find("is an angle"), std::string::npos);
  EXPECT_EQ(why("name;east_m;north_m;up_m\nT1;1,5;2;3\nT2;9.5;2;3\n"),
            "targets.csv:2: east_m is '1,5', not a number; decimals stand behind a point");
  EXPECT_EQ(why("name,height\n"),
            "targets.csv:1: column 'height' is unknown; allowed: name, east_m, north_m, up_m, sigma_m, radius_m, role, "
            "stations");
  EXPECT_NE(why("name,east_m,north_m,up_m\nT1,1,2,3,4\n").find("targets.csv:2: 5 values"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m\nT1,1,2,nan\n").find("not a number"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m\nT1,1,2,1e5\n").find("no height on Earth"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m\nT1,512000000,2,3\n").find("millimetres"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m\nT1,1,2,3\nT1,50,2,3\n").find("stands twice"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m\nT1,1,2,3\nT2,1.05,2,3\n").find("inside T1"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m,radius_m\nT1,1,2,3,72.5\n").find("radius_m is 72.5"), std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m,role\nT1,1,2,3,spare\n").find("allowed: orientation, check"),
            std::string::npos);
  EXPECT_NE(why("name,east_m,north_m,up_m\n").find("no rows"), std::string::npos);
}

}  // namespace
}  // namespace hueline::calibration
