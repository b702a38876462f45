// What `hueline import` takes of recordings of ROS, and what it says of what it does not take.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "apps/import/import_bag.hpp"
#include "apps/import/pose_choice.hpp"
#include "apps/inspect/inspect.hpp"
#include "storage/compression.hpp"
#include "storage/journal_reader.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"
#include "tests/rosbag/cloud_message.hpp"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using apps::ImportedBag;
using apps::ImportOptions;
using apps::PoseTopic;
using test::RosWriter;
using test::SampleMessage;

constexpr std::int64_t kImported_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kTenth_ns = 100'000'000;
constexpr Geodetic kOrigin{0.8, 0.2, 500};

SampleMessage odometry_message(const std::string& topic, std::int64_t ns, double north, double east = 0) {
  RosWriter out(drivers::RosEncoding::Cdr);
  out.header(ns, "odom").text("base_link").put(east).put(north).put(0.0);
  out.put(0.0).put(0.0).put(0.0).put(1.0);
  return {topic, "nav_msgs/Odometry", ns, out.bytes()};
}
SampleMessage imu_message(const std::string& topic, std::int64_t ns, double covariance = 0) {
  RosWriter out(drivers::RosEncoding::Cdr);
  out.header(ns, "imu").put(0.0).put(0.0).put(0.0).put(1.0).put(covariance);
  return {topic, "sensor_msgs/Imu", ns, out.bytes()};
}

SampleMessage position(const std::string& topic, std::int64_t ns, double variance = 0) {
  RosWriter out(drivers::RosEncoding::Cdr);
  out.header(ns, "gps").put(std::int8_t{0}).put(std::uint16_t{1}).put(48.0).put(11.0).put(500.0);
  for (int i = 0; i < 9; ++i) out.put(i % 4 == 0 ? variance : 0.0);
  return {topic, "sensor_msgs/NavSatFix", ns, out.put(std::uint8_t{2}).bytes()};
}

SampleMessage cloud_message(const std::string& topic, std::int64_t ns) {
  test::CloudMessage cloud;
  cloud.stamp_ns = ns;
  cloud.fields = {{"x", 0, test::kF32}, {"y", 4, test::kF32}, {"z", 8, test::kF32}, {"time", 12, test::kF32}};
  cloud.width = 2, cloud.point_step = 16;
  for (const float time : {0.f, 0.09f}) cloud.put(3.f).put(4.f).put(0.f).put(time);
  return {topic, "sensor_msgs/PointCloud2", ns, cloud.bytes(drivers::RosEncoding::Cdr)};
}

int count_told(const ImportedBag& done, const std::string& what) {
  return static_cast<int>(
      std::ranges::count_if(done.to_do, [&](const std::string& one) { return one.find(what) != std::string::npos; }));
}

/// A recording in a folder that passes, and the drive that is made of it.
class ImportBag : public ::testing::Test {
 protected:
  Result<ImportedBag> import(const std::vector<SampleMessage>& messages, ImportOptions options = {}) const {
    test::write_mcap(folder_ / "made.mcap", messages, storage::Compression::None);
    options.bag = folder_ / "made.mcap";
    options.out = folder_ / "drive";
    return apps::import_bag(options);
  }
  /// Returns what `hueline inspect` says of the drive's pose.
  nlohmann::ordered_json pose() const {
    const auto seen = apps::inspect_file(folder_ / "drive/drive.mcap");
    for (const auto& one : seen.found->at("sensors"))
      if (one.at("name") == "pos") return one;
    return {};
  }

  test::TemporaryFolder folder_;
};

/// Two ways of the vehicle, 500 m apart; /odom/wheel has a message more.
std::vector<SampleMessage> two_ways() {
  std::vector<SampleMessage> out;
  for (int i = 0; i < 20; ++i) {
    if (i > 0)
      out.push_back(odometry_message("/odom/filtered", kImported_ns + i * kTenth_ns - 1'000'000, 500 + 0.1 * i));
    out.push_back(odometry_message("/odom/wheel", kImported_ns + i * kTenth_ns, 0.1 * i));
  }
  return out;
}
double metres_of_latitudes(const nlohmann::ordered_json& pose) {
  const auto& range = pose.at("latitude_deg");
  return (range.at(1).get<double>() - range.at(0).get<double>()) * 111'200;
}

TEST_F(ImportBag, CloudsThatAreCompressedAreTakenAsTheyAre) {
  const auto packed = [](const std::string& topic, std::int64_t ns, const std::string& format) {
    const SampleMessage plain = cloud_message(topic, ns);
    const std::string points = plain.bytes.substr(plain.bytes.size() - 1 - 2 * 16, 2 * 16);
    storage::Bytes zstd;
    const storage::ByteView pieces[]{storage::as_bytes(points)};
    EXPECT_TRUE(storage::compress(storage::Compression::Zstd, pieces, zstd).ok());
    RosWriter out(drivers::RosEncoding::Cdr);
    out.raw(plain.bytes.substr(4, plain.bytes.size() - 4 - 1 - 2 * 16 - 4));  // as far as the length of the points
    out.sequence({reinterpret_cast<const char*>(zstd.data()), zstd.size()}).put(std::uint8_t{1}).text(format);
    return SampleMessage{topic, "point_cloud_interfaces/CompressedPointCloud2", ns, out.bytes()};
  };
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 5; ++i) {
    messages.push_back(packed("/points/zstd", kImported_ns + i * kTenth_ns, "zstd"));
    messages.push_back(packed("/points/draco", kImported_ns + i * kTenth_ns, "draco"));
  }
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/points/zstd"), "sensor points_zstd: times of the points: time, s after header.stamp");
  EXPECT_TRUE(done->became.at("/points/draco").starts_with("not used: its points are compressed as draco"));
  EXPECT_EQ(done->packets, 5u);
  const std::string rig = test::contents(folder_ / "drive/rig.yaml");
  EXPECT_NE(rig.find("message: compressed_point_cloud2\n"), std::string::npos) << rig;
}

