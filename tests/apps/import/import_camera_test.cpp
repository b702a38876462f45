// Which images `hueline import` takes of a recording of ROS, with which lens and at which time.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "apps/import/camera_choice.hpp"
#include "apps/import/import_bag.hpp"
#include "config/rig.hpp"
#include "tests/rosbag/camera_message.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using apps::CameraTopic;
using apps::ImportedBag;
using apps::ImportOptions;
using test::CameraInfo;
using test::RosWriter;
using test::SampleMessage;

constexpr std::int64_t kBegin_ns = 1'700'000'000'000'000'000;

SampleMessage image(const std::string& topic, std::int64_t stamp_ns, const std::string& encoding = "rgb8",
                    std::int64_t recorded_ns = kBegin_ns) {
  const std::uint32_t pixel = encoding == "mono8" ? 1 : encoding == "32FC1" ? 4 : 3;
  RosWriter out(drivers::RosEncoding::Cdr);
  out.header(stamp_ns, "camera").put(std::uint32_t{8}).put(std::uint32_t{16}).text(encoding).put(std::uint8_t{0});
  return {topic, "sensor_msgs/Image", recorded_ns,
          out.put(16 * pixel).sequence(std::string(std::size_t{128} * pixel, 'x')).bytes()};
}
SampleMessage info(const std::string& topic, CameraInfo one = {}) {
  one.width = 16, one.height = 8;
  return {topic, "sensor_msgs/CameraInfo", kBegin_ns,
          test::camera_info(drivers::RosEncoding::Cdr, kBegin_ns, one).bytes()};
}

class ImportCamera : public ::testing::Test {
 protected:
  Result<ImportedBag> import(const std::vector<SampleMessage>& messages, ImportOptions options = {}) const {
    test::write_mcap(folder_ / "made.mcap", messages, storage::Compression::None);
    options.bag = folder_ / "made.mcap";
    options.out = folder_ / "drive";
    return apps::import_bag(options);
  }
  std::string rig() const {
    std::ifstream in(folder_ / "drive/rig.yaml");
    return {std::istreambuf_iterator<char>(in), {}};
  }
  bool rig_has(const std::string& text) const { return rig().find(text) != std::string::npos; }

  test::TemporaryFolder folder_;
};

TEST_F(ImportCamera, OfTopicsInOneFrameOneIsTheCamera) {
  const std::vector<SampleMessage> messages{image("/left/a_mono", kBegin_ns, "mono8"),
                                            image("/left/image_raw", kBegin_ns), image("/left/image_rect", kBegin_ns),
                                            info("/left/camera_info")};
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/left/image_raw"), "sensor left_image_raw: 16 x 8, RGB3");
  EXPECT_EQ(done->became.at("/left/camera_info"), "the lens of left_image_raw");
  for (const std::string topic : {"/left/a_mono", "/left/image_rect"})
    EXPECT_EQ(done->became.at(topic),
              "not used: /left/image_raw is of the same camera, in the frame camera; if they are of two cameras, name "
              "both with --images");
  EXPECT_FALSE(rig_has("a_mono"));

  const auto named = import(messages, {.images = {"/left/a_mono"}});
  ASSERT_TRUE(named.ok()) << named.error().message;
  EXPECT_EQ(named->became.at("/left/a_mono"), "sensor left_a_mono: 16 x 8, GREY");
  EXPECT_EQ(named->became.at("/left/image_raw"), "not used: --images does not name it");
  const auto wrong = import(messages, {.images = {"/left/image"}});
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::Invalid);
  EXPECT_EQ(wrong.error().message, "--images /left/image: the recording has no images of that topic");
}

