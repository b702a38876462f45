// Real recordings compared with the clouds that another decoder (nebula) made of them, and packets made by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/hesai/hesai_angles.hpp"
#include "drivers/hesai/hesai_decoder.hpp"
#include "drivers/hesai/hesai_listener.hpp"
#include "drivers/hesai/hesai_wire.hpp"
#include "storage/pcd_reader.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::only;

/// Compares a quarter of the other decoder's cloud, in front and to the right, with the returns of the recording; its
/// axes are the same. The whole clouds are as near; they take a long time with sanitizers. The other decoder does not
/// let the head turn while the channels of a block fire, which is taken out of the returns before.
void compare(const std::string& name, HesaiModel model, const std::string& angles_file, std::size_t points,
             double expected_turn_deg) {
  const auto angles = read_beam_angles((test::data_dir() / "hesai" / angles_file).string());
  ASSERT_TRUE(angles.ok()) << angles.error().message;
  HesaiDecoder::Config config;
  config.model = model;
  config.elevations_deg = angles->elevations_deg;
  config.azimuths_deg = angles->azimuths_deg;
  ASSERT_TRUE(config.validate().empty()) << config.validate().text();
  const HesaiTable& table = hesai_table(model);
  std::vector<std::size_t> channel_of(table.beams.size());  // by ring
  for (std::size_t c = 0; c < channel_of.size(); ++c)
    channel_of[static_cast<std::size_t>(std::ranges::count_if(
        angles->elevations_deg, [&](double other) { return other < angles->elevations_deg[c]; }))] = c;
  HesaiDecoder decoder(config);
  const auto cell = [](double v) { return static_cast<int>(std::lround(v * 100)); };
  std::map<std::array<int, 3>, std::vector<LaserReturn>> returns;
  double largest_turn_deg = 0;
  for (const Packet& packet : test::capture_packets((test::data_dir() / "hesai" / (name + "_scans.pcap")).string())) {
    std::vector<Measurement> out;
    decoder.decode(packet, out);
    for (const Fault& fault : only<Fault>(out)) EXPECT_NE(fault.kind, FaultKind::Malformed) << fault.detail;
    const auto wire = decode_hesai(packet.bytes.bytes(), table);
    ASSERT_TRUE(wire.ok());
    for (const LaserBatch& batch : only<LaserBatch>(out))
      for (LaserReturn r : batch.returns) {
        const double turn_deg = wire->turns_per_min * 6e-9 * table.times[channel_of[r.channel]];
        largest_turn_deg = std::max(largest_turn_deg, std::abs(turn_deg));
        const double sine = std::sin(-turn_deg * kRadPerDeg), cosine = std::cos(-turn_deg * kRadPerDeg);
        const double x = r.x * cosine + r.y * sine, y = r.y * cosine - r.x * sine;
        r.x = static_cast<float>(x), r.y = static_cast<float>(y);
        if (r.x > 0 && r.y > 0) returns[{cell(r.x), cell(r.y), cell(r.z)}].push_back(r);
      }
  }
  EXPECT_NEAR(largest_turn_deg, expected_turn_deg, 0.001);
  const auto cloud = storage::read_pcd((test::data_dir() / "hesai" / (name + "_scans_expected.pcd")).string());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points(), points);
  const auto xs = cloud->column("x"), ys = cloud->column("y"), zs = cloud->column("z");
  std::map<int, double> largest_m;  // by return
  std::size_t compared = 0;
  for (std::size_t i = 0; i < xs.size(); ++i) {
    if (xs[i] < 0.02 || ys[i] < 0.02) continue;
    ++compared;
    double best_m = 1;
    int best_return = 0;
    for (int d = 0; d < 27; ++d) {
      const auto found = returns.find({cell(xs[i]) + d % 3 - 1, cell(ys[i]) + d / 3 % 3 - 1, cell(zs[i]) + d / 9 - 1});
      if (found == returns.end()) continue;
      for (const LaserReturn& r : found->second) {
        const double m = std::hypot(r.x - xs[i], r.y - ys[i], r.z - zs[i]);
        if (m < best_m) best_m = m, best_return = r.return_number;
      }
    }
    largest_m[best_return] = std::max(largest_m[best_return], best_m);
  }
  EXPECT_GT(compared, points / 8);
  for (const auto& [number, m] : largest_m) {
    std::printf("%s, return %d: largest difference %.6f m\n", name.c_str(), number, m);
    EXPECT_LT(m, 0.0001);
  }
}