/// The metadata of an Ouster stand behind its packets, by the order of the topics and in the file.
TEST_F(ImportBag, AnOusterBeginsWithItsMetadata) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 64; ++i) {
    test::OusterPacket packet;
    packet.first_column = 16 * i;
    packet.time_ns += static_cast<std::uint64_t>(i) * 1'600'000;
    packet.pixel = test::pixel_single(10'000, 50);
    const auto bytes = test::ouster_bytes(packet);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    messages.push_back({"/a/lidar_packets", "ouster_ros/PacketMsg", kImported_ns + i * 1'600'000,
                        RosWriter(drivers::RosEncoding::Cdr).sequence(text).bytes()});
  }
  messages.push_back({"/a/metadata", "std_msgs/String", kImported_ns,
                      RosWriter(drivers::RosEncoding::Cdr).text(test::ouster_metadata()).bytes()});
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_TRUE(done->became.at("/a/lidar_packets").starts_with("sensor a_lidar_packets: ouster OS-1-16"))
      << done->became.at("/a/lidar_packets");
  EXPECT_EQ(done->packets, 65u);
  auto journal = storage::JournalReader::open(folder_ / "drive/drive.mcap");
  ASSERT_TRUE(journal.ok());
  const auto first = (*journal)->next({});
  ASSERT_TRUE(first.ok());
  EXPECT_NE(
      std::string(reinterpret_cast<const char*>(first->bytes.data()), first->bytes.size()).find("beam_intrinsics"),
      std::string::npos);
}

TEST_F(ImportBag, OfTwoTopicsOfOneKindOneIsThePose) {
  const auto done = import(two_ways(), {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odom/wheel"), "sensor pos");
  EXPECT_EQ(done->became.at("/odom/filtered"),
            "not used: the pose is that of /odom/wheel, with 20 messages that can be used, of 19 here; --poses "
            "/odom/filtered takes this");
  EXPECT_LT(metres_of_latitudes(pose()), 3);
}

/// What waits in a queue is stamped when it is taken: the way between two such poses over their time is no velocity.
TEST_F(ImportBag, OfPosesThatWereStampedTogetherTheFirstIsUsed) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i) {
    messages.push_back(odometry_message("/odom", kImported_ns + i * kTenth_ns, 0.1 * i));
    if (i % 4 == 0) messages.push_back(odometry_message("/odom", kImported_ns + i * kTenth_ns + 5'000, 0.1 * i + 0.05));
  }
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odom"),
            "sensor pos; 5 messages are less than 0.5 ms behind another, as those that were stamped when they were "
            "taken from a queue: the first of them is used");
  EXPECT_EQ(done->packets, 20u);
}

TEST_F(ImportBag, PosesNamesTheTopicOfThePose) {
  const auto done = import(two_ways(), {.origin = kOrigin, .poses = {"/odom/filtered"}});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odom/filtered"), "sensor pos");
  EXPECT_LT(metres_of_latitudes(pose()), 3);
  const auto twice = import(two_ways(), {.origin = kOrigin, .poses = {"/odom/filtered", "/odom/wheel"}});
  ASSERT_FALSE(twice.ok());
  EXPECT_EQ(twice.error().code, ErrorCode::Invalid);
  EXPECT_EQ(twice.error().message, "--poses /odom/wheel: /odom/filtered says the same; name one of them");
  const auto nothing = import(two_ways(), {.origin = kOrigin, .poses = {"/odom"}});
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().message, "--poses /odom: the recording has no poses of that topic");
  const auto no_origin = import(two_ways(), {.poses = {"/odom/wheel"}});
  ASSERT_FALSE(no_origin.ok());
  EXPECT_EQ(no_origin.error().message,
            "--poses /odom/wheel: its metres need an origin or a map, see --origin and --map");
}

TEST(PoseChoice, CountsTheMessagesThatCanBeUsed) {
  const std::map<std::string, PoseTopic> found{{"/camera/imu", {"sensor_msgs/Imu", "camera", 0}},
                                               {"/fix", {"sensor_msgs/NavSatFix", "gps", 10}},
                                               {"/imu/data", {"sensor_msgs/Imu", "base", 100}},
                                               {"/imu/other", {"sensor_msgs/Imu", "other", 100}}};
  const auto chosen = apps::choose_pose(found, false, {});
  ASSERT_TRUE(chosen.ok());
  EXPECT_EQ(chosen->rank, drivers::RosPoseRank::Part);
  EXPECT_EQ(chosen->topics, (std::vector<std::string>{"/fix", "/imu/data"})) << "of equal ones the first by name";
  EXPECT_EQ(chosen->frame, "base");
  EXPECT_EQ(chosen->not_used.at("/camera/imu"), "no message of it says an orientation");
  const auto other = apps::choose_pose(found, false, {"/imu/other"});
  ASSERT_TRUE(other.ok());
  EXPECT_EQ(other->topics, (std::vector<std::string>{"/fix", "/imu/other"}));
  EXPECT_EQ(other->frame, "other");
}

