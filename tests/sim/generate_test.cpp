#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "sim/generate.hpp"
#include "sim/rig_truth.hpp"
#include "sim/truth_file.hpp"
#include "sim/vehicle.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

std::string content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::vector<TrueReturn>> all_truth(const std::string& path, TruthHeader* header = nullptr) {
  auto reader = TruthReader::open(path);
  EXPECT_TRUE(reader.ok()) << (reader.ok() ? "" : reader.error().message);
  std::vector<std::vector<TrueReturn>> packets;
  if (!reader.ok()) return packets;
  if (header) *header = reader->header();
  for (;;) {
    auto next = reader->next_packet();
    if (!next.ok()) {
      EXPECT_EQ(next.error().code, ErrorCode::EndOfData);
      return packets;
    }
    packets.push_back(std::move(*next));
  }
}

TEST(Generate, SameBytesForOneThreadAndThree) {
  const TemporaryFolder one("hueline-gen1"), three("hueline-gen3");
  const Scenario scenario = small_scenario();
  const auto a = generate(scenario, one.path(), {}, {.threads = 1, .stop = {}});
  ASSERT_TRUE(a.ok()) << a.error().message;
  const auto b = generate(scenario, three.path(), {}, {.threads = 3, .stop = {}});
  ASSERT_TRUE(b.ok());
  for (const std::string file : {"drive.bin", "truth.bin", "images/000000.raw", "images/000001.raw"}) {
    const std::string left = content(a->cache_dir + "/" + file);
    EXPECT_GT(left.size(), 1000u) << file;
    EXPECT_EQ(left, content(b->cache_dir + "/" + file)) << file;
  }
  EXPECT_EQ(a->exposures.size(), 2u);
  EXPECT_EQ(a->exposures[0].width, 3 * 76u);
  EXPECT_EQ(content(a->cache_dir + "/" + a->exposures[0].image_file).size(), 3u * 76 * 2 * 64);
  // The drive is found in the cache. Nothing is rendered, so no progress is reported.
  int calls = 0;
  const auto again = generate(scenario, one.path(), [&](const std::string&, double) { ++calls; });
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(again->laser.size(), a->laser.size());
  EXPECT_EQ(again->ins.back().gps_ns, a->end_gps_ns);
}

TEST(Generate, StopsLeavingNothing) {
  const TemporaryFolder folder("hueline-genstop");
  std::stop_source stop;
  stop.request_stop();
  const auto drive = generate(small_scenario(), folder.path(), {}, {.threads = 1, .stop = stop.get_token()});
  ASSERT_FALSE(drive.ok());
  EXPECT_EQ(drive.error().code, ErrorCode::Stopped);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Generate, RefusesABadScenarioAndAnUnwritableCache) {
  Scenario scenario = small_scenario();
  scenario.camera.stack_columns = 1;
  EXPECT_EQ(generate(scenario, "/tmp").error().code, ErrorCode::Invalid);
  const auto refused = generate(small_scenario(), "/proc/no/such");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::Io);
}

TEST(Generate, BrokenFilesAreErrors) {
  const TemporaryFolder folder("hueline-genbroken");
  Scenario scenario = small_scenario();
  scenario.duration_s = 0.5;
  scenario.camera.first_exposure_s = 0.1;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok());
  const std::string whole = content(drive->cache_dir + "/truth.bin"), path = folder.path() + "/cut.bin";
  for (const std::size_t size : {0ul, 5ul, 40ul, 900ul, whole.size() - 7}) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    auto reader = TruthReader::open(path);
    bool failed = !reader.ok();
    while (!failed) {
      const auto next = reader->next_packet();
      if (!next.ok()) {
        EXPECT_EQ(next.error().code, ErrorCode::Malformed) << size;
        failed = true;
      }
    }
    EXPECT_TRUE(failed);
  }
  std::ofstream(drive->cache_dir + "/drive.bin", std::ios::binary | std::ios::app) << "more";
  EXPECT_EQ(generate(scenario, folder.path()).error().code, ErrorCode::Malformed);
}

