#include "runtime/readiness.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "config/shipped.hpp"

namespace hueline::runtime {
namespace {

using testing::HasSubstr;

std::string text(const std::vector<Finding>& findings) {
  std::string out;
  for (const Finding& one : findings) out += one.about + ": " + one.text + "; " + one.action + "\n";
  return out;
}

class RigCheck : public testing::Test {
 protected:
  /// Expects one finding that prevents the drive, about this, with these words.
  void expect(const char* about, const char* words) const {
    const auto found = check_rig(rig_);
    ASSERT_EQ(found.size(), 1u) << text(found);
    EXPECT_TRUE(found[0].prevents);
    EXPECT_EQ(found[0].about, about);
    EXPECT_THAT(found[0].text, HasSubstr(words));
    EXPECT_FALSE(found[0].action.empty());
  }
  config::Rig rig_ = config::load_rig("street");
};

TEST_F(RigCheck, FindsNothingInTheShippedRigs) {
  for (const char* name : {"street", "hdl32e", "ladybug5", "ladybug5_jpeg", "ring8"})
    EXPECT_EQ(text(check_rig(config::load_rig(name))), "") << name;
}

TEST_F(RigCheck, FindsTwoCamerasAtOneAddress) {
  std::string yaml = rig_.text;
  const auto at = yaml.find("  - name: camera");
  std::string second = yaml.substr(at, yaml.find("head:") - at);
  second.replace(second.find("camera"), 6, "second");
  second.replace(second.find("HUE-0001"), 8, "HUE-0002");
  yaml.insert(yaml.find("head:"), second);
  rig_ = config::parse_rig(yaml, "rig");
  expect("second", "is reached by address 127.0.0.1, as is camera");
}

TEST_F(RigCheck, FindsTwoReceiversOfOnePort) {
  std::string yaml = rig_.text;
  yaml.insert(
      yaml.find("  - name: camera"),
      "  - {name: second, driver: velodyne, model: VLP-16, udp: {ports: [2368, 8308], bind_address: 127.0.0.1}, "
      "T_body_scanner: {position_m: [0, 0, 0], rotation_deg: [0, 0, 0]}}\n\n");
  rig_ = config::parse_rig(yaml, "rig");
  const auto found = check_rig(rig_);
  ASSERT_EQ(found.size(), 2u) << text(found);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_TRUE(found[i].prevents);
    EXPECT_EQ(found[i].about, "second");
    EXPECT_EQ(found[i].text,
              i == 0 ? "is heard at UDP port 2368, as is laser" : "is heard at UDP port 8308, as is laser");
  }
}

TEST_F(RigCheck, FindsAPortThatTwoReceiversShareWithOthersOfTheirOwn) {
  const std::string yaml = rig_.text;
  const auto with = [&](const std::string& udp) {
    std::string out = yaml;
    out.insert(out.find("  - name: camera"),
               "  - {name: second, driver: velodyne, model: VLP-16, udp: {" + udp +
                   "}, T_body_scanner: {position_m: [0, 0, 0], rotation_deg: [0, 0, 0]}}\n\n");
    return config::parse_rig(out, "rig");
  };
  // The first listens at 127.0.0.1:2368 and 8308.
  rig_ = with("ports: [8308, 2400], bind_address: 127.0.0.1");
  expect("second", "is heard at UDP port 8308, as is laser");
  rig_ = with("ports: [2400, 2368], source_address: 127.0.0.9");  // at all interfaces
  expect("second", "is heard at UDP port 2368, as is laser");
  EXPECT_EQ(text(check_rig(with("ports: [2368], bind_address: 127.0.0.2"))), "");
  EXPECT_EQ(text(check_rig(with("ports: [2400]"))), "");
}

TEST_F(RigCheck, TellsReceiversOfOneGroupApartByTheirSenders) {
  const auto two = [](const std::string& first, const std::string& second) {
    std::string out = "rig: r\nsensors:\n";
    for (const auto& [name, udp] : {std::pair("a", first), std::pair("b", second)})
      out += std::string("  - {name: ") + name + ", driver: velodyne, model: VLP-16, udp: {ports: [2368], " + udp +
             "}, T_body_scanner: {position_m: [0, 0, 0], rotation_deg: [0, 0, 0]}}\n";
    return text(check_rig(config::parse_rig(out + "colouring: {method: lens}\n", "rig")));
  };
  const std::string group = "multicast_group: 239.1.1.1";
  EXPECT_EQ(two(group + ", source_address: 10.0.0.1", group + ", source_address: 10.0.0.2"), "");
  EXPECT_THAT(two(group, group), HasSubstr("b: is heard at UDP port 2368, as is a"));
  EXPECT_THAT(two(group, "multicast_group: 239.1.1.2"), HasSubstr("name its sender"));
  EXPECT_THAT(two(group, "source_address: 10.0.0.2"), HasSubstr("b: is heard at UDP port 2368, as is a"));
}

TEST_F(RigCheck, FindsLensesOnOneRegion) {
  rig_.geometry.head.lenses[1].x_offset = 300;
  expect("lens1", "same region of the image as lens0");
}

TEST_F(RigCheck, FindsALensThatIsUpsideDown) {
  auto& rotation = rig_.geometry.head.lenses[2].T_head_lens.rotation;
  rotation = rotation * Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()));
  expect("lens2", "upside down");
}