TEST(PoseChoice, OfEqualSolutionsTakesThatWithSigmas) {
  const std::map<std::string, PoseTopic> found{{"/inspva", {"novatel_oem7_msgs/INSPVA", "ins", 100}},
                                               {"/inspvax", {"novatel_oem7_msgs/INSPVAX", "ins", 100}},
                                               {"/odom", {"nav_msgs/Odometry", "base", 1000}}};
  const auto chosen = apps::choose_pose(found, true, {});
  ASSERT_TRUE(chosen.ok());
  EXPECT_EQ(chosen->topics, (std::vector<std::string>{"/inspvax"}));
  EXPECT_EQ(chosen->not_used.at("/odom"), "the pose is that of /inspvax; --poses /odom takes this");
  const auto wanted = apps::choose_pose(found, true, {"/odom"});
  ASSERT_TRUE(wanted.ok());
  EXPECT_EQ(wanted->rank, drivers::RosPoseRank::Local);
  EXPECT_FALSE(apps::choose_pose(found, true, {"/odom", "/inspva"}).ok()) << "these are two poses";
}

TEST(PoseChoice, SaysWhatTheOtherHalfOfAPoseIs) {
  const auto halves = apps::choose_pose({{"/imu", {"sensor_msgs/Imu", "imu", 5}}}, false, {});
  ASSERT_TRUE(halves.ok());
  EXPECT_EQ(halves->rank, drivers::RosPoseRank::None);
  EXPECT_EQ(halves->not_used.at("/imu"), "its orientations need the positions of a sensor_msgs/NavSatFix");
}

/// A receiver whose sigmas are messages of their own.
TEST(PoseChoice, TakesTheSigmasOfSolutionsThatStateNone) {
  std::map<std::string, PoseTopic> found{{"/insstdev", {"novatel_oem7_msgs/INSSTDEV", "ins", 10}},
                                         {"/inspva", {"novatel_oem7_msgs/INSPVA", "ins", 100}}};
  const auto both = apps::choose_pose(found, false, {});
  ASSERT_TRUE(both.ok());
  EXPECT_EQ(both->topics, (std::vector<std::string>{"/inspva", "/insstdev"}));
  EXPECT_EQ(both->rank, drivers::RosPoseRank::Solution);
  found["/inspvax"] = {"novatel_oem7_msgs/INSPVAX", "ins", 100};
  const auto extended = apps::choose_pose(found, false, {});
  ASSERT_TRUE(extended.ok());
  EXPECT_EQ(extended->topics, (std::vector<std::string>{"/inspvax"}));
  EXPECT_EQ(extended->not_used.at("/insstdev"), "the solutions of /inspvax state their own sigmas");
  EXPECT_EQ(apps::choose_pose(found, false, {"/inspva"})->topics, both->topics);
  const auto alone = apps::choose_pose({{"/insstdev", found.at("/insstdev")}}, false, {});
  ASSERT_TRUE(alone.ok());
  EXPECT_EQ(alone->rank, drivers::RosPoseRank::None);
  EXPECT_EQ(alone->not_used.at("/insstdev"), "its sigmas need the solutions of INSPVA");
}

/// A NavSatFix, and an Odometry in coordinates of a map that nobody has named.
TEST_F(ImportBag, PositionsGetTheOrientationsOfAnOdometry) {
  std::vector<SampleMessage> messages;
  const auto add = [&](double half_yaw, bool has_imu) {
    messages.clear();
    for (int i = 0; i < 40; ++i) {
      const std::int64_t ns = kImported_ns + i * kTenth_ns;
      RosWriter out(drivers::RosEncoding::Cdr);
      out.header(ns, "utm").text("car").put(5e5).put(5.3e6).put(500.0).put(0.0).put(0.0);
      messages.push_back(
          {"/odom", "nav_msgs/Odometry", ns, out.put(std::sin(half_yaw)).put(std::cos(half_yaw)).bytes()});
      messages.push_back(position("/fix", ns + 50'000'000));
      if (has_imu) messages.push_back(imu_message("/imu", ns));
    }
  };
  add(0.5, false);
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odom"),
            "sensor pos; 1 orientations are not between two positions that are at most 3 s apart");
  EXPECT_EQ(done->became.at("/fix"), "sensor pos");
  EXPECT_EQ(count_told(*done, "that of /odom is taken for the one to east, north and up"), 1);
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 39);
  EXPECT_NEAR(pose().at("latitude_deg").at(0).get<double>(), 48, 1e-9);
  // An odometry that never turns knows no orientation, and an Imu is taken before any.
  add(0, false);
  const auto unturned = import(messages);
  ASSERT_TRUE(unturned.ok());
  EXPECT_EQ(unturned->became.at("/fix"),
            "not used: its positions need the orientations of a sensor_msgs/Imu or a nav_msgs/Odometry");
  add(0.5, true);
  const auto with_imu = import(messages);
  ASSERT_TRUE(with_imu.ok());
  EXPECT_TRUE(with_imu->became.at("/imu").starts_with("sensor pos")) << with_imu->became.at("/imu");
  EXPECT_TRUE(with_imu->became.at("/odom").starts_with("not used: ")) << with_imu->became.at("/odom");
  const auto named = import(messages, {.poses = {"/fix", "/odom"}});
  ASSERT_TRUE(named.ok()) << named.error().message;
  EXPECT_TRUE(named->became.at("/odom").starts_with("sensor pos")) << named->became.at("/odom");
}

