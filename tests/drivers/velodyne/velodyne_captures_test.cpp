// Real recordings compared with independent truth: another decoder's cloud of a VLP-16 in dual-return mode, the GPS
// sentences that a VLP-16 repeated, and the geometry that an HDL-32E must have.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::capture_packets;
using test::only;

std::vector<Measurement> decode_all(VelodyneDecoder& decoder, const std::vector<Packet>& packets) {
  std::vector<Measurement> out;
  for (const Packet& packet : packets) decoder.decode(packet, out);
  return out;
}

double wrap_deg(double d) { return std::remainder(d, 360.0); }

/// A point of the other decoder's cloud.
struct Expected {
  float x, y, z;
  std::uint8_t reflectivity, return_type;
  std::uint16_t channel;
  float azimuth, elevation, distance;
  std::uint32_t time_ns;
};
static_assert(sizeof(Expected) == 32);

std::vector<Expected> read_cloud(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string all(std::istreambuf_iterator<char>(file), {});
  const std::string fields = "FIELDS x y z intensity return_type channel azimuth elevation distance time_stamp\n";
  const std::string data = "DATA binary\n";
  EXPECT_NE(all.find(fields), std::string::npos);
  const std::size_t begin = all.find(data) + data.size();
  std::vector<Expected> cloud((all.size() - begin) / sizeof(Expected));
  std::memcpy(cloud.data(), all.data() + begin, cloud.size() * sizeof(Expected));
  return cloud;
}

/// One of this decoder's returns, with what the raw packet says about it.
struct Candidate {
  const LaserReturn* ours;
  int block, shot;  // block: the even (last) or odd (strongest) one of its pair
  double told_deg;  // where the other decoder puts it
  double told_us;   // when it says it was, from the packet's start
  std::size_t packet;
  bool is_matched = false;
};

/// How the other decoder (nebula) computes azimuths and times in dual-return mode, found from its cloud. It walks
/// through the twelve blocks as if the successor of each were two blocks further, but takes the azimuth at the
/// beginning from one block before. So:
///  - even blocks 0-8 are interpolated to the next pair, as here, and rounded to 0.01 degrees;
///  - the last pair is not interpolated: each firing has the pair's own azimuth;
///  - odd blocks 1-9 (second returns) have the next pair's azimuth without interpolation: ahead of the truth by up to a
/// step.
/// Its times are those of the single-return table, although a pair is one firing: (block + its parity) * 55.296 us
/// late.
void tell(Candidate& c, std::span<const std::byte> packet) {
  const auto azimuth = [&](int block) {
    const std::byte* p = packet.data() + 100 * block + 2;
    return static_cast<int>(p[0]) | static_cast<int>(p[1]) << 8;
  };
  const double in_block_us = 55.296 * (c.shot / 16) + 2.304 * (c.shot % 16);
  const bool is_odd = c.block % 2 != 0;
  double counts = azimuth(c.block);
  if (is_odd && c.block < 11) counts = azimuth(c.block + 1);
  if (!is_odd && c.block < 10)
    counts = std::round(counts + (azimuth(c.block + 2) - azimuth(c.block) + 36000) % 36000 * in_block_us / 110.592);
  c.told_deg = std::fmod(counts, 36000) / 100;
  c.told_us = 110.592 * c.block + in_block_us;
}

struct Largest {
  double azimuth_deg = 0, position_m = 0, time_us = 0;
  std::size_t points = 0;
  void add(double deg, double m, double us) {
    azimuth_deg = std::max(azimuth_deg, std::abs(deg));
    position_m = std::max(position_m, std::abs(m));
    time_us = std::max(time_us, std::abs(us));
    ++points;
  }
};