TEST_F(RigCheck, FindsAFocalLengthThatCannotFit) {
  rig_.geometry.head.lenses[0].intrinsics.focal_px *= 0.0035;  // in mm instead of px
  expect("lens0", "focal length");
}

TEST_F(RigCheck, FindsMountingsBeyondTheVehicle) {
  rig_.geometry.lasers[0].T_body_scanner.translation *= 1000;  // in mm instead of m
  expect("laser", "beyond any vehicle");
}

TEST_F(RigCheck, FindsMarksThatNobodyAskedFor) {
  rig_.sync.cameras[0].mark_input = 2;
  expect("camera", "asked for the marks of input 1 only");
}

TEST_F(RigCheck, FindsAMapThatCannotBeMade) {
  rig_.map.crs = "EPSG:4326";
  expect("rig", "is not a projected CRS");
  EXPECT_EQ(check_map(rig_).error().code, ErrorCode::Invalid);
  rig_.map.crs = "EPSG:2056";
  expect("rig", "no GNSS service gives positions");
  rig_.map.datum = "EPSG:4937";  // of Switzerland: the place that was tried does not matter
  EXPECT_EQ(text(check_rig(rig_)), "");
  EXPECT_TRUE(check_map(rig_).ok());
}

TEST_F(RigCheck, FindsWhatTheComputerLacks) {
  HostFacts facts;
  facts.rmem_max = 33'554'432;
  facts.clock_source = "tsc";
  facts.free_bytes = 500'000'000'000;
  facts.disk_bytes_per_s = 200e6;
  facts.recorded_bytes_per_s = 10e6;
  facts.points_per_s = 300'000;
  EXPECT_EQ(text(check_host(rig_, facts, 4)), "");
  facts.rmem_max = 212'992;
  EXPECT_THAT(text(check_host(rig_, facts, 4)), HasSubstr("net.core.rmem_max is 212992: too small"));
  facts.rmem_max = -1;
  EXPECT_THAT(text(check_host(rig_, facts, 8)), HasSubstr("500.0 GB are free: 5.1 h at 27.4 MB/s, planned are 8.0 h"));
  facts.disk_bytes_per_s = 20e6;
  EXPECT_THAT(text(check_host(rig_, facts, 4)), HasSubstr("it takes 20 MB/s, and the drive needs 27 MB/s"));
  facts.disk_bytes_per_s = -1;
  facts.clock_source = "hpet";
  EXPECT_THAT(text(check_host(rig_, facts, 4)), HasSubstr("clock source is hpet"));
  facts.clock_source.clear();
  facts.has_guest = false;
  const auto found = check_host(rig_, facts, 4);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].prevents);
  facts.has_guest = true;
  facts.has_office = false;
  EXPECT_TRUE(check_host(rig_, facts, 4).empty());
  rig_.panoramas.emplace();
  EXPECT_THAT(text(check_host(rig_, facts, 4)), HasSubstr("no panoramas are made"));
}

}  // namespace
}  // namespace hueline::runtime