/// A pose to go to comes more often than the odometry, and its stamps are 0: the recorder's time counts, which is of
/// another clock where a recording was played and recorded again.
TEST_F(ImportBag, OrientationsAreOfTheClockOfThePositions) {
  constexpr std::int64_t kAgo_ns = 5'000'000'000'000'000;
  const auto turned = [](const std::string& topic, const char* type, std::int64_t stamp, std::int64_t received) {
    RosWriter out(drivers::RosEncoding::Cdr);
    out.header(stamp, "odom");
    if (type == std::string("nav_msgs/Odometry")) out.text("car");
    out.put(1.0).put(2.0).put(0.0).put(0.0).put(0.0).put(std::sin(0.5)).put(std::cos(0.5));
    return SampleMessage{topic, type, received, out.bytes()};
  };
  std::vector<SampleMessage> messages, goals;
  for (int i = 0; i < 40; ++i) {
    const std::int64_t ns = kImported_ns + i * kTenth_ns;
    goals.push_back(turned("/goal", "geometry_msgs/PoseStamped", 0, ns));
    if (i % 2 != 0) goals.push_back(turned("/goal", "geometry_msgs/PoseStamped", 0, ns + 1'000'000));
    auto fix = position("/fix", ns - kAgo_ns);
    fix.time_ns = ns;
    goals.push_back(fix);
    messages.push_back(turned("/odom", "nav_msgs/Odometry", ns - kAgo_ns, ns));
  }
  const auto alone = import(goals);
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  EXPECT_EQ(count_told(*alone, "the times of /fix are from "), 1);
  EXPECT_EQ(count_told(*alone, "they do not meet, as stamps of different clocks"), 1);
  messages.insert(messages.end(), goals.begin(), goals.end());
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_TRUE(done->became.at("/odom").starts_with("sensor pos")) << done->became.at("/odom");
  EXPECT_TRUE(done->became.at("/goal").starts_with("not used")) << done->became.at("/goal");
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 40);
}

/// A recorder whose clock is behind, and a link that stands for 8 s.
TEST_F(ImportBag, LateMessagesToARecorderWhoseClockIsBehindAreOfOneClock) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t ns = kImported_ns + i * kTenth_ns;
    messages.push_back(odometry_message("/odom", ns, 0.1 * i));
    messages.back().time_ns = (i < 10 || i > 90 ? ns : kImported_ns + 90 * kTenth_ns) - 80'000'000'000;
    messages.push_back(cloud_message("/points", ns));
    messages.back().time_ns = ns + 100'000'000 - 80'000'000'000;
  }
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(count_told(*done, "so they are of another clock"), 0);
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 100);
}

/// A program that shows the way so far has all poses in each message, and says of none that it is the vehicle's.
TEST_F(ImportBag, OfSeveralPosesInOneMessageNoneIsTheVehicles) {
  const auto with = [&](std::uint32_t poses) {
    std::vector<SampleMessage> messages;
    for (int i = 0; i < 20; ++i) {
      RosWriter out(drivers::RosEncoding::Cdr);
      out.header(kImported_ns + i * kTenth_ns, "map").put(poses);
      for (std::uint32_t k = 0; k < poses; ++k) out.put(0.1 * i).put(0.0).put(0.0).put(0.0).put(0.0).put(0.0).put(1.0);
      messages.push_back({"/poses", "geometry_msgs/PoseArray", kImported_ns + i * kTenth_ns, out.bytes()});
    }
    const auto done = import(messages, {.origin = kOrigin});
    EXPECT_TRUE(done.ok());
    return done->became.at("/poses");
  };
  EXPECT_EQ(with(1), "sensor pos");
  EXPECT_EQ(with(2), "not used: its messages have several poses, or none, and do not say which is the vehicle's");
  EXPECT_EQ(with(0), with(2));
}

TEST_F(ImportBag, AnImuWithoutOrientationIsNotThePose) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 5; ++i) messages.push_back(imu_message("/imu", kImported_ns + i * kTenth_ns, -1));
  messages.push_back(odometry_message("/odom", kImported_ns, 0));
  messages.push_back(odometry_message("/odom", kImported_ns + kTenth_ns, 1));
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/imu"), "not used: no message of it says an orientation");
}