TEST(VelodyneCaptures, ADualReturnRevolutionEqualsTheCloudOfAnotherDecoder) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_scans.pcap");
  const std::vector<Packet> packets = capture_packets(data_file.string());
  ASSERT_EQ(packets.size(), 603u);
  const std::vector<Expected> cloud = read_cloud(test::data_dir() / "velodyne/vlp16_scans_expected.pcd");
  ASSERT_EQ(cloud.size(), 14831u);
  VelodyneDecoder decoder({});
  const std::vector<Measurement> measurements = decode_all(decoder, packets);
  EXPECT_TRUE(only<Fault>(measurements).empty());
  const std::vector<LaserBatch> batches = only<LaserBatch>(measurements);
  ASSERT_EQ(batches.size(), 603u);

  // The revolution is the last whole one of the file. It is indexed by channel and by range in steps of 2 mm.
  constexpr std::size_t kFirst = 451;
  std::map<std::pair<int, int>, std::vector<Candidate>> candidates;
  for (std::size_t p = kFirst; p < packets.size(); ++p)
    for (const LaserReturn& r : batches[p].returns) {
      const std::span<const std::byte> bytes = packets[p].bytes.bytes();
      const int pair = r.time_offset_ns / 110'592, in_pair = r.time_offset_ns % 110'592;
      Candidate c{&r, 2 * pair, 16 * (in_pair / 55'296) + in_pair % 55'296 / 2'304, 0, 0, p};
      const int distance = static_cast<int>(std::lround(r.range_m / 0.002));
      const std::byte* even = bytes.data() + 100 * c.block + 4 + 3 * c.shot;
      if ((static_cast<int>(even[0]) | static_cast<int>(even[1]) << 8) != distance) ++c.block;
      tell(c, bytes);
      candidates[{r.channel, distance}].push_back(c);
    }

  Largest all, same_rule, last_pair, second_return, unexplained;
  double largest_z_m = 0;
  for (const Expected& e : cloud) {
    const double expected_deg = e.azimuth / kRadPerDeg, expected_us = e.time_ns * 1e-3;
    Candidate* best = nullptr;
    double best_distance = 1e9;
    for (Candidate& c : candidates[{e.channel, static_cast<int>(std::lround(e.distance / 0.002))}]) {
      if (c.is_matched || c.ours->reflectivity != e.reflectivity) continue;
      // Returns with the same range, channel and azimuth differ in time: they are of the two sequences of a block.
      const double d = std::abs(wrap_deg(c.told_deg - expected_deg)) + 1e-7 * std::abs(c.told_us - expected_us);
      if (d < best_distance) best = &c, best_distance = d;
    }
    ASSERT_NE(best, nullptr) << "no return of channel " << e.channel << " at " << e.distance << " m";
    best->is_matched = true;
    const LaserReturn& r = *best->ours;
    // Their axes are x forward, y left.
    const double dx = r.x + e.y, dy = r.y - e.x, dz = r.z - e.z;
    const double deg = wrap_deg(r.azimuth / kRadPerDeg - expected_deg), us = r.time_offset_ns * 1e-3 - expected_us;
    all.add(deg, std::sqrt(dx * dx + dy * dy + dz * dz), us);
    Largest& kind = best->block % 2 ? second_return : best->block == 10 ? last_pair : same_rule;
    kind.add(deg, std::hypot(dx, dy), us);

    // This decoder's return, moved to where the other decoder's rule puts it. The rest is not explained.
    const double in_plane = std::hypot(r.x, r.y);
    const double moved_x = in_plane * std::sin(best->told_deg * kRadPerDeg),
                 moved_y = in_plane * std::cos(best->told_deg * kRadPerDeg);
    const double elevation = std::round(std::asin(e.z / e.distance) / kRadPerDeg);
    largest_z_m = std::max(largest_z_m, std::abs(dz));
    unexplained.add(wrap_deg(best->told_deg - expected_deg),
                    std::hypot(std::hypot(moved_x + e.y, moved_y - e.x),
                               static_cast<double>(r.range_m) * std::sin(elevation * kRadPerDeg) - e.z),
                    best->told_us - expected_us);
    EXPECT_EQ(r.channel, std::lround((elevation + 15) / 2));
  }
  const auto print = [](const char* what, const Largest& l) {
    std::printf("  %-46s %6zu points: azimuth %.5f deg, position %.5f m, time %.3f us\n", what, l.points, l.azimuth_deg,
                l.position_m, l.time_us);
  };
  std::printf("largest differences to the other decoder's cloud:\n");
  print("as they stand", all);
  print("same rule (even blocks 0-8), in plane", same_rule);
  print("last pair, which it does not interpolate", last_pair);
  print("second returns, which it gives the next azimuth", second_return);
  print("with its rules and without vertical offsets", unexplained);
  std::printf("  its z has no vertical offsets of the lasers: up to %.4f m\n", largest_z_m);

  EXPECT_LT(same_rule.azimuth_deg, 0.0051);    // it rounds to 0.01 deg
  EXPECT_LT(unexplained.azimuth_deg, 0.0001);  // float
  EXPECT_LT(unexplained.position_m, 0.0001);   // float tables
  EXPECT_LT(unexplained.time_us, 0.25);        // it goes through a double of seconds since 1970: steps of 0.24 us
  EXPECT_LT(largest_z_m, 0.01125);             // manual, table 9-1: 11.2 mm

  // No return is missing in the other cloud. It cuts the revolution by azimuth inside its first and last packet.
  std::size_t missing = 0;
  for (const auto& [key, list] : candidates)
    for (const Candidate& c : list)
      if (!c.is_matched && c.packet > kFirst && c.packet + 1 < packets.size()) ++missing;
  EXPECT_EQ(missing, 0u);
}

TEST(VelodyneCaptures, DualReturnPacketsFollowEachOtherAsTheTimingTableSays) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_scans.pcap");
  VelodyneDecoder decoder({});
  const std::vector<LaserBatch> batches = only<LaserBatch>(decode_all(decoder, capture_packets(data_file.string())));
  // A packet has six pairs of 110.592 us. The mean step of the stamps is an independent measurement of the firing
  // table.
  const double mean_us = to_seconds(test::counter(batches.back().time) - test::counter(batches.front().time)) * 1e6 /
                         static_cast<double>(batches.size() - 1);
  std::printf("mean step of the stamps %.4f us, table %.4f us\n", mean_us, 6 * 110.592);
  EXPECT_NEAR(mean_us, 6 * 110.592, 0.01);
  // From packet to packet the azimuth continues where the last block was extended to: at the first firing of the next
  // packet.
  double largest_deg = 0;
  for (std::size_t i = 0; i + 1 < batches.size(); ++i) {
    const auto &a = batches[i].returns, &b = batches[i + 1].returns;
    if (a.empty() || b.empty()) continue;
    const double elapsed_us = to_seconds(test::counter(batches[i + 1].time) - test::counter(batches[i].time)) * 1e6 +
                              (b.front().time_offset_ns - a.back().time_offset_ns) * 1e-3;
    const double turned_deg = wrap_deg((b.front().azimuth - a.back().azimuth) / kRadPerDeg);
    largest_deg = std::max(largest_deg, std::abs(turned_deg - elapsed_us * 1e-6 * 3600));
  }
  std::printf("largest misfit of the azimuth from packet to packet at 10 revolutions a second: %.4f deg\n",
              largest_deg);
  EXPECT_LT(largest_deg, 0.05);
}

