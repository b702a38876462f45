// Trajectories of post-processing programs: real records, and files that are none.
#include "drivers/trajectory/sbet_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "drivers/sbet/sbet_decoder.hpp"
#include "drivers/sbet/sbet_device.hpp"
#include "drivers/trajectory/smrmsg_file.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using testing::HasSubstr;

class Sbet : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::vector<std::vector<double>>& records,
                    std::size_t bytes_more = 0) {
    const std::string path = (folder_ / name).string();
    std::ofstream out(path, std::ios::binary);
    for (const auto& record : records)
      out.write(reinterpret_cast<const char*>(record.data()), static_cast<std::streamsize>(record.size() * 8));
    out << std::string(bytes_more, 'x');
    return path;
  }
  static std::vector<double> pose(double second, double latitude = 0.8, double heading = 1) {
    return {second, latitude, 0.2, 100, 1, 0, 0, 0.01, 0.02, heading, 0.1, 0, 0, 0, 0, 0, 0};
  }
  static std::vector<double> accuracy(double second, double north) {
    return {second, north, 0.02, 0.03, 0.1, 0.2, 0.3, 1, 2, 3};
  }
  test::TemporaryFolder folder_;
};

TEST_F(Sbet, SaysOfAccuraciesThatTheyAreNoPlaces) {
  const std::vector<double> sigmas{200000, 0.02, 0.03, 0.05, 0.001, 0.002, 0.003, 0.6, 0.6, 3};
  std::vector<double> later = sigmas;
  later[0] += 1;
  const auto file = SbetFile::open(write("smrmsg.out", {sigmas, later}), "");
  ASSERT_FALSE(file.ok());
  EXPECT_THAT(file.error().message, HasSubstr("holds the accuracies of a trajectory (SMRMSG)"));
  const std::vector<std::byte> poses(272, std::byte{0});
  EXPECT_FALSE(is_smrmsg(poses));
}

TEST_F(Sbet, ARecordOfARealFile) {
  HUELINE_REQUIRE_DATA("pos/2-points.sbet");
  auto file = SbetFile::open(data_file.string(), "");
  ASSERT_TRUE(file.ok()) << file.error().message;
  const auto first = file->next(), second = file->next();
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(file->next().error().code, ErrorCode::EndOfData);
  // As `python3 -c 'import struct; ...'` reads them.
  EXPECT_DOUBLE_EQ(first->second, 151631.00283607095);
  EXPECT_DOUBLE_EQ(first->position.latitude, 0.5680211852972264);
  EXPECT_DOUBLE_EQ(first->position.longitude, -2.04165439230394);
  EXPECT_DOUBLE_EQ(first->position.ellipsoidal_height, 107.71529532965604);
  EXPECT_DOUBLE_EQ(first->roll, -0.028134071493213387);
  EXPECT_DOUBLE_EQ(first->pitch, -0.024299053938891393);
  EXPECT_DOUBLE_EQ(first->platform_heading, 3.0467732302786623);
  EXPECT_DOUBLE_EQ(first->wander, -0.021984147369226575);
  EXPECT_FALSE(first->sigma);
  EXPECT_EQ(file->counts().records, 2u);
}

TEST_F(Sbet, ACutFileIsReadUpToItsLastWholeRecord) {
  HUELINE_REQUIRE_DATA("pos/badfile.sbet");
  auto file = SbetFile::open(data_file.string(), "");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_TRUE(file->next().ok());
  EXPECT_EQ(file->next().error().code, ErrorCode::EndOfData);
  EXPECT_EQ(file->counts().bytes_at_end, 135u);
}

TEST_F(Sbet, SecondsGoOnBeyondTheEndOfTheWeek) {
  auto file = SbetFile::open(write("a", {pose(604799.9), pose(0.1), pose(0.3)}), "");
  ASSERT_TRUE(file.ok());
  for (const double second : {604799.9, 604800.1, 604800.3}) EXPECT_NEAR(file->next()->second, second, 1e-9);
}

TEST_F(Sbet, WhatIsOutOfOrderOrImpossibleIsLeftOutAndCounted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto file = SbetFile::open(
      write("a", {pose(10), pose(10), pose(9), pose(11, 2.0), pose(12, 0.8, nan), pose(nan), pose(13)}, 7), "");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->next()->second, 10);
  EXPECT_EQ(file->next()->second, 13);
  EXPECT_FALSE(file->next().ok());
  EXPECT_EQ(file->counts().records, 2u);
  EXPECT_EQ(file->counts().out_of_order, 2u);
  EXPECT_EQ(file->counts().impossible, 3u);
  EXPECT_EQ(file->counts().bytes_at_end, 7u);
}