TEST_F(ImportBag, ReceiversThatDoNotKnowTheirPlaceSayNone) {
  std::vector<SampleMessage> messages;
  const auto fix = [&](int i, int status, double latitude, double longitude) {
    RosWriter out(drivers::RosEncoding::Cdr);
    out.header(kImported_ns + i * kTenth_ns, "gps").put(static_cast<std::int8_t>(status)).put(std::uint16_t{1});
    out.put(latitude).put(longitude).put(500.0);
    for (int k = 0; k < 9; ++k) out.put(0.0);
    messages.push_back(
        {"/fix", "sensor_msgs/NavSatFix", kImported_ns + i * kTenth_ns, out.put(std::uint8_t{0}).bytes()});
    messages.push_back(imu_message("/imu", kImported_ns + i * kTenth_ns));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  fix(0, -1, 48, 11), fix(1, 0, 0, 0), fix(2, 0, nan, nan), fix(3, -1, 0, 0);
  for (int i = 4; i < 20; ++i) fix(i, 0, 48, 11);
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/fix"), "sensor pos; 4 positions are without a fix");
  for (const auto& topic : done->topics) EXPECT_EQ(topic.broken, 0u) << topic.topic.name;
  EXPECT_LT(metres_of_latitudes(pose()), 0.01);
}

TEST_F(ImportBag, CloudsOfFramesThatStandAreMaps) {
  std::vector<SampleMessage> messages;
  const auto cloud = [&](const std::string& topic, const std::string& frame, std::int64_t ns) {
    test::CloudMessage made;
    made.stamp_ns = ns;
    made.frame = frame;
    made.fields = {{"x", 0, test::kF32}, {"y", 4, test::kF32}, {"z", 8, test::kF32}, {"time", 12, test::kF32}};
    made.width = 2, made.point_step = 16;
    for (const float time : {0.f, 0.09f}) made.put(3.f).put(4.f).put(0.f).put(time);
    messages.push_back({topic, "sensor_msgs/PointCloud2", ns, made.bytes(drivers::RosEncoding::Cdr)});
  };
  for (int i = 0; i < 20; ++i) {
    const std::int64_t ns = kImported_ns + i * kTenth_ns;
    RosWriter out(drivers::RosEncoding::Cdr);
    out.header(ns, "start").text("laser").put(0.0).put(0.1 * i).put(0.0).put(0.0).put(0.0).put(0.0).put(1.0);
    messages.push_back({"/odometry", "nav_msgs/Odometry", ns, out.bytes()});
    cloud("/points", "laser", ns);
    cloud("/registered", "start", ns);
    cloud("/whole", "car1/global_map", ns);
  }
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/registered"),
            "not used: its frame start does not move with the vehicle, so it is a map and no measurement");
  EXPECT_EQ(done->became.at("/whole"),
            "not used: its frame car1/global_map does not move with the vehicle, so it is a map and no measurement");
  EXPECT_TRUE(done->became.at("/points").starts_with("sensor points: ")) << done->became.at("/points");
}

TEST_F(ImportBag, UsesOrientationsThatStandBehindALaterPosition) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i <= 30; ++i) {
    if (i % 10 == 0) messages.push_back(position("/fix", kImported_ns + i * kTenth_ns));
    // That of the moment before the position stands behind it.
    SampleMessage one = imu_message("/imu", kImported_ns + i * kTenth_ns - 1'000'000);
    one.time_ns = kImported_ns + i * kTenth_ns + 35'000'000;
    messages.push_back(one);
  }
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 30);
  EXPECT_EQ(done->became.at("/imu"),
            "sensor pos; 1 orientations are not between two positions that are at most 3 s apart");
}

TEST_F(ImportBag, TheBodyIsBaseLinkAlsoBehindTheVehiclesName) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i) {
    messages.push_back(odometry_message("/odom", kImported_ns + i * kTenth_ns, 0.1 * i));
    messages.push_back(cloud_message("/points", kImported_ns + i * kTenth_ns));
  }
  const auto rig_of = [&](const std::string& parent) {
    RosWriter tree(drivers::RosEncoding::Cdr);
    tree.put(std::uint32_t{1}).header(kImported_ns, parent).text("laser").put(1.0).put(0.0).put(2.0);
    tree.put(0.0).put(0.0).put(0.0).put(1.0);
    auto all = messages;
    all.push_back({"/tf_static", "tf2_msgs/TFMessage", kImported_ns, tree.bytes()});
    EXPECT_TRUE(import(all, {.origin = kOrigin}).ok());
    return test::contents(folder_ / "drive/rig.yaml");
  };
  // 1 m before and 2 m above it; ROS's x is the body's y.
  EXPECT_NE(rig_of("car1/base_link")
                .find("position_m: [0.000000, 1.000000, 2.000000], quaternion_wxyz: [0.707106781, 0.000000000, "
                      "0.000000000, 0.707106781]}  # laser in car1/base_link"),
            std::string::npos);
  // Where nobody knows it, the scanner looks forward.
  EXPECT_NE(rig_of("car1/mast")
                .find("position_m: [0.000000, 0.000000, 0.000000], quaternion_wxyz: [0.707106781, "
                      "0.000000000, 0.000000000, 0.707106781]}  # NOT KNOWN"),
            std::string::npos);
}

SampleMessage transform_message(const std::string& parent, const std::string& child, std::int64_t ns, double north) {
  RosWriter out(drivers::RosEncoding::Cdr);
  out.put(std::uint32_t{1}).header(ns, parent).text(child).put(0.0).put(north).put(0.0);
  out.put(0.0).put(0.0).put(0.0).put(1.0);
  return {"/tf", "tf2_msgs/TFMessage", ns, out.bytes()};
}
SampleMessage stamped_pose(const std::string& topic, const std::string& frame, std::int64_t ns, double north) {
  RosWriter out(drivers::RosEncoding::Cdr);
  out.header(ns, frame).put(0.0).put(north).put(0.0).put(0.0).put(0.0).put(0.0).put(1.0);
  return {topic, "geometry_msgs/PoseStamped", ns, out.bytes()};
}

