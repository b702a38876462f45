// Calibration files of ROS, written by hand, and the decoder that uses them.
#include "drivers/velodyne/velodyne_angles.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/angle.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"

namespace hueline::drivers {
namespace {

using test::only;
using test::TemporaryFile;

test::Bytes bytes_of(const std::string& text) {
  test::ByteWriter out(false);
  return out.text(text).bytes();
}

/// A calibration of a model whose lasers point `off_deg` above the nominal direction and are turned clockwise by it.
std::string calibration_of(VelodyneModel model, double off_deg, const std::string& more = "") {
  const VelodyneTable& table = velodyne_table(model);
  std::string text = "lasers:\n";
  for (int i = table.count() - 1; i >= 0; --i) {  // the order of the list means nothing
    const VelodyneLaser& laser = table.lasers[static_cast<std::size_t>(i)];
    text +=
        fmt::format("- {{dist_correction: 0.0, laser_id: {}, rot_correction: {},\n   vert_correction: {}, {}}}\n", i,
                    -(laser.azimuth_deg + off_deg) * kRadPerDeg, (laser.elevation_deg + off_deg) * kRadPerDeg, more);
  }
  return text + fmt::format("num_lasers: {}\ndistance_resolution: 0.002\n", table.count());
}

Result<VelodyneCalibration> read(const std::string& text) {
  const TemporaryFile file("velodyne_angles.yaml", bytes_of(text));
  return read_velodyne_calibration(file.path());
}

TEST(VelodyneAngles, AreThoseOfTheFileInTheOrderOfThePacket) {
  const auto of_vlp32c = read(calibration_of(VelodyneModel::Vlp32c, 0.25, "vert_offset_correction: 0.01"));
  ASSERT_TRUE(of_vlp32c.ok()) << of_vlp32c.error().message;
  ASSERT_EQ(of_vlp32c->angles.elevations_deg.size(), 32u);
  EXPECT_NEAR(of_vlp32c->angles.elevations_deg[0], -24.75, 1e-9);
  EXPECT_NEAR(of_vlp32c->angles.azimuths_deg[0], 1.65, 1e-9);
  EXPECT_NEAR(of_vlp32c->vertical_offset_mm[31], 10, 1e-9);
  EXPECT_FALSE(of_vlp32c->moves_points);
  EXPECT_EQ(why_not_of(velodyne_table(VelodyneModel::Vlp32c), *of_vlp32c), "");
  // The older files have a line for each key.
  const auto lines = read(
      "lasers:\n- dist_correction: 0.0\n  laser_id: 1  # the second\n  rot_correction: 0.1\n  vert_correction: -0.2\n"
      "- laser_id: 0\n  rot_correction: 0\n  vert_correction: +1.0e-01\nnum_lasers: 2\n");
  ASSERT_TRUE(lines.ok()) << lines.error().message;
  EXPECT_NEAR(lines->angles.elevations_deg.at(0) * kRadPerDeg, 0.1, 1e-12);
  EXPECT_NEAR(lines->angles.elevations_deg.at(1) * kRadPerDeg, -0.2, 1e-12);
  EXPECT_NEAR(lines->angles.azimuths_deg.at(1) * kRadPerDeg, -0.1, 1e-12);
}

TEST(VelodyneAngles, OfAnotherModelAreRefusedWithItsName) {
  const auto hdl = read(calibration_of(VelodyneModel::Hdl32e, 0.1));
  ASSERT_TRUE(hdl.ok());
  const std::string wrong = why_not_of(velodyne_table(VelodyneModel::Vlp32c), *hdl);
  EXPECT_NE(wrong.find("not the directions of a VLP-32C: channel"), std::string::npos) << wrong;
  EXPECT_NE(wrong.find("these fit the model HDL-32E; give the file of this very scanner"), std::string::npos) << wrong;
  EXPECT_NE(why_not_of(velodyne_table(VelodyneModel::Vls128), *hdl).find("32 lasers, the model has 128"),
            std::string::npos);
  const auto far = read(calibration_of(VelodyneModel::Vlp16, 1.6)),
             near = read(calibration_of(VelodyneModel::Vlp16, 1.4));
  EXPECT_NE(why_not_of(velodyne_table(VelodyneModel::Vlp16), *far), "");
  EXPECT_EQ(why_not_of(velodyne_table(VelodyneModel::Vlp16), *near), "");
  const auto moved = read(calibration_of(VelodyneModel::Vlp16, 0, "horiz_offset_correction: 0.026"));
  EXPECT_NE(why_not_of(velodyne_table(VelodyneModel::Vlp16), *moved).find("not supported"), std::string::npos);
}

TEST(VelodyneAngles, WhatIsNoCalibrationIsRefused) {
  EXPECT_EQ(read("rig: street\nsensors:\n  - name: laser\n").error().code, ErrorCode::Unsupported);
  EXPECT_EQ(read("lasers: []\n").error().code, ErrorCode::Unsupported);
  EXPECT_EQ(read("lasers:\n- {laser_id: 0, vert_correction: many, rot_correction: 0}\n").error().code,
            ErrorCode::Malformed);
  EXPECT_EQ(read("lasers:\n- {laser_id: 1, vert_correction: 0, rot_correction: 0}\n").error().code,
            ErrorCode::Malformed);
  EXPECT_EQ(read("lasers:\n- {laser_id: 0, vert_correction: 0}\n").error().code, ErrorCode::Malformed);
  std::string many = "lasers:\n";
  for (int i = 0; i < 300; ++i) many += fmt::format("- {{laser_id: {}, vert_correction: 0, rot_correction: 0}}\n", i);
  EXPECT_EQ(read(many).error().code, ErrorCode::Malformed);
}

TEST(VelodyneAngles, OfTheRigPlaceThePoints) {
  VelodyneDecoder::Config config;
  for (const VelodyneLaser& laser : velodyne_table(config.model).lasers) {
    config.elevations_deg.push_back(laser.elevation_deg + 0.4);
    config.azimuths_deg.push_back(-0.3);
  }
  ASSERT_TRUE(config.validate().empty()) << config.validate().text();
  VelodyneDecoder decoder(config);
  test::VelodyneBlocksOfPacket blocks{};
  for (test::VelodyneBlock& block : blocks) {
    block.azimuth = 9000;
    for (auto& shot : block.shots) shot.distance = 5000;
  }
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(test::velodyne_data(blocks, 1000, 0x37, 0x22)), out);
  const auto batches = only<LaserBatch>(out);
  ASSERT_EQ(batches.size(), 1u);
  for (const LaserReturn& r : batches[0].returns) {
    const double elevation_deg = -15 + 2 * r.channel + 0.4;
    EXPECT_NEAR(r.z, 10 * std::sin(elevation_deg * kRadPerDeg), 0.012);  // the beams' origins lie up to 11.2 mm off
    EXPECT_NEAR(r.y, 10 * std::cos(elevation_deg * kRadPerDeg) * std::cos(89.7 * kRadPerDeg), 1e-4);
  }
  config.elevations_deg[3] += 1.2;
  EXPECT_NE(config.validate().text().find("channel 4 points to"), std::string::npos) << config.validate().text();
  config.azimuths_deg.clear();
  EXPECT_NE(config.validate().text().find("azimuths_deg is a list of 0"), std::string::npos);
}

}  // namespace
}  // namespace hueline::drivers
