#include "core/mounting.hpp"

#include <gtest/gtest.h>

#include "config/key_reader.hpp"

namespace hueline::config {
namespace {

Mounting read(const std::string& text) { return read_config<Mounting>(Section::load_text(text, "rig.yaml")); }

TEST(Mounting, ThreeFormsSayTheSame) {
  // The scanner is turned 90 deg to the left about z, so its forward axis (y) points along the body's -x.
  const auto a = read("position_m: [1, 2, 3]\nrotation_deg: [0, 0, 90]\n");
  const auto b = read("position_m: [1, 2, 3]\nrotation_matrix: [0, -1, 0, 1, 0, 0, 0, 0, 1]\n");
  const auto c = read("position_m: [1, 2, 3]\nquaternion_wxyz: [0.70710678, 0, 0, 0.70710678]\n");
  EXPECT_TRUE((a.rotation() * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitX(), 1e-12));
  EXPECT_LT(a.rotation().angularDistance(b.rotation()), 1e-9);
  EXPECT_LT(a.rotation().angularDistance(c.rotation()), 1e-7);
  EXPECT_EQ(a.position_m, Eigen::Vector3d(1, 2, 3));
}

TEST(Mounting, AnglesTurnAboutFixedAxesXThenYThenZ) {
  const auto m = read("position_m: [0, 0, 0]\nrotation_deg: [90, 0, 90]\n");
  EXPECT_TRUE((m.rotation() * Eigen::Vector3d::UnitY()).isApprox(Eigen::Vector3d::UnitZ(), 1e-12))
      << "x first: y to z; z then leaves it";
}

TEST(Mounting, RefusesWhatIsNoRotation) {
  EXPECT_THROW(read("position_m: [0, 0, 0]\nrotation_matrix: [1, 0, 0, 0, 1, 0, 0, 0, -1]\n"), ConfigError)
      << "a mirror";
  EXPECT_THROW(read("position_m: [0, 0, 0]\nrotation_matrix: [1, 0, 0, 0, 1, 0, 0, 0.1, 1]\n"), ConfigError);
  EXPECT_THROW(read("position_m: [0, 0, 0]\nquaternion_wxyz: [1, 1, 0, 0]\n"), ConfigError);
  EXPECT_THROW(read("position_m: [0, 0, 0]\n"), ConfigError);
  EXPECT_THROW(read("position_m: [0, 0, 0]\nrotation_deg: [0, 0, 0]\nquaternion_wxyz: [1, 0, 0, 0]\n"), ConfigError);
}

TEST(CalibrationRecord, IsReadBesideAMounting) {
  CalibrationRecord record{"mount",       "2026-11-21",   {"20 points of \"targets.csv\""}, 0.8, "px", {"a_deg", "b_m"},
                           {0.01, 0.002}, {1e-4, 0, 4e-6}};
  const std::string mounting = "position_m: [0, 0, 0]\nrotation_deg: [0, 0, 0]\n";
  EXPECT_NO_THROW(read(mounting + record.yaml(0)));
  Section root = Section::load_text(mounting + record.yaml(0), "rig.yaml");
  const CalibrationRecord again = read_config<CalibrationRecord>(root.section("calibration"));
  EXPECT_EQ(again.data, record.data);
  EXPECT_EQ(again.covariance, record.covariance);
  EXPECT_EQ(again.date, record.date);
}

TEST(CalibrationRecord, AResidualThatNobodyMeasuredIsNotWritten) {
  CalibrationRecord record{"mount", "2026-11-21", {"one image, one cloud"}, {}, "", {}, {}, {}};
  EXPECT_EQ(record.yaml(0).find("residual"), std::string::npos) << record.yaml(0);
  const std::string mounting = "position_m: [0, 0, 0]\nrotation_deg: [0, 0, 0]\n";
  Section root = Section::load_text(mounting + record.yaml(0), "rig.yaml");
  EXPECT_FALSE(read_config<CalibrationRecord>(root.section("calibration")).residual_rms);
  record.residual_rms = 0.5;
  EXPECT_THROW(read(mounting + record.yaml(0)), ConfigError) << "of what unit?";
}

TEST(CalibrationRecord, RefusesWhatDoesNotFitTogether) {
  const std::string mounting = "position_m: [0, 0, 0]\nrotation_deg: [0, 0, 0]\n";
  const CalibrationRecord good{"mount", "2026-11-21", {}, 0.8, "px", {"a_deg", "b_m"}, {0.01, 0.002}, {}};
  ASSERT_NO_THROW(read(mounting + good.yaml(0)));
  CalibrationRecord bad = good;
  bad.sigma.pop_back();
  EXPECT_THROW(read(mounting + bad.yaml(0)), ConfigError);
  bad = good;
  bad.covariance = {1, 2};
  EXPECT_THROW(read(mounting + bad.yaml(0)), ConfigError);
  bad = good;
  bad.date = "yesterday";
  EXPECT_THROW(read(mounting + bad.yaml(0)), ConfigError);
}

}  // namespace
}  // namespace hueline::config
