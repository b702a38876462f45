// Point clouds of ROS as the drivers of several makers write them: where, when and how strong each return is, and what
// is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <variant>

#include "drivers/ros/ros_cloud_decoder.hpp"
#include "storage/compression.hpp"
#include "storage/crc32.hpp"
#include "tests/rosbag/cloud_message.hpp"

namespace hueline {
namespace {

using drivers::RosCloudDecoder;
using drivers::RosEncoding;
using drivers::RosTimeUnit;
using drivers::RosTimeZero;
using test::CloudMessage;

constexpr std::int64_t kStamp_ns = 1'700'000'000'123'456'789;
constexpr std::int64_t kEnd_ns = kStamp_ns + 100'000'000;
constexpr const char* kCloud2 = "sensor_msgs/PointCloud2";

struct Decoded {
  std::vector<LaserBatch> batches;
  std::vector<Fault> faults;
  DecodeCounts counts;
  /// The returns with their times since 1970, ns.
  std::vector<std::pair<std::int64_t, LaserReturn>> returns() const {
    std::vector<std::pair<std::int64_t, LaserReturn>> out;
    for (const LaserBatch& batch : batches)
      for (const LaserReturn& r : batch.returns)
        out.emplace_back(count_ns(std::get<UnixTime>(batch.time)) + r.time_offset_ns, r);
    return out;
  }
};

Decoded decode(const std::vector<std::string>& messages, const RosCloudDecoder::Config& config) {
  RosCloudDecoder decoder(config);
  Decoded out;
  std::vector<Measurement> measured;
  for (const std::string& message : messages) {
    Packet packet;
    packet.sensor = 3;
    packet.received = host_time_ns(kEnd_ns);
    packet.bytes = Buffer::copy_of(storage::as_bytes(message));
    decoder.decode(packet, measured);
  }
  for (const Measurement& m : measured) {
    if (const auto* batch = std::get_if<LaserBatch>(&m)) out.batches.push_back(*batch);
    if (const auto* fault = std::get_if<Fault>(&m)) out.faults.push_back(*fault);
  }
  out.counts = decoder.counts();
  return out;
}
RosCloudDecoder::Config config_of(RosEncoding encoding) {
  RosCloudDecoder::Config out;
  out.encoding = encoding;
  return out;
}
drivers::RosTimeRule rule_of(const std::string& bytes, RosEncoding encoding) {
  const auto cloud = drivers::take_cloud(kCloud2, {storage::as_bytes(bytes), encoding});
  EXPECT_TRUE(cloud.ok());
  return recognise_times(*cloud, {}).value_or(drivers::RosTimeRule{});
}

TEST(RosCloud, GivesEachReturnOfAVelodyneItsPlaceTimeRingAndStrength) {
  for (const RosEncoding encoding : {RosEncoding::Ros1, RosEncoding::Cdr}) {
    CloudMessage message = test::velodyne_turn(kStamp_ns, 3, 0.1);
    message.put(std::numeric_limits<float>::quiet_NaN()).put(0.f).put(0.f).put(0.f).put(std::uint16_t{0}).put(0.f);
    message.put(0.f).put(0.f).put(0.f).put(9.f).put(std::uint16_t{0}).put(0.f);
    message.width = 5;
    const Decoded out = decode({message.bytes(encoding)}, config_of(encoding));
    const auto returns = out.returns();
    ASSERT_EQ(returns.size(), 3u);
    EXPECT_TRUE(out.faults.empty());
    EXPECT_EQ(out.counts.messages.at("points without a return"), 2u);
    for (int i = 0; i < 3; ++i) {
      const auto& [time, r] = returns[static_cast<std::size_t>(i)];
      EXPECT_NEAR(static_cast<double>(time - kStamp_ns), 50e6 * i, 10);
      EXPECT_FLOAT_EQ(r.x, 10.0f + static_cast<float>(i));
      EXPECT_FLOAT_EQ(r.y, -5);
      EXPECT_FLOAT_EQ(r.z, 0.5);
      EXPECT_FLOAT_EQ(r.range_m, std::hypot(r.x, r.y, r.z));
      EXPECT_NEAR(r.azimuth, 2 * std::numbers::pi + std::atan2(-5.0, 10.0 + i), 1e-6);
      EXPECT_EQ(r.channel, i);
      EXPECT_EQ(r.reflectivity, i);
    }
  }
}

TEST(RosCloud, GivesBatchesAsIfTheyHadComeWhenTheyWereMeasured) {
  const Decoded out =
      decode({test::velodyne_turn(kStamp_ns, 1001, 0.1).bytes(RosEncoding::Cdr)}, config_of(RosEncoding::Cdr));
  EXPECT_NEAR(static_cast<double>(out.batches.size()), 100, 1);
  EXPECT_EQ(count_ns(out.batches.back().received), kEnd_ns);
  for (const LaserBatch& batch : out.batches) {
    EXPECT_EQ(batch.sensor, 3);
    // The clock of header.stamp and that of the arrivals are one: what is between them is the length of a batch.
    EXPECT_NEAR(static_cast<double>(count_ns(batch.received) - count_ns(std::get<UnixTime>(batch.time))), 1e6, 10);
    for (const LaserReturn& r : batch.returns) EXPECT_LE(r.time_offset_ns, 1'000'000);
  }
}

/// x, y, z, t in ns, reflectivity; two rows with padding behind, by columns in time.
CloudMessage ouster_cloud() {
  CloudMessage out;
  out.stamp_ns = kStamp_ns;
  out.fields = {{"x", 0, test::kF32},
                {"y", 4, test::kF32},
                {"z", 8, test::kF32},
                {"t", 16, test::kU32},
                {"reflectivity", 20, test::kU16},
                {"ring", 22, test::kU8}};
  out.height = 2, out.width = 3, out.point_step = 24, out.row_step = 80;
  for (std::uint8_t row = 0; row < 2; ++row) {
    for (std::uint32_t column = 0; column < 3; ++column)
      out.put(1.0f + static_cast<float>(column))
          .put(0.f)
          .put(0.f)
          .put(0.f)
          .put(column * 40'000'000)
          .put(std::uint16_t{100})
          .put(row)
          .put(std::uint8_t{0});
    out.data += std::string(8, 'p');
  }
  return out;
}

TEST(RosCloud, ReadsTheRowsOfAnOusterInTheOrderOfTheirTimes) {
  const Decoded out = decode({ouster_cloud().bytes(RosEncoding::Cdr)}, config_of(RosEncoding::Cdr));
  const auto returns = out.returns();
  ASSERT_EQ(returns.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(returns[i].first, kStamp_ns + static_cast<std::int64_t>(i / 2) * 40'000'000);
    EXPECT_EQ(returns[i].second.channel, i % 2);
    EXPECT_EQ(returns[i].second.reflectivity, 100);
  }
}

/// x, y, z, intensity, timestamp as a double.
CloudMessage dated_cloud(bool is_big_endian, double first, double second) {
  CloudMessage out;
  out.stamp_ns = kStamp_ns;
  out.is_big_endian = is_big_endian;
  out.fields = {{"x", 0, test::kF32},
                {"y", 4, test::kF32},
                {"z", 8, test::kF32},
                {"intensity", 12, test::kF32},
                {"timestamp", 16, test::kF64}};
  out.width = 2, out.point_step = 24, out.row_step = 0;  // a writer that leaves it out
  for (const double time : {first, second}) out.put(3.f).put(4.f).put(0.f).put(1.f).put(time);
  return out;
}

TEST(RosCloud, ReadsDatesOfHesaiAndRobosenseInBothByteOrders) {
  for (const bool is_big_endian : {false, true}) {
    const Decoded out =
        decode({dated_cloud(is_big_endian, 1'700'000'000.125, 1'700'000'000.225).bytes(RosEncoding::Ros1)},
               config_of(RosEncoding::Ros1));
    const auto returns = out.returns();
    ASSERT_EQ(returns.size(), 2u);
    EXPECT_NEAR(static_cast<double>(returns[0].first - 1'700'000'000'125'000'000), 0, 300);
    EXPECT_NEAR(static_cast<double>(returns[1].first - 1'700'000'000'225'000'000), 0, 300);
    EXPECT_FLOAT_EQ(returns[0].second.range_m, 5);
  }
}

TEST(RosCloud, RecognisesUnitAndZeroOfTimes) {
  struct Case {
    double first, second;
    RosTimeUnit unit;
    RosTimeZero zero;
  };
  const Case cases[] = {{0, 0.1, RosTimeUnit::Second, RosTimeZero::Stamp},
                        {-0.1, 0, RosTimeUnit::Second, RosTimeZero::Stamp},
                        {0, 100, RosTimeUnit::Millisecond, RosTimeZero::Stamp},
                        {0, 5e4, RosTimeUnit::Microsecond, RosTimeZero::Stamp},
                        {0, 1e8, RosTimeUnit::Nanosecond, RosTimeZero::Stamp},
                        {1.7e9, 1.7e9 + 0.1, RosTimeUnit::Second, RosTimeZero::Date},
                        {1.7e15, 1.7e15 + 1e5, RosTimeUnit::Microsecond, RosTimeZero::Date},
                        {1.7e18, 1.7e18 + 1e8, RosTimeUnit::Nanosecond, RosTimeZero::Date},
                        {1.7e9 + 37, 1.7e9 + 37.1, RosTimeUnit::Second, RosTimeZero::First},
                        {52.5, 52.6, RosTimeUnit::Second, RosTimeZero::First}};
  for (const Case& one : cases) {
    const auto rule = rule_of(dated_cloud(false, one.first, one.second).bytes(RosEncoding::Cdr), RosEncoding::Cdr);
    EXPECT_EQ(rule.field, "timestamp");
    EXPECT_EQ(rule.unit, one.unit) << one.first << " to " << one.second;
    EXPECT_EQ(rule.zero, one.zero) << one.first << " to " << one.second;
    // However it is written, the turn lasts as long.
    const Decoded out =
        decode({dated_cloud(false, one.first, one.second).bytes(RosEncoding::Cdr)}, config_of(RosEncoding::Cdr));
    const auto returns = out.returns();
    ASSERT_EQ(returns.size(), 2u);
    EXPECT_NEAR(static_cast<double>(returns[1].first - returns[0].first),
                one.unit == RosTimeUnit::Microsecond && one.first == 0 ? 5e7 : 1e8, 600);
  }
  // Times that are all the same are none.
  EXPECT_TRUE(rule_of(dated_cloud(false, 0, 0).bytes(RosEncoding::Cdr), RosEncoding::Cdr).field.empty());
}

TEST(RosCloud, KnowsTimesWhoseNameEndsWithTheirUnit) {
  struct Case {
    const char* field;
    double second;
    RosTimeUnit unit;
  };
  for (const Case& one : {Case{"time_offset_ns", 1e8, RosTimeUnit::Nanosecond},
                          {"timestamp_us", 1e5, RosTimeUnit::Microsecond},
                          {"t_ns", 1e6, RosTimeUnit::Nanosecond},  // 1 ms, by its span 1 s in us
                          {"relative_timestamp", 0.1, RosTimeUnit::Second}}) {
    auto cloud = dated_cloud(false, 0, one.second);
    for (auto& field : cloud.fields)
      if (field.name == "timestamp") field.name = one.field;
    const auto rule = rule_of(cloud.bytes(RosEncoding::Cdr), RosEncoding::Cdr);
    EXPECT_EQ(rule.field, one.field);
    EXPECT_EQ(rule.unit, one.unit) << one.field;
  }
  auto cloud = dated_cloud(false, 0, 0.1);
  cloud.fields.back().name = "stamps_of_others";
  EXPECT_TRUE(rule_of(cloud.bytes(RosEncoding::Cdr), RosEncoding::Cdr).field.empty());
}

/// A turn of 0.1 s whose times are whole seconds and the rest of them, as cepton_ros writes them.
CloudMessage turn_of_two_fields(const char* seconds, const char* rest, std::int64_t begin_ns) {
  CloudMessage out;
  out.stamp_ns = kStamp_ns;
  out.fields = {{"x", 0, test::kF32}, {"y", 4, test::kF32}, {"z", 8, test::kF32}};
  out.fields.push_back({seconds, 12, test::kU32});
  out.fields.push_back({rest, 16, test::kU32});
  out.width = 2, out.point_step = 20;
  for (const std::int64_t ns : {begin_ns, begin_ns + 100'000'000})
    out.put(3.f)
        .put(4.f)
        .put(0.f)
        .put(static_cast<std::uint32_t>(ns / 1'000'000'000))
        .put(static_cast<std::uint32_t>(ns % 1'000'000'000));
  return out;
}

TEST(RosCloud, AddsTheRestOfASecondToWholeSeconds) {
  // The second turn goes over the end of a second.
  for (const std::int64_t begin_ns : {kStamp_ns, kStamp_ns - kStamp_ns % 1'000'000'000 - 30'000'000}) {
    const std::string bytes = turn_of_two_fields("timestamp_sec", "timestamp_nsec", begin_ns).bytes(RosEncoding::Cdr);
    const auto rule = rule_of(bytes, RosEncoding::Cdr);
    EXPECT_EQ(rule,
              (drivers::RosTimeRule{"timestamp_nsec", RosTimeUnit::Nanosecond, RosTimeZero::Date, "timestamp_sec"}));
    EXPECT_EQ(in_words(rule), "times of the points: timestamp_sec and timestamp_nsec, s and ns since 1970");
    RosCloudDecoder::Config written = config_of(RosEncoding::Cdr);
    written.times = rule;
    for (const auto& config : {config_of(RosEncoding::Cdr), written}) {
      const Decoded out = decode({bytes}, config);
      EXPECT_TRUE(out.faults.empty());
      const auto returns = out.returns();
      ASSERT_EQ(returns.size(), 2u);
      EXPECT_EQ(returns[0].first, begin_ns);
      EXPECT_EQ(returns[1].first, begin_ns + 100'000'000);
    }
  }
  // Another stem, and a rest that holds seconds itself.
  auto rule = rule_of(turn_of_two_fields("gps_sec", "t_nsec", 0).bytes(RosEncoding::Cdr), RosEncoding::Cdr);
  EXPECT_EQ(rule, (drivers::RosTimeRule{"t_nsec", RosTimeUnit::Nanosecond, RosTimeZero::Stamp, {}}));
  rule = rule_of(turn_of_two_fields("time_s", "time_ms", 50'000'000).bytes(RosEncoding::Cdr), RosEncoding::Cdr);
  EXPECT_EQ(rule.field, "time_ms");
  EXPECT_EQ(rule.seconds_field, "");
}

TEST(RosCloud, ALivoxThatNothingSynchronisesIsTimedByHeaderStamp) {
  constexpr std::uint64_t kSwitchedOn_ns = 1'234'567'890'123;  // 20 minutes ago
  test::RosWriter message(RosEncoding::Cdr);
  message.header(kStamp_ns, "livox").put(kSwitchedOn_ns).put(std::uint32_t{2}).put(std::uint32_t{0});
  message.put(std::uint32_t{2});
  for (std::uint32_t i = 0; i < 2; ++i)
    message.put(10'000'000 + i * 90'000'000).put(2.f).put(3.f).put(6.f).raw(std::string(3, '\0'));
  RosCloudDecoder::Config config = config_of(RosEncoding::Cdr);
  config.message = RosCloudDecoder::Message::Livox;
  const auto returns = decode({message.bytes()}, config).returns();
  ASSERT_EQ(returns.size(), 2u);
  EXPECT_EQ(returns[0].first, kStamp_ns + 10'000'000);
  EXPECT_EQ(returns[1].first, kStamp_ns + 100'000'000);
}

TEST(RosCloud, ReadsPointsOfALivoxInBothEncodings) {
  for (const RosEncoding encoding : {RosEncoding::Ros1, RosEncoding::Cdr}) {
    test::RosWriter message(encoding);
    message.header(kStamp_ns + 5, "livox")
        .put(std::uint64_t{kStamp_ns})
        .put(std::uint32_t{2})
        .put(std::uint32_t{0})
        .put(std::uint32_t{2});
    for (std::uint32_t i = 0; i < 2; ++i)
      message.put(i * 90'000'000)
          .put(2.f)
          .put(3.f)
          .put(6.f)
          .put(std::uint8_t{77})
          .put(std::uint8_t{0})
          .put(static_cast<std::uint8_t>(i));
    RosCloudDecoder::Config config = config_of(encoding);
    config.message = RosCloudDecoder::Message::Livox;
    const Decoded out = decode({message.bytes()}, config);
    const auto returns = out.returns();
    ASSERT_EQ(returns.size(), 2u) << name(encoding);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(returns[i].first, kStamp_ns + static_cast<std::int64_t>(i) * 90'000'000);
      EXPECT_FLOAT_EQ(returns[i].second.range_m, 7);
      EXPECT_EQ(returns[i].second.reflectivity, 77);
      EXPECT_EQ(returns[i].second.channel, i);
    }
  }
}

TEST(RosCloud, ReadsTheRangesOfAScannerWithOnePlane) {
  const auto scan = [](RosEncoding encoding, float time_increment, std::vector<float> intensities) {
    test::RosWriter message(encoding);
    message.header(kStamp_ns, "laser");
    for (const float one : {-0.5f, 0.5f, 0.5f, time_increment, 0.02f, 0.06f, 30.0f}) message.put(one);
    const std::vector<float> ranges{2, std::numeric_limits<float>::infinity(), 0.05f, 4, 31, 0.07f};
    message.put(static_cast<std::uint32_t>(ranges.size()));
    for (const float one : ranges) message.put(one);
    message.put(static_cast<std::uint32_t>(intensities.size()));
    for (const float one : intensities) message.put(one);
    return message.bytes();
  };
  for (const RosEncoding encoding : {RosEncoding::Ros1, RosEncoding::Cdr}) {
    RosCloudDecoder::Config config = config_of(encoding);
    config.message = RosCloudDecoder::Message::LaserScan;
    const Decoded out = decode({scan(encoding, 0.004f, {10, 20, 30, 40, 50, 60})}, config);
    const auto returns = out.returns();
    ASSERT_EQ(returns.size(), 2u) << name(encoding);
    EXPECT_EQ(out.counts.messages.at(RosCloudDecoder::kReturnless), 3u);
    EXPECT_EQ(out.counts.messages.at(RosCloudDecoder::kOutOfRange), 1u) << "0.07 m is nearer than min_range_m";
    EXPECT_NEAR(returns[0].second.x, 2 * std::cos(-0.5), 1e-6);
    EXPECT_NEAR(returns[0].second.y, 2 * std::sin(-0.5), 1e-6);
    EXPECT_EQ(returns[0].second.z, 0);
    EXPECT_EQ(returns[0].second.reflectivity, 10);
    EXPECT_NEAR(static_cast<double>(returns[0].first - kStamp_ns), 0, 10);
    EXPECT_NEAR(returns[1].second.range_m, 4, 1e-6);
    EXPECT_NEAR(returns[1].second.azimuth, 1, 1e-6);
    EXPECT_NEAR(static_cast<double>(returns[1].first - kStamp_ns), 12e6, 10);

    // Without times between the ranges, those of the message are all that there is.
    config.stamp_is_enough = true;
    EXPECT_EQ(decode({scan(encoding, 0, {})}, config).returns().size(), 2u);
    const std::string whole = scan(encoding, 0.004f, {});
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_TRUE(decode({whole.substr(0, size)}, config).batches.empty()) << size;
  }
}

TEST(RosCloud, ReadsTheOlderKindOfClouds) {
  const auto cloud = [](RosEncoding encoding) {
    test::RosWriter message(encoding);
    message.header(kStamp_ns, "laser").put(std::uint32_t{3});
    for (const float value : {3.f, 4.f, 0.f, 0.f, 0.f, 0.f, 0.f, 0.f, 5.f}) message.put(value);
    message.put(std::uint32_t{3});
    const auto channel = [&](const std::string& name, const std::vector<float>& values) {
      message.text(name).put(static_cast<std::uint32_t>(values.size()));
      for (const float one : values) message.put(one);
    };
    channel("intensity", {10, 20, 30});
    channel("of_the_cloud", {1});  // no value for each point
    channel("time", {0, 0.01f, 0.05f});
    return message.bytes();
  };
  for (const RosEncoding encoding : {RosEncoding::Ros1, RosEncoding::Cdr}) {
    RosCloudDecoder::Config config = config_of(encoding);
    config.message = RosCloudDecoder::Message::PointCloud;
    const std::string whole = cloud(encoding);
    const Decoded out = decode({whole}, config);
    const auto returns = out.returns();
    ASSERT_EQ(returns.size(), 2u) << name(encoding);
    EXPECT_EQ(out.counts.messages.at(RosCloudDecoder::kReturnless), 1u) << "(0, 0, 0) is no return";
    EXPECT_EQ(returns[0].second.range_m, 5);
    EXPECT_EQ(returns[0].second.reflectivity, 10);
    EXPECT_EQ(returns[1].second.z, 5);
    EXPECT_EQ(returns[1].second.reflectivity, 30);
    EXPECT_NEAR(static_cast<double>(returns[1].first - kStamp_ns), 50e6, 10);
    const auto read = drivers::take_cloud("sensor_msgs/PointCloud", {std::as_bytes(std::span(whole)), encoding});
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(read->find("of_the_cloud"), nullptr);
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_TRUE(decode({whole.substr(0, size)}, config).batches.empty()) << size;
  }
}

/// The cloud as point_cloud_transport sends it: a CompressedPointCloud2.
std::string packed_message(const CloudMessage& cloud, const std::string& format, const std::string& data,
                           RosEncoding encoding) {
  CloudMessage with = cloud;
  with.data = data;
  const std::string whole = with.bytes(encoding);
  const std::string ending = test::RosWriter(RosEncoding::Ros1).text(format).bytes();
  if (encoding == RosEncoding::Ros1) return whole + ending;
  test::RosWriter out(encoding);  // CDR aligns the length of the text
  return out.raw(whole.substr(4)).text(format).bytes();
}
std::string zstd_of(const std::string& points) {
  storage::Bytes out;
  const storage::ByteView pieces[]{storage::as_bytes(points)};
  EXPECT_TRUE(storage::compress(storage::Compression::Zstd, pieces, out).ok());
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}
/// A gzip member with one block that is stored (RFC 1951 and 1952).
std::string gzip_of(const std::string& points) {
  const auto size = static_cast<std::uint16_t>(points.size());
  return std::string("\x1F\x8B\x08\0\0\0\0\0\0\xFF\x01", 11) + test::raw_of(size) +
         test::raw_of(static_cast<std::uint16_t>(~size)) + points +
         test::raw_of(storage::crc32(0, storage::as_bytes(points))) + test::raw_of(std::uint32_t{size});
}

TEST(RosCloud, UnpacksCloudsThatPointCloudTransportCompressedWithoutLoss) {
  const CloudMessage cloud = test::velodyne_turn(kStamp_ns, 5, 0.1);
  for (const RosEncoding encoding : {RosEncoding::Ros1, RosEncoding::Cdr}) {
    RosCloudDecoder::Config config = config_of(encoding);
    const Decoded plain = decode({cloud.bytes(encoding)}, config);
    config.message = RosCloudDecoder::Message::PackedPointCloud2;
    for (const auto& [format, data] :
         {std::pair("zstd", zstd_of(cloud.data)), std::pair("zlib", gzip_of(cloud.data))}) {
      const std::string message = packed_message(cloud, format, data, encoding);
      const Decoded out = decode({message}, config);
      ASSERT_EQ(out.returns().size(), 5u) << format;
      for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(out.returns()[i].first, plain.returns()[i].first);
        EXPECT_EQ(out.returns()[i].second.x, plain.returns()[i].second.x);
      }
      for (std::size_t size = 0; size < message.size(); ++size)
        EXPECT_TRUE(decode({message.substr(0, size)}, config).batches.empty()) << size;
    }
    // More points than the message says, and numbers that no computer holds.
    CloudMessage few = cloud;
    few.width = 4, few.row_step = 4 * few.point_step;
    EXPECT_TRUE(decode({packed_message(few, "zstd", zstd_of(cloud.data), encoding)}, config).batches.empty());
    CloudMessage many = cloud;
    many.width = many.height = many.row_step = 0xFFFFFFFF;
    EXPECT_TRUE(decode({packed_message(many, "zstd", zstd_of(cloud.data), encoding)}, config).batches.empty());
    const auto refused =
        drivers::take_cloud("point_cloud_interfaces/CompressedPointCloud2",
                            {storage::as_bytes(packed_message(cloud, "draco", "abc", encoding)), encoding});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_NE(refused.error().message.find("compressed as draco, which is not read"), std::string::npos);
  }
}

TEST(RosCloud, RefusesPointsWithoutTimesUntilTheRigSaysThatTheStampIsEnough) {
  CloudMessage message = dated_cloud(false, 0, 0);
  message.fields.pop_back();
  RosCloudDecoder::Config config = config_of(RosEncoding::Cdr);
  const Decoded refused = decode({message.bytes(RosEncoding::Cdr)}, config);
  EXPECT_TRUE(refused.batches.empty());
  ASSERT_EQ(refused.faults.size(), 1u);
  EXPECT_EQ(refused.faults[0].kind, FaultKind::NoTime);
  EXPECT_NE(refused.faults[0].detail.find("stamp_is_enough"), std::string::npos);
  EXPECT_GT(refused.counts.ignored_bytes, 0u);

  config.stamp_is_enough = true;
  const Decoded used = decode({message.bytes(RosEncoding::Cdr)}, config);
  ASSERT_EQ(used.returns().size(), 2u);
  for (const auto& [time, r] : used.returns()) EXPECT_EQ(time, kStamp_ns);
  EXPECT_TRUE(used.faults.empty());

  const std::string bytes = message.bytes(RosEncoding::Cdr);
  const auto cloud = drivers::take_cloud(kCloud2, {storage::as_bytes(bytes), RosEncoding::Cdr});
  ASSERT_TRUE(cloud.ok());
  const auto suited = RosCloudDecoder::suited(kCloud2, RosEncoding::Cdr, *cloud, std::chrono::milliseconds(200));
  EXPECT_TRUE(suited.stamp_is_enough);
  EXPECT_EQ(suited.stamp_sigma, std::chrono::milliseconds(100));
  EXPECT_EQ(suited.intensity_full, 1);
}

TEST(RosCloud, TellsTimesThatCannotBe) {
  RosCloudDecoder::Config config = config_of(RosEncoding::Cdr);
  config.times = {"time", RosTimeUnit::Second, RosTimeZero::Stamp, {}};
  // Microseconds that the rig calls seconds.
  const Decoded wrong = decode({test::velodyne_turn(kStamp_ns, 3, 5e4).bytes(RosEncoding::Cdr)}, config);
  EXPECT_TRUE(wrong.batches.empty());
  ASSERT_EQ(wrong.faults.size(), 1u);
  EXPECT_EQ(wrong.faults[0].kind, FaultKind::Malformed);
  EXPECT_EQ(wrong.counts.malformed_messages, 1u);
  // Turns of 10 ms that the rig reads as 10 us.
  config.times.unit = RosTimeUnit::Microsecond;
  std::vector<std::string> turns;
  for (int i = 0; i < 3; ++i)
    turns.push_back(test::velodyne_turn(kStamp_ns + i * 10'000'000, 3, 0.01).bytes(RosEncoding::Cdr));
  const Decoded doubted = decode(turns, config);
  EXPECT_EQ(doubted.returns().size(), 9u);
  ASSERT_EQ(doubted.faults.size(), 1u);
  EXPECT_EQ(doubted.faults[0].kind, FaultKind::NoTime);
  EXPECT_NE(doubted.faults[0].detail.find("time_unit"), std::string::npos);
  config.times.unit = RosTimeUnit::Second;
  EXPECT_TRUE(decode(turns, config).faults.empty());
}

TEST(RosCloud, RefusesMessagesThatContradictThemselves) {
  const CloudMessage good = test::velodyne_turn(kStamp_ns, 10, 0.1);
  const auto refused = [&](const CloudMessage& message) {
    const Decoded out = decode({message.bytes(RosEncoding::Cdr)}, config_of(RosEncoding::Cdr));
    return out.batches.empty() && out.faults.size() == 1 && out.faults[0].kind == FaultKind::Malformed;
  };
  EXPECT_FALSE(refused(good));
  CloudMessage message = good;
  message.width = 11;
  EXPECT_TRUE(refused(message));
  message = good;
  message.height = 2;
  EXPECT_TRUE(refused(message));
  message = good;
  message.height = 0xFFFFFFFF, message.width = 0xFFFFFFFF, message.row_step = 0xFFFFFFFF;
  EXPECT_TRUE(refused(message));
  message = good;
  message.point_step = 0;
  EXPECT_TRUE(refused(message));
  message = good;
  message.fields[1].offset = 4000;  // y lies behind the point
  EXPECT_TRUE(refused(message));
  message = good;
  message.fields[0].type = test::kU32;
  EXPECT_TRUE(refused(message));
  const std::string bytes = good.bytes(RosEncoding::Cdr);
  for (std::size_t size = 0; size + 1 < bytes.size(); size += 3) {
    const Decoded out = decode({bytes.substr(0, size)}, config_of(RosEncoding::Cdr));
    EXPECT_TRUE(out.batches.empty()) << size;
    EXPECT_EQ(out.counts.malformed_bytes, size);
  }
}

}  // namespace
}  // namespace hueline