/// Computes each point again from the numbers on the wire and the true pose only, by the formula of the manual.
void check_packets(LaserModel model, std::int64_t firing_ns, std::int64_t laser_ns, int firings, int step) {
  const TemporaryFolder folder("hueline-genlaser");
  Scenario scenario = small_scenario();
  scenario.noise = false;
  scenario.laser.model = model;
  scenario.laser.vertical_offsets = false;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok());
  const auto truth = all_truth(drive->cache_dir + "/truth.bin");
  ASSERT_EQ(truth.size(), drive->laser.size());
  const Motion motion(scenario);
  const RigTruth rig = rig_truth(scenario);
  const LaserTiming timing = laser_timing(model, false);
  const auto lasers = static_cast<std::int64_t>(timing.beams.size());
  double worst = 0, worst_range = 0;
  std::size_t returns = 0;
  for (std::size_t i = 0; i < truth.size(); i += 37) {
    const LaserPacket& packet = drive->laser[i];
    EXPECT_EQ(packet.first_firing_gps_ns,
              scenario.sensors_begin_gps_ns() + static_cast<GpsNs>(i) * 12 * firings * firing_ns);
    const std::int64_t first_block = static_cast<std::int64_t>(i) * 12;
    std::size_t found = 0;
    for (std::int64_t slot = 0; slot < 384; ++slot) {
      const std::int64_t block = slot / 32, sequence = slot % 32 / lasers, laser = slot % lasers;
      EXPECT_EQ(packet.azimuth_centideg[static_cast<std::size_t>(block)], (first_block + block) * step % 36000);
      if (packet.distance_2mm[static_cast<std::size_t>(slot)] == 0) continue;
      const TrueReturn& t = truth[i].at(found++);
      const GpsNs fired = packet.first_firing_gps_ns + (block * firings + sequence) * firing_ns + laser * laser_ns;
      ASSERT_EQ(t.fired_gps_ns, fired);
      const auto after = static_cast<double>(sequence * firing_ns + laser * laser_ns);
      const double az = radians((static_cast<double>(packet.azimuth_centideg[static_cast<std::size_t>(block)]) +
                                 step * after / static_cast<double>(firings * firing_ns)) /
                                100);
      const double el = timing.beams[static_cast<std::size_t>(laser)].elevation;
      const double d = 0.002 * packet.distance_2mm[static_cast<std::size_t>(slot)];
      const Vec3 p =
          motion.T_enu_body(fired) *
          (rig.T_body_scanner * (d * Vec3{std::cos(el) * std::sin(az), std::cos(el) * std::cos(az), std::sin(el)}));
      worst = std::max(worst, length(p - Vec3{t.beam_east, t.beam_north, t.beam_up}));
      // The true hit is on the beam, at most half a unit of the wire away.
      worst_range = std::max(worst_range, length(Vec3{t.east - t.beam_east, t.north - t.beam_north, t.up - t.beam_up}));
    }
    EXPECT_EQ(found, truth[i].size());
    returns += found;
  }
  EXPECT_GT(returns, 1000u);
  EXPECT_LT(worst, 2e-6);
  EXPECT_LT(worst_range, 0.001 + 2e-6);
}

TEST(Generate, Vlp16PacketsAreExactButForTheWire) { check_packets(LaserModel::Vlp16, 55'296, 2'304, 2, 40); }
TEST(Generate, Hdl32ePacketsAreExactButForTheWire) { check_packets(LaserModel::Hdl32e, 46'080, 1'152, 1, 17); }

TEST(Generate, LaserNoiseHasItsSize) {
  const TemporaryFolder folder("hueline-gennoise");
  Scenario scenario = small_scenario();
  scenario.laser.dropout_probability = 0.05;
  scenario.laser.range_sigma_m = 0.02;
  const auto noisy = generate(scenario, folder.path());
  ASSERT_TRUE(noisy.ok());
  std::size_t count = 0;
  double sum = 0, sum2 = 0;
  for (const auto& packet : all_truth(noisy->cache_dir + "/truth.bin"))
    for (const TrueReturn& t : packet) {
      const double d = length(Vec3{t.east - t.beam_east, t.north - t.beam_north, t.up - t.beam_up});
      sum += d;
      sum2 += d * d;
      ++count;
    }
  const auto n = static_cast<double>(count);
  EXPECT_NEAR(std::sqrt(sum2 / n), 0.02, 0.0005);
  EXPECT_NEAR(sum / n, 0.02 * std::sqrt(2 / kPi), 0.0005);  // the mean of a half-normal distribution
  scenario.noise = false;
  const auto quiet = generate(scenario, folder.path());
  ASSERT_TRUE(quiet.ok());
  std::size_t all = 0;
  for (const auto& packet : all_truth(quiet->cache_dir + "/truth.bin")) all += packet.size();
  EXPECT_NEAR(n / static_cast<double>(all), 0.95, 0.005);
}

}  // namespace
}  // namespace hueline::sim