TEST(HesaiCaptures, APandar40PEqualsTheCloudOfAnotherDecoder) {
  HUELINE_REQUIRE_DATA("hesai/40p_scans.pcap");
  compare("40p", HesaiModel::Pandar40P, "Pandar40P.csv", 56762, 0.1975);
}

TEST(HesaiCaptures, AnXt32EqualsTheCloudOfAnotherDecoder) {
  HUELINE_REQUIRE_DATA("hesai/xt32_scans.pcap");
  compare("xt32", HesaiModel::Xt32, "PandarXT32.csv", 63021, 0.1701);
}

TEST(HesaiCaptures, ACalibrationBesideTheCaptureIsFoundByItsName) {
  HUELINE_REQUIRE_DATA("hesai/xt32_scans.pcap");
  const auto found = find_hesai_angles(data_file.string(), hesai_table(HesaiModel::Xt32));
  ASSERT_TRUE(found);
  EXPECT_NE(found->file.find("PandarXT32.csv"), std::string::npos);
  EXPECT_FALSE(find_hesai_angles(data_file.string(), hesai_table(HesaiModel::Xt32m2)));
}

/// A packet of an XT32 whose returns of one kind all have the same distance.
test::Bytes xt32(unsigned mode, std::array<unsigned, 2> distances, std::uint32_t us, std::uint32_t sequence,
                 std::array<unsigned, 6> date = {123, 1, 11, 1, 2, 3}, unsigned turns_per_min = 600) {
  test::ByteWriter out(false);
  out.u8(0xEE).u8(0xFF).u8(6).u8(1).zeros(2).u8(32).u8(8).u8(1).u8(4).u8(1).u8(0);
  for (unsigned block = 0; block < 8; ++block) {
    out.u16(mode == 0x37 ? 9000 + 18 * block : 9000 + 18 * (block / 2));
    for (unsigned c = 0; c < 32; ++c) out.u16(distances[block % 2]).u8(10 + block % 2).u8(0);
  }
  out.zeros(10).u8(mode).u16(turns_per_min);
  for (const unsigned part : date) out.u8(part);
  return out.u32(us).u8(0x42).u32(sequence).bytes();
}

std::vector<Measurement> decode(HesaiDecoder& decoder, const test::Bytes& packet, std::int64_t received_ns = 0) {
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(packet, received_ns), out);
  return out;
}

HesaiDecoder::Config of_xt32() {
  HesaiDecoder::Config config;
  config.model = HesaiModel::Xt32;
  return config;
}

