// VLP-32C and VLS-128: real recordings compared with the clouds that another decoder made of them, and packets made by
// hand for what the recordings do not have.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "core/angle.hpp"
#include "storage/pcd_reader.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::capture_packets;
using test::only;

double wrap_deg(double d) { return std::remainder(d, 360.0); }

/// One of this decoder's returns, with where the other decoder puts it.
struct Candidate {
  const LaserReturn* ours;
  double told_deg;
  bool is_matched = false;
};

/// How the other decoder (nebula) finds the azimuth of a firing; it rounds the result to 0.01 degrees. VLP-32C: it
/// turns from a block to the next as if the 32 lasers fired one after the other, 2.304 us each, although they fire in
/// pairs; it does not turn within the last block. VLS-128: it turns from each block to the next, although four blocks
/// are one sequence with one azimuth: so it turns within the fourth block of a sequence only, and not in the last.
double told_vlp32c(std::span<const std::byte> packet, int block, int laser, double offset_deg) {
  const auto azimuth = [&](int b) {
    return static_cast<int>(packet[100 * b + 2]) | static_cast<int>(packet[100 * b + 3]) << 8;
  };
  const double step = block < 11 ? (azimuth(block + 1) - azimuth(block) + 36000) % 36000 : 0;
  return (azimuth(block) + step * 2.304 / 55.296 * laser) / 100 + offset_deg;
}
double told_vls128(std::span<const std::byte> packet, int sequence, int laser, double offset_deg) {
  const auto azimuth = [&](int b) {
    return static_cast<int>(packet[100 * b + 2]) | static_cast<int>(packet[100 * b + 3]) << 8;
  };
  const int block = 4 * sequence + laser / 32, shot = laser / 8;
  const double step = block < 11 ? (azimuth(block + 1) - azimuth(block) + 36000) % 36000 : 0;
  return (azimuth(block) + step * 2.665 / 53.3 * (shot + shot / 8)) / 100 + offset_deg;
}

/// Returns the number of the first block whose azimuth is more than a degree from that of the block before.
int blocks_before_jump(std::span<const std::byte> packet) {
  const auto azimuth = [&](int b) {
    return static_cast<int>(packet[100 * b + 2]) | static_cast<int>(packet[100 * b + 3]) << 8;
  };
  int block = 1;
  while (block < 12 && (azimuth(block) - azimuth(block - 1) + 36000) % 36000 < 100) ++block;
  return block;
}

struct Largest {
  double azimuth_deg = 0, position_m = 0, told_deg = 0, range_m = 0;
  std::size_t points = 0, unmatched = 0;
};

Largest compare(const std::string& name, VelodyneModel model, int every,
                double (*told)(std::span<const std::byte>, int, int, double)) {
  const VelodyneTable& table = velodyne_table(model);
  const auto packets = capture_packets((test::data_dir() / ("velodyne/" + name + "_scans.pcap")).string());
  VelodyneDecoder::Config config;
  config.model = model;
  config.min_range_m = 0;
  VelodyneDecoder decoder(config);
  std::vector<Measurement> measured;
  for (const Packet& packet : packets) decoder.decode(packet, measured);
  decoder.flush(measured);
  const auto batches = only<LaserBatch>(measured);
  EXPECT_GE(batches.size(), packets.size());

  std::vector<int> laser_of_ring(static_cast<std::size_t>(table.count()));
  for (int laser = 0; laser < table.count(); ++laser) {
    const auto ring = std::ranges::count_if(table.lasers, [&](const VelodyneLaser& other) {
      return other.elevation_deg < table.lasers[static_cast<std::size_t>(laser)].elevation_deg;
    });
    laser_of_ring[static_cast<std::size_t>(ring)] = laser;
  }
  std::map<std::pair<int, int>, std::vector<Candidate>> candidates;
  for (const LaserBatch& batch : batches)
    for (const LaserReturn& r : batch.returns) {
      const auto packet = packets[batch.packet_sequence].bytes.bytes();
      // Blocks behind a jump of the azimuth, which the scanner's field of view makes, are a batch of their own.
      const bool is_behind = &batch != &batches.front() && (&batch)[-1].packet_sequence == batch.packet_sequence;
      if (r.channel % every != 0) continue;
      const int laser = laser_of_ring[r.channel];
      const int sequence = static_cast<int>(r.time_offset_ns / table.block_period().count()) +
                           (is_behind ? blocks_before_jump(packet) : 0);
      const double offset = table.lasers[static_cast<std::size_t>(laser)].azimuth_deg;
      const int steps = static_cast<int>(std::lround(r.range_m / table.range_step_m));
      candidates[{r.channel, steps}].push_back({&r, told(packet, sequence, laser, offset)});
    }

  const auto cloud = storage::read_pcd((test::data_dir() / ("velodyne/" + name + "_scans_expected.pcd")).string());
  EXPECT_TRUE(cloud.ok());
  const auto xs = cloud->column("x"), ys = cloud->column("y"), zs = cloud->column("z");
  Largest largest;
  for (std::size_t i = 0; i < xs.size(); ++i) {
    // Their axes are x forward, y left.
    const double x = -ys[i], y = xs[i], z = zs[i];
    const double range = std::sqrt(x * x + y * y + z * z), elevation = std::asin(z / range) / kRadPerDeg;
    const double azimuth = std::atan2(x, y) / kRadPerDeg;
    const auto elevation_of = [&](int laser) { return table.lasers[static_cast<std::size_t>(laser)].elevation_deg; };
    const auto next = std::ranges::lower_bound(laser_of_ring, elevation - 0.003, {}, elevation_of);
    const auto ring = static_cast<int>(next - laser_of_ring.begin());
    if (ring % every != 0) continue;
    Candidate* best = nullptr;
    double best_deg = 1e9;
    for (Candidate& c : candidates[{ring, static_cast<int>(std::lround(range / table.range_step_m))}]) {
      const double d = std::abs(wrap_deg(c.told_deg - azimuth));
      if (!c.is_matched && d < best_deg) best = &c, best_deg = d;
    }
    if (!best || best_deg > 1) {
      ++largest.unmatched;
      continue;
    }
    best->is_matched = true;
    ++largest.points;
    const LaserReturn& r = *best->ours;
    largest.azimuth_deg =
        std::max(largest.azimuth_deg, std::abs(wrap_deg(std::atan2(r.x, r.y) / kRadPerDeg - azimuth)));
    largest.position_m = std::max(largest.position_m, std::hypot(r.x - x, r.y - y, r.z - z));
    largest.told_deg = std::max(largest.told_deg, best_deg);
    largest.range_m = std::max(largest.range_m, std::abs(r.range_m - range));
  }
  std::printf(
      "%s: %zu of %zu points matched; largest difference as they stand %.4f deg, %.4f m; by its rule %.5f deg; of the "
      "range %.5f m\n",
      name.c_str(), largest.points, xs.size(), largest.azimuth_deg, largest.position_m, largest.told_deg,
      largest.range_m);
  return largest;
}