TEST_F(Sbet, WhatIsLeftOutOfTheAccuraciesIsCountedApart) {
  std::vector<double> broken = accuracy(11, 0.5);
  broken[4] = -1;
  auto file = SbetFile::open(write("a", {pose(10), pose(12), pose(14)}),
                             write("b", {accuracy(10, 0.5), broken, accuracy(14, 0.5)}, 3));
  ASSERT_TRUE(file.ok());
  while (file->next().ok()) {
  }
  EXPECT_EQ(file->counts().records, 3u);
  EXPECT_EQ(file->counts().impossible, 0u);
  EXPECT_EQ(file->counts().impossible_accuracies, 1u);
  EXPECT_EQ(file->counts().accuracy_bytes_at_end, 3u);
}

TEST_F(Sbet, SigmasAreThoseOfTheNearestRecordWithinTwoSeconds) {
  const std::string sbet = write("a", {pose(10), pose(11.4), pose(11.6), pose(14), pose(14.1)});
  auto file = SbetFile::open(sbet, write("b", {accuracy(11, 0.5), accuracy(12, 0.7)}));
  ASSERT_TRUE(file.ok()) << file.error().message;
  std::vector<double> north;
  for (int i = 0; i < 5; ++i) {
    const auto record = file->next();
    north.push_back(record->sigma ? (*record->sigma)[1] : -1);
    if (record->sigma) {
      EXPECT_DOUBLE_EQ((*record->sigma)[0], 0.02);
      EXPECT_DOUBLE_EQ((*record->sigma)[3], 0.2) << "velocity east";
      EXPECT_NEAR((*record->sigma)[8], 3.0 / 60 * 3.14159265358979 / 180, 1e-12) << "heading, from arc minutes";
    }
  }
  EXPECT_EQ(north, (std::vector<double>{0.5, 0.5, 0.7, 0.7, -1}));
}

TEST_F(Sbet, FilesThatAreNoneAreRefusedWithTheReason) {
  EXPECT_THAT(SbetFile::open(write("short", {{10, 0.8, 0.2}}), "").error().message, HasSubstr("less than one record"));
  EXPECT_THAT(SbetFile::open(write("empty", {}), "").error().message, HasSubstr("less than one record"));
  EXPECT_THAT(SbetFile::open(write("text", {}, 1000), "").error().message, HasSubstr("is a text"));
  EXPECT_THAT(SbetFile::open(write("angles", {pose(10, 0.8, 50)}), "").error().message,
              HasSubstr("begins with an angle of 50 rad, so it is no SBET"));
  EXPECT_THAT(SbetFile::open(write("degrees", {pose(10, 48.1)}), "").error().message,
              HasSubstr("latitude of 48.1 rad"));
  const std::string good = write("good", {pose(10)});
  EXPECT_THAT(SbetFile::open(good, write("none", {}, 20)).error().message, HasSubstr("no record of an SMRMSG"));
  EXPECT_THAT(SbetFile::open(good, write("other", {accuracy(1, -5)})).error().message, HasSubstr("is no SMRMSG"));
  EXPECT_EQ(SbetFile::open((folder_ / "absent").string(), "").error().code, ErrorCode::Io);
  EXPECT_EQ(SbetFile::open(good, (folder_ / "absent").string()).error().code, ErrorCode::Io);
}

TEST_F(Sbet, AnyBytesAreReadToTheirEnd) {
  std::mt19937_64 random(7);
  for (int run = 0; run < 300; ++run) {
    std::vector<std::vector<double>> records;
    for (std::size_t i = 0; i < 1 + random() % 40; ++i) records.push_back(pose(static_cast<double>(i)));
    for (std::size_t i = 0; i < random() % 20; ++i) {
      auto& record = records[random() % records.size()];
      const std::uint64_t bits = random();
      std::memcpy(&record[random() % record.size()], &bits, 8);
    }
    auto file = SbetFile::open(write("a", records, random() % 136), "");
    if (!file.ok()) continue;
    double last = -1;
    for (auto record = file->next(); record.ok(); record = file->next()) {
      EXPECT_GT(record->second, last);
      last = record->second;
    }
    EXPECT_EQ(file->counts().records + file->counts().out_of_order + file->counts().impossible, records.size());
  }
}

std::string text_of(const std::vector<std::vector<double>>& records) {
  std::string out;
  for (const auto& record : records) out.append(reinterpret_cast<const char*>(record.data()), record.size() * 8);
  return out;
}