/// A capture as VeloView saves it: position packets with a wrong IP length, and the factory byte of an HDL-32E.
TEST(VelodyneCaptures, AVlp16OfOldFirmwareIsDecodedWhole) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_product_21.pcap");
  const auto packets = test::capture_packets(data_file.string());
  ASSERT_EQ(packets.size(), 100u);
  VelodyneDecoder decoder({});
  std::vector<Measurement> out;
  for (const Packet& packet : packets) decoder.decode(packet, out);
  decoder.flush(out);
  EXPECT_EQ(test::only<LaserBatch>(out).size(), 84u);
  EXPECT_EQ(test::only<LaserStatus>(out).size(), 16u);
  std::size_t returns = 0;
  for (const LaserBatch& batch : test::only<LaserBatch>(out)) returns += batch.returns.size();
  EXPECT_EQ(returns, 19579u);
  EXPECT_TRUE(test::only<Fault>(out).empty());
}

TEST(VelodyneCaptures, AVlp16WithGpsIsLockedAndNamesItsSecond) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  VelodyneDecoder decoder({});
  const std::vector<Packet> packets = capture_packets(data_file.string());
  const std::vector<Measurement> measurements = decode_all(decoder, packets);
  for (const Fault& fault : only<Fault>(measurements)) ADD_FAILURE() << name(fault.kind) << " " << fault.detail;
  const auto batches = only<LaserBatch>(measurements);
  const auto status = only<LaserStatus>(measurements);
  const auto labels = only<TimeLabel>(measurements);
  ASSERT_EQ(batches.size(), 293u);
  ASSERT_EQ(status.size(), 57u);
  for (const LaserStatus& s : status) {
    EXPECT_EQ(s.clock, SyncState::Locked);
    EXPECT_EQ(s.words, "PPS locked, RMC valid");
    // Data and position packets have the same counter, so a position packet is at most two data packets from those that
    // arrived next to it.
    double nearest_s = 1;
    for (const LaserBatch& b : batches)
      nearest_s = std::min(nearest_s, std::abs(to_seconds(test::counter(b.time) - test::counter(*s.time))));
    EXPECT_LT(nearest_s, 0.003);
  }
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_TRUE(labels[0].is_valid);
  EXPECT_EQ(iso_utc(labels[0].second), "2016-01-21T08:18:02.000Z");
  // There were 17 leap seconds then: GPS time of week of Thursday 08:18:19.
  EXPECT_EQ(to_gps_week(labels[0].second).week, 1880);
  EXPECT_EQ(to_gps_week(labels[0].second).time_of_week, std::chrono::seconds(4 * 86400 + 8 * 3600 + 18 * 60 + 2 + 17));
  EXPECT_EQ(decoder.counts().decoded_bytes, 293u * 1206 + 57u * 512);
  EXPECT_EQ(decoder.counts().malformed_bytes, 0u);
}