TEST(CameraChoice, PrefersWhatGivesTheBestColours) {
  const CameraTopic colour{
      .format = "RGB3", .frame = "a", .width = 640, .height = 480, .images = 100, .has_lens = true};
  const auto chosen = [&](const std::string& name, const CameraTopic& other) {
    const auto done = apps::choose_cameras({{"/a/image", colour}, {name, other}}, {});
    return done.ok() && done->topics.size() == 1 ? done->topics[0] : "two";
  };
  CameraTopic one = colour;
  EXPECT_EQ(chosen("/a/z", one), "/a/image") << "of equal ones the first by name";
  EXPECT_EQ(chosen("/a/z_raw", one), "/a/z_raw");
  EXPECT_EQ(chosen("/a/a_rect", one), "/a/image");
  one.is_compressed = true;
  EXPECT_EQ(chosen("/a/a", one), "/a/image");
  one.width = 1280;
  EXPECT_EQ(chosen("/a/z_rect", one), "/a/z_rect");
  one.images = 49;
  EXPECT_EQ(chosen("/a/a", one), "/a/image") << "most of the moments have no image";
  one.images = 50;
  EXPECT_EQ(chosen("/a/a", one), "/a/a");
  one.has_lens = false;
  EXPECT_EQ(chosen("/a/a", one), "/a/image");
  one = colour;
  one.frame = "b";
  EXPECT_EQ(chosen("/b/image", one), "two");
  one.is_grey = true;
  EXPECT_EQ(chosen("/b/image", one), "/a/image") << "a grey camera would leave points without colours";
  one.frame = "";
  one.is_grey = false;
  EXPECT_EQ(chosen("/b/image", one), "two");
}

TEST(CameraChoice, WithoutFramesTheFoldersOfTopicsAreCameras) {
  const CameraTopic raw{.width = 640, .height = 480, .images = 9};
  CameraTopic jpeg = raw;
  jpeg.is_compressed = true;
  const auto done = apps::choose_cameras(
      {{"/a/image_raw", raw}, {"/a/image_raw/compressed", jpeg}, {"/b/image_raw/compressed", jpeg}}, {});
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->topics, (std::vector<std::string>{"/a/image_raw", "/b/image_raw/compressed"}));
}

TEST_F(ImportCamera, SaysThatNothingWillBeColoured) {
  const std::vector<SampleMessage> pose{[] {
    RosWriter out(drivers::RosEncoding::Cdr);
    out.header(kBegin_ns, "imu").sequence("raw");
    return SampleMessage{"/oem7raw", "novatel_oem7_msgs/Oem7RawMsg", kBegin_ns, out.bytes()};
  }()};
  auto with_depths = pose;
  with_depths.push_back(image("/depth/image_raw", kBegin_ns, "32FC1"));
  with_depths.push_back(info("/depth/camera_info"));
  const auto depths = import(with_depths);
  ASSERT_TRUE(depths.ok()) << depths.error().message;
  EXPECT_EQ(depths->became.at("/depth/camera_info"), "not used: no images of its camera are used");
  ASSERT_FALSE(depths->to_do.empty());
  EXPECT_EQ(depths->to_do.back(), "no images can be used, see the table: a replay colours no points");
  const auto nothing = import(pose);
  ASSERT_TRUE(nothing.ok());
  EXPECT_EQ(nothing->to_do.back(), "the recording has no images: a replay colours no points");
}

TEST_F(ImportCamera, AnUncalibratedCameraIsTold) {
  CameraInfo uncalibrated;
  uncalibrated.cx = std::nan("");
  const auto done = import({image("/left/image_raw", kBegin_ns), info("/left/camera_info", uncalibrated)});
  ASSERT_TRUE(done.ok()) << done.error().message;
  ASSERT_TRUE(done->made.ok()) << done->made.error().message;
  EXPECT_EQ(done->to_do.at(1),
            "the lens of left_image_raw: its CameraInfo is not used: some of its values are no numbers");
  EXPECT_TRUE(rig_has("NOT KNOWN: its CameraInfo is not used")) << rig();
  const config::Rig made = config::parse_rig(rig(), "rig.yaml");
  ASSERT_FALSE(made.not_known.empty()) << "a replay says it";
  EXPECT_EQ(made.not_known.front(), done->to_do.at(1));
}