/// As recordings of public data sets hold it: the pose is a transform of the tree, and a pose of the vehicle in its own
/// frame stands beside it.
TEST_F(ImportBag, ThePoseMayBeATransform) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i) {
    const std::int64_t ns = kImported_ns + i * kTenth_ns;
    messages.push_back(transform_message("base_link", "laser", ns, 1));
    messages.push_back(transform_message("base_link", "wheel", ns, 0.01 * i));
    messages.push_back(transform_message("map", "base_link", ns, 0.1 * i));
    messages.push_back(stamped_pose("/pose", "base_link", ns, 0));
    if (i == 10) messages.push_back(stamped_pose("/goal", "map", ns, 500));
    messages.push_back(cloud_message("/points", ns));
  }
  const auto no_origin = import(messages);
  ASSERT_TRUE(no_origin.ok());
  EXPECT_EQ(no_origin->became.at("/tf"),
            "the tree of frames: mountings of the rig; its pose is not used: its metres need an origin or a map, see "
            "--origin and --map");
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/tf"), "sensor pos, the pose of base_link in map; mountings of the rig");
  EXPECT_EQ(done->became.at("/pose"),
            "not used: its poses are given in the frame base_link, which moves with the vehicle");
  EXPECT_EQ(done->became.at("/goal"),
            "not used: the pose is that of /tf, with 20 messages that can be used, of 1 here; "
            "--poses /goal takes this");
  EXPECT_NEAR(metres_of_latitudes(pose()), 1.9, 0.01);
  EXPECT_NE(test::contents(folder_ / "drive/rig.yaml").find("# laser in base_link"), std::string::npos);
  const auto wrong = import(messages, {.origin = kOrigin, .poses = {"/pose"}});
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::Invalid);
}

/// Each transform is sent again until there is a newer one: that makes it no surer than an Odometry.
TEST_F(ImportBag, TransformsThatAreSentAgainCountOnce) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i) {
    const std::int64_t ns = kImported_ns + i * kTenth_ns;
    messages.push_back(odometry_message("/odometry", ns, 0.1 * i));
    RosWriter out(drivers::RosEncoding::Cdr);
    out.put(std::uint32_t{1}).header(ns, "map").text("base_link").put(0.0).put(0.1 * i).put(0.0);
    out.put(0.0).put(0.0).put(0.0).put(1.0);
    for (int again = 0; again < 18; ++again)
      messages.push_back({"/tf", "tf2_msgs/TFMessage", ns + again * 5'000'000, out.bytes()});
  }
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odometry"), "sensor pos");
  const auto by_tree = import(messages, {.origin = kOrigin, .poses = {"/tf"}});
  ASSERT_TRUE(by_tree.ok()) << by_tree.error().message;
  EXPECT_EQ(by_tree->became.at("/tf"), "sensor pos, the pose of base_link in map; 340 messages repeat the one before");
}