TEST(Hesai, AReturnHasTheTimeOfItsOwnFiring) {
  HesaiDecoder decoder(of_xt32());
  const auto batches = only<LaserBatch>(decode(decoder, xt32(0x37, {2500, 2500}, 500'000, 1)));
  ASSERT_EQ(batches.size(), 1u);
  ASSERT_EQ(batches[0].returns.size(), 256u);
  // The first block fires seven periods of 50 us before the last, which is 5.632 us after the packet's time.
  const auto second = *from_utc({.year = 2023, .month = 1, .day = 11, .hour = 1, .minute = 2, .second = 3});
  EXPECT_EQ(std::get<UnixTime>(batches[0].time),
            to_unix(second) + std::chrono::microseconds(500'000) + nanoseconds(5632 + 368 - 7 * 50'000));
  const LaserReturn& last = batches[0].returns.back();
  EXPECT_EQ(last.time_offset_ns, 7 * 50'000 + 31 * 1512);
  EXPECT_EQ(last.channel, 0) << "the last channel is the lowest";
  // It fires 47.24 us after the block's time. In these the head, at 600 turns a minute, goes on by 0.170064 degrees.
  constexpr double kAzimuth = (91.26 + 0.170064) * kRadPerDeg;
  EXPECT_NEAR(last.azimuth, kAzimuth, 1e-6);
  EXPECT_NEAR(last.x, 10 * std::cos(16 * kRadPerDeg) * std::sin(kAzimuth), 1e-5);
  EXPECT_NEAR(last.y, 10 * std::cos(16 * kRadPerDeg) * std::cos(kAzimuth), 1e-5);
  EXPECT_NEAR(last.z, -10 * std::sin(16 * kRadPerDeg), 1e-5);
}

TEST(Hesai, TwoReturnsAreCountedByRangeAndEqualOnesAreOne) {
  HesaiDecoder decoder(of_xt32());
  const auto both = only<LaserBatch>(decode(decoder, xt32(0x39, {2500, 1000}, 0, 1)));
  ASSERT_EQ(both.at(0).returns.size(), 256u);
  EXPECT_EQ(both[0].returns[0].return_number, 1);
  EXPECT_FLOAT_EQ(both[0].returns[0].range_m, 4);
  EXPECT_EQ(both[0].returns[0].reflectivity, 11);
  EXPECT_EQ(both[0].returns[1].return_number, 2);
  EXPECT_FLOAT_EQ(both[0].returns[1].range_m, 10);
  EXPECT_EQ(only<LaserBatch>(decode(decoder, xt32(0x39, {2500, 2500}, 0, 2))).at(0).returns.size(), 128u);
}

/// They tell why there is none: too near, or nothing came back.
TEST(Hesai, DistancesBelowFourStepsAreNoReturns) {
  HesaiDecoder::Config config = of_xt32();
  config.min_range_m = 0;
  HesaiDecoder decoder(config);
  for (const unsigned code : {0u, 1u, 2u, 3u}) {
    const auto batches = only<LaserBatch>(decode(decoder, xt32(0x39, {2500, code}, 1000 * code, code + 1)));
    ASSERT_EQ(batches.at(0).returns.size(), 128u) << code;
    EXPECT_FLOAT_EQ(batches[0].returns[0].range_m, 10);
    EXPECT_EQ(batches[0].returns[0].return_number, 1);
    EXPECT_EQ(batches[0].returns[0].return_count, 1);
    EXPECT_TRUE(only<LaserBatch>(decode(decoder, xt32(0x37, {code, code}, 1000 * code + 400, code + 100)))
                    .at(0)
                    .returns.empty());
  }
  EXPECT_EQ(only<LaserBatch>(decode(decoder, xt32(0x37, {4, 4}, 5000, 200))).at(0).returns.size(), 256u);
}

TEST(Hesai, WhatIsWrongIsSaid) {
  HesaiDecoder decoder(of_xt32());
  const auto kinds = [&](const test::Bytes& packet, std::int64_t received_ns) {
    std::vector<FaultKind> out;
    for (const Fault& fault : only<Fault>(decode(decoder, packet, received_ns))) out.push_back(fault.kind);
    return out;
  };
  using Kinds = std::vector<FaultKind>;
  EXPECT_EQ(kinds(xt32(0x37, {90, 90}, 0, 10), 0), Kinds{});
  EXPECT_EQ(kinds(xt32(0x37, {90, 90}, 400, 12), 400'000), Kinds{FaultKind::Lost});
  EXPECT_EQ(kinds(xt32(0x37, {90, 90}, 400, 12), 400'000), Kinds{FaultKind::Spurious});
  EXPECT_EQ(kinds(xt32(0x37, {90, 90}, 900'000, 13), 800'000), Kinds{FaultKind::ClockStep});
  EXPECT_EQ(kinds(xt32(0x36, {90, 90}, 0, 14), 0), Kinds{FaultKind::Malformed});
  EXPECT_EQ(kinds(xt32(0x37, {90, 90}, 0, 14, {0, 0, 0, 0, 0, 0}), 0), Kinds{FaultKind::NoTime});
  EXPECT_EQ(kinds(xt32(0x37, {90, 90}, 0, 14, {123, 1, 11, 1, 2, 3}, 4000), 0), Kinds{FaultKind::Malformed});
  EXPECT_EQ(kinds(test::Bytes(1000), 0), Kinds{FaultKind::Malformed});
  HesaiDecoder::Config other;
  other.model = HesaiModel::Pandar64;
  HesaiDecoder wrong(other);
  const auto faults = only<Fault>(decode(wrong, xt32(0x37, {90, 90}, 0, 1)));
  EXPECT_EQ(faults.at(0).kind, FaultKind::WrongDevice);
}

/// A file of as many beams of another model would bend the cloud by degrees without a word.
/// Both have 128 channels in two blocks.
TEST(Hesai, AnAt128IsNoQt128) {
  test::ByteWriter out(false);
  out.u8(0xEE).u8(0xFF).u8(3).u8(2).zeros(2).u8(128).u8(2).u8(1).u8(4).u8(2).u8(0).zeros(1106);
  test::Bytes packet = out.bytes();
  EXPECT_EQ(hesai_model(packet), HesaiModel::Qt128);
  packet[2] = std::byte{4};
  packet[3] = std::byte{3};
  EXPECT_FALSE(hesai_model(packet));
  const auto listener = listen_for_hesai("none.pcap");
  EXPECT_FALSE(listener->listen(test::packet_of(packet), "192.168.1.201"));
  EXPECT_NE(listener->unknown_models().find("a Hesai with 128 channels in 2 blocks, 1118 bytes, protocol 4.3"),
            std::string::npos)
      << listener->unknown_models();
}

/// A packet of 128 channels in two blocks with protocol 1.4; `status` is the version that tells the models apart. All
/// returns are at 10 m.
test::Bytes with_128_channels(unsigned status, unsigned operation, std::size_t behind = 4) {
  test::ByteWriter out(false);
  out.u8(0xEE).u8(0xFF).u8(1).u8(4).u8(status).u8(0).u8(128).u8(2).u8(1).u8(4).u8(1).u8(5);
  for (unsigned block = 0; block < 2; ++block) {
    out.u16(9000 + 20 * block);
    for (unsigned c = 0; c < 128; ++c) out.u16(2500).u8(10);
  }
  out.zeros(21).zeros(11).u8(operation).u8(0x37).u16(600);
  for (const unsigned part : {123u, 1u, 11u, 1u, 2u, 3u}) out.u8(part);
  return out.u32(500'000).u8(0x42).u32(1).zeros(behind).bytes();
}

/// Their packets differ in one byte, their beams by up to 12 degrees.
TEST(Hesai, APandar128IsNoOt128AndAJt128IsNeither) {
  EXPECT_EQ(hesai_model(with_128_channels(0, 2)), HesaiModel::Pandar128);
  EXPECT_EQ(hesai_model(with_128_channels(127, 2)), HesaiModel::Pandar128);
  EXPECT_EQ(hesai_model(with_128_channels(128, 2)), HesaiModel::Ot128);
  EXPECT_EQ(hesai_model(with_128_channels(136, 2)), HesaiModel::Ot128);
  const test::Bytes other = with_128_channels(137, 0);
  EXPECT_FALSE(hesai_model(other));
  const auto listener = listen_for_hesai("none.pcap");
  EXPECT_FALSE(listener->listen(test::packet_of(other), "192.168.1.201"));
  EXPECT_NE(listener->unknown_models().find("protocol 1.4 (JT128)"), std::string::npos) << listener->unknown_models();
  const auto heard = listener->listen(test::packet_of(with_128_channels(20, 2)), "192.168.1.201");
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->name, "hesai Pandar128");
}

TEST(Hesai, APandar128FiresByItsOwnTable) {
  HesaiDecoder::Config config;
  config.model = HesaiModel::Pandar128;
  HesaiDecoder decoder(config);
  const auto second = *from_utc({.year = 2023, .month = 1, .day = 11, .hour = 1, .minute = 2, .second = 3});
  const auto start = to_unix(second) + std::chrono::microseconds(500'000) + nanoseconds(3148);
  // Channel 27 looks to elevation 1.885, azimuth 7.72 degrees.
  constexpr std::size_t kChannel = 26;
  const auto expect_at = [&](const LaserBatch& batch, std::size_t block, nanoseconds time, double turn_deg) {
    ASSERT_EQ(batch.returns.size(), 256u);
    const LaserReturn& r = batch.returns[128 * block + kChannel];
    EXPECT_EQ(std::get<UnixTime>(batch.time) + nanoseconds(r.time_offset_ns), start + time);
    const double azimuth = (90 + 0.2 * static_cast<double>(block) + 7.72 + turn_deg) * kRadPerDeg;
    EXPECT_NEAR(r.x, 10 * std::cos(1.885 * kRadPerDeg) * std::sin(azimuth), 1e-5);
    EXPECT_NEAR(r.y, 10 * std::cos(1.885 * kRadPerDeg) * std::cos(azimuth), 1e-5);
    EXPECT_NEAR(r.z, 10 * std::sin(1.885 * kRadPerDeg), 1e-5);
  };
  // It fires 43.079 us after its block's time; the blocks are 55.556 us apart.
  auto batch = only<LaserBatch>(decode(decoder, with_128_channels(0, 2))).at(0);
  expect_at(batch, 0, nanoseconds(43'079 - 55'556), 0.155084);
  expect_at(batch, 1, nanoseconds(43'079), 0.155084);
  // In high resolution it fires within half of that.
  decoder.reset();
  batch = only<LaserBatch>(decode(decoder, with_128_channels(0, 0))).at(0);
  expect_at(batch, 0, nanoseconds(15'301 - 27'778), 0.055084);
  expect_at(batch, 1, nanoseconds(15'301), 0.055084);
}

TEST(Hesai, AnglesOfAnotherModelAreRefused) {
  HesaiDecoder::Config config = of_xt32();
  for (int i = 0; i < 32; ++i) {
    config.elevations_deg.push_back(15 - i + (i == 7 ? 1.4 : 0.1));
    config.azimuths_deg.push_back(-0.1);
  }
  EXPECT_TRUE(config.validate().empty()) << config.validate().text();
  for (int i = 0; i < 32; ++i) config.elevations_deg[static_cast<std::size_t>(i)] = 19.5 - 1.3 * i;
  const std::string wrong = config.validate().text();
  EXPECT_NE(wrong.find("not the directions of a PandarXT-32: channel 32 points to elevation -20.800"),
            std::string::npos)
      << wrong;
  EXPECT_NE(wrong.find("these fit the model XT32M2X"), std::string::npos) << wrong;
  config.model = HesaiModel::Xt32m2;
  EXPECT_TRUE(config.validate().empty()) << config.validate().text();
  config.azimuths_deg[3] = 1.6;
  EXPECT_FALSE(config.validate().empty());
}

test::Bytes gps(bool is_locked) {
  test::ByteWriter out(false);
  return out.u8(0xFF).u8(0xEE).zeros(504).u8('A').u8(is_locked ? 1 : 0).zeros(4).bytes();
}

TEST(Hesai, AClockIsTrustedOnlyIfItSaysThatItIsLocked) {
  const auto is_valid = [](HesaiDecoder& decoder, std::int64_t received_ns) {
    return only<TimeLabel>(decode(decoder, xt32(0x37, {90, 90}, 100, 1), received_ns)).at(0).is_valid;
  };
  HesaiDecoder silent(of_xt32()), locked(of_xt32()), unlocked(of_xt32()), late(of_xt32());
  EXPECT_FALSE(is_valid(silent, 0));
  EXPECT_EQ(only<LaserStatus>(decode(locked, gps(true))).at(0).clock, SyncState::Locked);
  EXPECT_TRUE(is_valid(locked, 1'000'000'000));
  EXPECT_EQ(only<LaserStatus>(decode(unlocked, gps(false))).at(0).clock, SyncState::Unlocked);
  EXPECT_FALSE(is_valid(unlocked, 1'000'000'000));
  decode(late, gps(true));
  EXPECT_FALSE(is_valid(late, 20'000'000'000)) << "the status is too old";
}

TEST(Hesai, PtpWithTaiIs37SecondsAheadOfUtc) {
  HesaiDecoder::Config config = of_xt32();
  config.reference = HesaiDecoder::Reference::PtpTai;
  HesaiDecoder decoder(config);
  const auto labels = only<TimeLabel>(decode(decoder, xt32(0x37, {90, 90}, 0, 1, {123, 1, 11, 1, 2, 40})));
  EXPECT_EQ(labels.at(0).second, *from_utc({.year = 2023, .month = 1, .day = 11, .hour = 1, .minute = 2, .second = 3}));
}

}  // namespace
}  // namespace hueline::drivers