class SbetStream : public Sbet {
 protected:
  static test::Heard decode(const std::string& bytes, const SbetDecoder::Config& config, std::size_t at_once) {
    SbetDecoder decoder(config);
    return test::hear(decoder, test::bytes_of(bytes), at_once);
  }
};

TEST_F(SbetStream, RecordsBecomeSolutionsWithTheVelocityOfTheirPlaces) {
  std::vector<std::vector<double>> records;
  for (int i = 0; i < 50; ++i) {
    records.push_back(pose(604799.9 + 0.005 * i));
    records.back()[1] += 10.0 * 0.005 * i / 6'380'000;  // 10 m/s to the north, about
    records.back()[3] += 0.5 * 0.005 * i;
  }
  for (const std::size_t at_once : {1, 136, 4096}) {
    const auto heard = decode(text_of(records), {.week = 2400}, at_once);
    const auto solutions = heard.all<InsSolution>();
    ASSERT_EQ(solutions.size(), records.size());
    EXPECT_EQ(solutions[0].time, from_gps_week(2400, from_seconds(604799.9)));
    EXPECT_EQ(solutions[40].time, from_gps_week(2401, from_seconds(0.1)));
    for (const InsSolution& one : solutions) {
      EXPECT_NEAR(one.velocity_enu.y(), 10, 0.05);
      EXPECT_NEAR(one.velocity_enu.x(), 0, 1e-6);
      EXPECT_NEAR(one.velocity_enu.z(), 0.5, 1e-3);
      EXPECT_NEAR(one.attitude.heading, 0.9, 1e-12) << "platform heading 1 minus wander angle 0.1";
      EXPECT_TRUE(one.is_good);
    }
    EXPECT_EQ(heard.all<TimeLabel>().size(), 2u);
    EXPECT_EQ(heard.bytes(), records.size() * kSbetBytes);
    EXPECT_TRUE(heard.faults().empty());
  }
  using Heading = SbetDecoder::Heading;
  const auto plain = decode(text_of(records), {.week = 1, .is_utc = true, .heading = Heading::Platform}, 500);
  EXPECT_NEAR(plain.all<InsSolution>()[3].attitude.heading, 1.0, 1e-12);
  EXPECT_EQ(plain.all<InsSolution>()[0].time, from_gps_week(1, from_seconds(604799.9)) + utc_offset_from_table({}));
}

TEST_F(SbetStream, WhatIsNoRecordIsToldAndTheNextOnesAreRead) {
  const auto heard =
      decode(text_of({pose(10), pose(10.1), pose(10.2, 7.0), pose(10.3), pose(10.25), pose(10.4)}) + "abc", {}, 100);
  EXPECT_EQ(heard.all<InsSolution>().size(), 4u);
  EXPECT_EQ(heard.counts.malformed_bytes, kSbetBytes + 3);
  EXPECT_THAT(heard.faults(), testing::IsSupersetOf({FaultKind::NoTime, FaultKind::Malformed}));
  EXPECT_EQ(heard.bytes(), 6 * kSbetBytes + 3);
}

/// Nothing marks an SBET, and programs give it any name. Rows of KITTI's clouds and text were taken for trajectories at
/// latitude 0.
TEST_F(SbetStream, AFileIsRecognisedByRecordsThatCouldFollowOneAnother) {
  const auto is_beginning = [](const std::vector<std::vector<double>>& records) {
    return kSbet.files.log.is_beginning(text_of(records));
  };
  EXPECT_TRUE(is_beginning({pose(10), pose(10.005)}));
  EXPECT_TRUE(is_beginning({pose(10), pose(11, 0.8 + 30 / 6.4e6), pose(12, 0.8 + 60 / 6.4e6)}));
  EXPECT_FALSE(is_beginning({pose(10)}));
  EXPECT_FALSE(is_beginning({pose(10), pose(10)}));
  EXPECT_FALSE(is_beginning({pose(10), pose(10.005), pose(10.010, 0.8001)})) << "640 m in 5 ms";
  EXPECT_FALSE(is_beginning({pose(0, 0), pose(1e-60, 1e-70)}));
  EXPECT_FALSE(kSbet.files.log.is_beginning(std::string(280, '7')));
  std::string cloud;
  for (int i = 0; i < 200; ++i)
    for (const float value : {20.0F + 0.01F * static_cast<float>(i), 0.2F * static_cast<float>(i), 1.5F, 0.25F})
      cloud.append(reinterpret_cast<const char*>(&value), sizeof value);
  EXPECT_FALSE(kSbet.files.log.is_beginning(cloud));
}

}  // namespace
}  // namespace hueline::drivers