TEST_F(ImportBag, SaysThatCoordinatesOfAMapAreNoLocalMetres) {
  const auto told = [&](double north) {
    const auto done = import({odometry_message("/odom", kImported_ns, north),
                              odometry_message("/odom", kImported_ns + kTenth_ns, north + 1)},
                             {.origin = kOrigin});
    EXPECT_TRUE(done.ok());
    return std::pair(done->became.at("/odom"), count_told(*done, "coordinates of a map (UTM, MGRS) are not that"));
  };
  EXPECT_EQ(told(0), (std::pair<std::string, int>("sensor pos", 0)));
  EXPECT_EQ(told(90'000).second, 1);
  EXPECT_EQ(told(5'340'000).first,
            "not used: its positions are more than 1000 km from their origin, as coordinates of a map (UTM) are: name "
            "the map with --map");
}

TEST_F(ImportBag, TakesPosesInCoordinatesOfAMap) {
  const auto made = [&](double north, double east, ImportOptions options) {
    return import({odometry_message("/odom", kImported_ns, north, east),
                   odometry_message("/odom", kImported_ns + kTenth_ns, north + 1, east)},
                  std::move(options));
  };
  const auto latitude = [&] { return pose().at("latitude_deg").at(0).get<double>(); };
  const auto done = made(5'340'000, 500'000, {.map = "EPSG:32632"});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odom"), "sensor pos, coordinates of EPSG:32632");
  EXPECT_EQ(count_told(*done, "km from their origin"), 0);
  EXPECT_NEAR(latitude(), 48.21323, 1e-5);
  EXPECT_LT(metres_of_latitudes(pose()), 1.01);
  // Coordinates that count from an origin, along the axes of the map there.
  const auto counted = made(100'000, 0, {.origin = kOrigin, .map = "EPSG:32632"});
  ASSERT_TRUE(counted.ok()) << counted.error().message;
  EXPECT_EQ(count_told(*counted, "km from their origin"), 0);
  EXPECT_NEAR(latitude(), 46.736, 2e-3);
  const auto refused = [&](double north, double east, const std::string& map) {
    const auto not_made = made(north, east, {.map = map});
    if (not_made.ok()) return not_made->became.at("/odom");
    EXPECT_EQ(not_made.error().code, ErrorCode::Invalid);
    return not_made.error().message;
  };
  EXPECT_EQ(refused(0, 0, "EPSG:32632"),
            "not used: its positions are less than 20 km from zero, so they are not coordinates of a map: name their "
            "origin with --origin");
  EXPECT_NE(refused(5'340'000, 500'000, "EPSG:2056").find("--map EPSG:2056: "), std::string::npos);
  EXPECT_NE(refused(5'340'000, 500'000, "utm").find("--map utm: give the EPSG code"), std::string::npos);
  EXPECT_NE(refused(5'340'000, 3'500'000, "EPSG:31467").find("transform those of others first"), std::string::npos);
}

/// Septentrio's driver gives a PoseWithCovarianceStamped whose x and y are longitude and latitude.
TEST_F(ImportBag, DoesNotTakeDegreesForMetres) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i) {
    const std::int64_t ns = kImported_ns + i * kTenth_ns;
    messages.push_back(imu_message("/imu", ns));
    messages.push_back(position("/navsatfix", ns));  // at 48, 11 deg
    RosWriter pose(drivers::RosEncoding::Cdr);
    pose.header(ns, "imu").put(11.0).put(48.0).put(500.0).put(0.0).put(0.0).put(0.0).put(1.0);
    for (int value = 0; value < 36; ++value) pose.put(0.0);
    messages.push_back({"/pose", "geometry_msgs/PoseWithCovarianceStamped", ns, pose.bytes()});
  }
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/pose"),
            "not used: its positions are degrees, as those of a sensor_msgs/NavSatFix here, and not metres");
  EXPECT_EQ(done->became.at("/navsatfix"), "sensor pos");
}

TEST(PoseChoice, OfLocalPosesTakesTheSurestThatIsNotRare) {
  std::map<std::string, PoseTopic> found{{"/odom", {"nav_msgs/Odometry", "base", 100}},
                                         {"/pose", {"geometry_msgs/PoseStamped", "", 1000}},
                                         {"/tf", {"tf2_msgs/TFMessage", "base", 1000}}};
  EXPECT_EQ(apps::choose_pose(found, true, {})->topics, (std::vector<std::string>{"/odom"}));
  found.at("/odom").usable = 99;
  EXPECT_EQ(apps::choose_pose(found, true, {})->topics, (std::vector<std::string>{"/pose"}));
  found.at("/pose").usable = 2;
  EXPECT_EQ(apps::choose_pose(found, true, {})->topics, (std::vector<std::string>{"/tf"})) << "a place to go to";
}

TEST_F(ImportBag, SaysWhereThePosesStateNoAccuracy) {
  const auto told_with = [&](double variance) {
    std::vector<SampleMessage> messages;
    for (int i = 0; i < 20; ++i) {
      messages.push_back(imu_message("/imu", kImported_ns + i * kTenth_ns));
      messages.push_back(position("/fix", kImported_ns + i * kTenth_ns, variance));
    }
    const auto done = import(messages);
    EXPECT_TRUE(done.ok());
    return count_told(*done, "the poses state no accuracy");
  };
  EXPECT_EQ(told_with(1e-4), 0);
  for (const double variance : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) EXPECT_EQ(told_with(variance), 1);
}

/// A drive of two seconds at 25 m/s through a quarter of a circle, from north to west, with the yaws (from east to the
/// left, rad) that `yaw_of` gives of the course.
std::vector<SampleMessage> bend(const std::function<double(double)>& yaw_of) {
  constexpr double kRadius_m = 32, kRight = std::numbers::pi / 2;
  std::vector<SampleMessage> out;
  for (int i = 0; i <= 20; ++i) {
    const double around = kRight * i / 20, yaw = yaw_of(kRight + around);
    RosWriter one(drivers::RosEncoding::Cdr);
    one.header(kImported_ns + i * kTenth_ns, "odom").text("imu");
    one.put(kRadius_m * (std::cos(around) - 1)).put(kRadius_m * std::sin(around)).put(0.0);
    one.put(0.0).put(0.0).put(std::sin(yaw / 2)).put(std::cos(yaw / 2));
    out.push_back({"/odom", "nav_msgs/Odometry", kImported_ns + i * kTenth_ns, one.bytes()});
  }
  return out;
}

TEST_F(ImportBag, SaysWhereTheVehicleDoesNotDriveToWhereItLooks) {
  constexpr double kRight = std::numbers::pi / 2;
  const auto told = [&](const std::function<double(double)>& yaw_of, std::vector<SampleMessage> also = {}) {
    auto messages = bend(yaw_of);
    messages.insert(messages.begin(), also.begin(), also.end());
    const auto done = import(messages, {.origin = kOrigin});
    EXPECT_TRUE(done.ok());
    for (const std::string& one : done->to_do)
      if (one.starts_with("by the orientations")) return one;
    return std::string();
  };
  EXPECT_EQ(told([](double course) { return course + 0.2; }), "");
  // The course is that of the step before, half of which the vehicle has turned on.
  const std::string left = told([](double course) { return course + kRight; });
  EXPECT_NE(left.find("of /odom the vehicle does not look to where it drives: over 50 m it looks 92 deg to the left"),
            std::string::npos)
      << left;
  EXPECT_NE(told([](double course) { return course - kRight; }).find("88 deg to the right"), std::string::npos);
  EXPECT_NE(told([](double course) { return kRight - course; }).find("as by orientations in NED"), std::string::npos);
  // A sensor that is mounted with its x axis to the left.
  RosWriter tree(drivers::RosEncoding::Cdr);
  tree.put(std::uint32_t{1}).header(kImported_ns, "base_link").text("imu").put(0.0).put(0.0).put(0.0);
  tree.put(0.0).put(0.0).put(std::sin(kRight / 2)).put(std::cos(kRight / 2));
  EXPECT_EQ(told([](double course) { return course + kRight; },
                 {{"/tf_static", "tf2_msgs/TFMessage", kImported_ns, tree.bytes()}}),
            "");
}

/// As programs that convert recordings write them: one topic behind the other.
TEST_F(ImportBag, SortsTopicsThatStandOneBehindTheOther) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 300; ++i) messages.push_back(imu_message("/imu", kImported_ns + i * kTenth_ns + 1'000'000));
  for (int i = 0; i <= 30; ++i) messages.push_back(position("/fix", kImported_ns + i * 10 * kTenth_ns));
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 300);
  EXPECT_EQ(done->became.at("/imu"), "sensor pos");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "drive/probe"));
}