TEST_F(ImportCamera, TheLensOfAnotherFrameIsNotTheCameras) {
  CameraInfo infrared;
  infrared.frame = "infrared";
  const auto done = import({image("/left/image_raw", kBegin_ns), info("/left/ir_info", infrared)});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/left/ir_info"), "not used: no images of its camera are used");
  EXPECT_EQ(done->to_do.at(1), "the lens of left_image_raw: no CameraInfo is of the frame \"camera\" of its images");
}

TEST_F(ImportCamera, StampsOfAnotherClockAreMoved) {
  constexpr std::int64_t kHour_ns = 3'600'000'000'000;
  const auto done =
      import({image("/left/image_raw", kBegin_ns + kHour_ns, "rgb8", kBegin_ns + 30'000'000),
              image("/left/image_raw", kBegin_ns + kHour_ns + 100'000'000, "rgb8", kBegin_ns + 140'000'000)});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->to_do.at(1),
            "left_image_raw: its stamps are -3599.970 s from the recorder's times, so they are of another clock. The "
            "shortest of these delays is taken for the difference of the clocks: the images are late by the part of it "
            "that the way to the recorder took");
}

/// The solution of a receiver at kBegin_ns, which is second 252818 of week 2288.
SampleMessage solution(std::int64_t recorded_ns) {
  RosWriter out(drivers::RosEncoding::Cdr);
  out.header(kBegin_ns, "ins").text("INSPVAX").put(std::uint16_t{1465}).put(std::uint8_t{0}).put(std::uint32_t{0});
  out.put(std::uint8_t{180}).put(std::uint16_t{2288}).put(std::uint32_t{252'818'000});
  out.put(std::uint32_t{3}).put(std::uint32_t{56});
  for (int i = 0; i < 3; ++i) out.put(1.0);
  out.put(0.0f);
  for (int i = 0; i < 6; ++i) out.put(0.0);
  for (int i = 0; i < 9; ++i) out.put(0.1f);
  return {"/inspvax", "novatel_oem7_msgs/INSPVAX", recorded_ns, out.bytes()};
}

TEST_F(ImportCamera, ARecordingThatWasRecordedAgainKeepsItsStamps) {
  constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  const auto again =
      import({solution(kBegin_ns + kDay_ns), image("/left/image_raw", kBegin_ns, "rgb8", kBegin_ns + kDay_ns)});
  ASSERT_TRUE(again.ok()) << again.error().message;
  for (const std::string& one : again->to_do) EXPECT_EQ(one.find("another clock"), std::string::npos) << one;
  // Before its fix the receiver was a minute ahead; it is on the recorder's clock all the same.
  const auto late_fix =
      import({solution(kBegin_ns - 60'000'000'000), solution(kBegin_ns), image("/left/image_raw", kBegin_ns)});
  ASSERT_TRUE(late_fix.ok()) << late_fix.error().message;
  for (const std::string& one : late_fix->to_do) EXPECT_EQ(one.find("another clock"), std::string::npos) << one;
  const auto apart = import({solution(kBegin_ns), image("/left/image_raw", kBegin_ns + kDay_ns)});
  ASSERT_TRUE(apart.ok()) << apart.error().message;
  EXPECT_NE(apart->to_do.at(0).find("its stamps are -86400.000 s from the recorder's times"), std::string::npos)
      << apart->to_do.at(0);
}

TEST_F(ImportCamera, ImagesWithoutAStampAreCounted) {
  const auto done = import({image("/left/image_raw", 0), image("/left/image_raw", kBegin_ns - 1'000'000)});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/left/image_raw"),
            "sensor left_image_raw: 16 x 8, RGB3; 1 without a stamp get the recorder's time");
}

}  // namespace
}  // namespace hueline