TEST(VelodyneModels, AVlp32cEqualsTheCloudOfAnotherDecoder) {
  HUELINE_REQUIRE_DATA("velodyne/vlp32_scans.pcap");
  const Largest l = compare("vlp32", VelodyneModel::Vlp32c, 1, told_vlp32c);
  EXPECT_EQ(l.unmatched, 0u);
  EXPECT_EQ(l.points, 26216u);
  EXPECT_LT(l.told_deg, 0.0052);  // it rounds to 0.01 deg
}

/// Every eighth ring, because it is a long test with sanitizers. All 208680 points are as near.
TEST(VelodyneModels, AVls128EqualsTheCloudOfAnotherDecoder) {
  HUELINE_REQUIRE_DATA("velodyne/vls128_scans.pcap");
  const Largest l = compare("vls128", VelodyneModel::Vls128, 8, told_vls128);
  EXPECT_EQ(l.unmatched, 0u);
  EXPECT_GT(l.points, 20000u);
  EXPECT_LT(l.told_deg, 0.0052);  // it rounds to 0.01 deg
}

/// A packet of a VLS-128 in dual-return mode: eight blocks are one sequence, the other four are empty.
test::Bytes dual_vls128(unsigned azimuth, std::uint32_t stamp_us) {
  test::VelodyneBlocksOfPacket blocks{};
  constexpr unsigned kFlags[] = {0xEEFF, 0xDDFF, 0xCCFF, 0xBBFF};
  for (std::size_t b = 0; b < 12; ++b) {
    blocks[b].flag = b < 8 ? kFlags[b / 2] : 0;
    blocks[b].azimuth = b < 8 ? azimuth : 0;
    for (auto& shot : blocks[b].shots)
      shot = b < 8 ? test::VelodyneShot{b % 2 ? 500u : 1000u, 7} : test::VelodyneShot{};
  }
  return test::velodyne_data(blocks, stamp_us, 0x39, 0xA1);
}

TEST(VelodyneModels, AVls128InDualReturnModeGivesBothReturnsOfASequence) {
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::Vls128;
  VelodyneDecoder decoder(config);
  std::vector<Measurement> out;
  for (unsigned i = 0; i < 5; ++i)
    decoder.decode(test::packet_of(dual_vls128(1000 + 20 * i, 1000 + 55 * i), 55'000 * i), out);
  EXPECT_TRUE(only<Fault>(out).empty());
  const auto batches = only<LaserBatch>(out);
  ASSERT_EQ(batches.size(), 5u);
  for (const LaserBatch& batch : batches) ASSERT_EQ(batch.returns.size(), 256u);
  const auto& returns = batches[4].returns;
  EXPECT_EQ(returns[0].range_m, 2);
  EXPECT_EQ(returns[0].return_number, 1);
  EXPECT_EQ(returns[1].range_m, 4);
  EXPECT_EQ(returns[1].return_number, 2);
  EXPECT_EQ(returns[1].return_count, 2);
  // The last lasers fire 17 periods after the first, and the mirror turned meanwhile as from packet to packet.
  EXPECT_EQ(returns[255].time_offset_ns - returns[0].time_offset_ns, 16 * 2665);
  EXPECT_NEAR(returns[254].azimuth / kRadPerDeg, 10.8 - 6.354 + 0.2 * 16 * 2.665 / 55, 0.0005);
  EXPECT_EQ(test::counter(batches[0].time), std::chrono::nanoseconds(1'000'000 - 8'700));
}

TEST(VelodyneModels, APuckHiResHasItsOwnElevations) {
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::PuckHiRes;
  VelodyneDecoder decoder(config);
  std::vector<Measurement> out;
  test::VelodyneBlocksOfPacket blocks{};
  for (unsigned b = 0; b < 12; ++b) {
    blocks[b].azimuth = 40 * b;
    for (auto& shot : blocks[b].shots) shot.distance = 5000;
  }
  for (std::uint32_t i = 0; i < 30; ++i)
    decoder.decode(test::packet_of(test::velodyne_data(blocks, 1327 * i, 0x37, 0x24), 1'327'000 * i), out);
  EXPECT_TRUE(only<Fault>(out).empty());
  const auto batches = only<LaserBatch>(out);
  for (const LaserReturn& r : batches.back().returns)
    EXPECT_NEAR(std::asin(r.z / r.range_m) / kRadPerDeg, -10 + r.channel * 4.0 / 3, 0.05);
}

}  // namespace
}  // namespace hueline::drivers