/// As a program writes them that gives no time with its messages: the recorder's is that of the writing.
TEST_F(ImportBag, DoesNotUseTheRecordersTimesOfAnotherPace) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 300; ++i) messages.push_back(imu_message("/imu", kImported_ns + i * kTenth_ns + 1'000'000));
  for (int i = 0; i <= 30; ++i) messages.push_back(position("/fix", kImported_ns + i * 10 * kTenth_ns));
  for (int i = 0; i < 300; ++i) messages.push_back(cloud_message("/points", kImported_ns + i * kTenth_ns));
  for (std::size_t i = 0; i < messages.size(); ++i)
    messages[i].time_ns = kImported_ns + std::int64_t{86'400'000'000'000} + static_cast<std::int64_t>(i) * 1'000'000;
  const auto done = import(messages);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 300);
  EXPECT_EQ(count_told(*done, "the recorder's times go on faster or slower"), 1);
  EXPECT_EQ(count_told(*done, "so they are of another clock"), 0);
  // The packets are in the order of the stamps.
  auto drive = storage::JournalReader::open(folder_ / "drive/drive.mcap");
  ASSERT_TRUE(drive.ok());
  HostTime last{};
  int packets = 0;
  for (auto packet = (*drive)->next({}); packet.ok(); packet = (*drive)->next({}), ++packets) {
    EXPECT_GE(packet->received, last);
    last = packet->received;
  }
  EXPECT_EQ(packets, 600);
}

TEST(RecorderPace, IsToldFromDelaysThatChange) {
  const auto pace_of = [](double stamps_s, double received_s) {
    apps::RecorderPace out;
    for (const double share : {0.0, 0.5, 1.0})
      out.take(UnixTime(from_seconds(share * stamps_s)), UnixTime(from_seconds(1e6 + share * received_s)));
    return out.is_other();
  };
  EXPECT_FALSE(apps::RecorderPace().is_other());
  EXPECT_FALSE(pace_of(40, 41));
  EXPECT_FALSE(pace_of(3600, 3610));  // a clock that was set
  EXPECT_TRUE(pace_of(40, 20));
  EXPECT_TRUE(pace_of(40, 400));
  EXPECT_TRUE(pace_of(3600, 3000));
}

TEST_F(ImportBag, CountsTheTimesOfASimulatorFromAStatedDate) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i) messages.push_back(odometry_message("/odom", 47'000'000'000 + i * kTenth_ns, 0.1 * i));
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  ASSERT_FALSE(done->to_do.empty());
  EXPECT_EQ(
      done->to_do[0],
      "the stamps of the poses begin 47.000 s after 1970, so they are those of a simulator. They are counted from "
      "2020-01-01T00:00:00.000Z: the dates of the drive are not true, the times within it are");
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 20) << "all of them, the first one too";
}

TEST_F(ImportBag, AClockThatWasNotSetYetIsNotASimulators) {
  std::vector<SampleMessage> messages;
  for (int i = 0; i < 20; ++i)
    messages.push_back(odometry_message("/odom", (i < 3 ? 5'000'000'000 : kImported_ns) + i * kTenth_ns, 0.1 * i));
  const auto done = import(messages, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->became.at("/odom"), "sensor pos; 3 messages have stamps of another clock, before 1980");
  EXPECT_EQ(pose().at("ins_solutions").at("good"), 17);
}

TEST_F(ImportBag, SaysThatOfTheMessagesNoPoseCouldBeMade) {
  const auto done = import({odometry_message("/odom", kImported_ns, 0)}, {.origin = kOrigin});
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(done->packets, 0u);
  EXPECT_EQ(done->became.at("/odom"), "sensor pos; a single message has no velocity");
  EXPECT_EQ(done->to_do.back(), "no pose could be made of the recording, see the table: a replay places no points");
}

TEST_F(ImportBag, SaysOfEachTopicWhyNothingCouldBeTaken) {
  const auto done = import({odometry_message("/odom", kImported_ns, 0),
                            imu_message("/imu", kImported_ns),
                            {"/text", "std_msgs/String", kImported_ns, "text"}});
  ASSERT_TRUE(done.ok()) << done.error().message;
  ASSERT_FALSE(done->made.ok());
  EXPECT_EQ(done->made.error().code, ErrorCode::Unsupported);
  EXPECT_EQ(done->topics.size(), 3u);
  EXPECT_EQ(done->became.at("/odom"), "not used: its metres need an origin or a map, see --origin and --map");
  EXPECT_EQ(done->became.at("/imu"), "not used: its orientations need the positions of a sensor_msgs/NavSatFix");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "drive/drive.mcap"));
}

}  // namespace
}  // namespace hueline