TEST(VelodyneCaptures, AnHdl32eTurnsEvenlyAndSeesPlausibleRanges) {
  HUELINE_REQUIRE_DATA("velodyne/hdl32e.pcap");
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::Hdl32e;
  VelodyneDecoder decoder(config);
  const std::vector<Packet> packets = capture_packets(data_file.string());
  const std::vector<Measurement> measurements = decode_all(decoder, packets);
  for (const Fault& fault : only<Fault>(measurements)) ADD_FAILURE() << name(fault.kind) << " " << fault.detail;
  const auto batches = only<LaserBatch>(measurements);
  ASSERT_EQ(batches.size(), 500u);
  const double mean_us =
      to_seconds(test::counter(batches.back().time) - test::counter(batches.front().time)) * 1e6 / 499;
  std::printf("mean step of the stamps %.4f us, table %.4f us\n", mean_us, 12 * 46.08);
  EXPECT_NEAR(mean_us, 12 * 46.08, 0.1);

  std::map<int, std::size_t> found, raw;
  for (const Packet& packet : packets)
    for (std::size_t i = 0; i < 12 * 32; ++i) {
      const std::byte* shot = packet.bytes.data() + 100 * (i / 32) + 4 + 3 * (i % 32);
      const int steps = static_cast<int>(shot[0]) | static_cast<int>(shot[1]) << 8;
      const int laser = static_cast<int>(i % 32);
      if (steps >= 250 && steps <= 65000) ++raw[laser % 2 ? 16 + laser / 2 : laser / 2];
    }
  std::size_t number = 0;
  double turned_deg = 0, before_deg = -1;
  for (const LaserBatch& batch : batches)
    for (const LaserReturn& r : batch.returns) {
      ++number;
      ++found[r.channel];
      EXPECT_NEAR(std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z), r.range_m, 1e-4);
      EXPECT_NEAR(std::atan2(r.z, std::hypot(r.x, r.y)) / kRadPerDeg, -30.67 + r.channel * 4.0 / 3, 0.02);
      EXPECT_NEAR(wrap_deg((std::atan2(r.x, r.y) - r.azimuth) / kRadPerDeg), 0, 0.001);
      const double deg = r.azimuth / kRadPerDeg;
      if (before_deg >= 0) {
        EXPECT_GT(wrap_deg(deg - before_deg), -0.02);  // the encoder's own resolution is 0.01
        turned_deg += wrap_deg(deg - before_deg);
      }
      before_deg = deg;
    }
  EXPECT_EQ(found, raw);
  EXPECT_EQ(found.size(), 31u);  // laser 11 of this unit is dead: no echo in any of its 6000 firings
  EXPECT_GT(number, 100'000u);
  const double revolutions_per_s =
      turned_deg / 360 / to_seconds(test::counter(batches.back().time) - test::counter(batches.front().time));
  std::printf("%zu returns, %.3f revolutions a second\n", number, revolutions_per_s);
  EXPECT_NEAR(revolutions_per_s, std::round(revolutions_per_s), 0.2);
}

}  // namespace
}  // namespace hueline::drivers
