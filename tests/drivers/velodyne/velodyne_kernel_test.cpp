// The kernel beside a plain computation of the same returns, one after the other, on random packets.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "drivers/velodyne/velodyne_kernel.hpp"
#include "tests/drivers/same_returns.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/each_instruction_set.hpp"

namespace hueline::drivers {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kCircle = 36000;
constexpr std::array<unsigned, 4> kFlags{0xEEFF, 0xDDFF, 0xCCFF, 0xBBFF};

class Plain {
 public:
  explicit Plain(const VelodyneDecoder::Config& config) : config_(config), table_(velodyne_table(config.model)) {}

  std::vector<LaserReturn> returns, behind;

  void decode(const test::VelodyneBlocksOfPacket& blocks, bool is_dual, double turn_rate) {
    returns.clear();
    behind.clear();
    const int copies = is_dual ? 2 : 1, together = table_.banks() * copies, units = 12 / together;
    const auto at = [&](int i) -> const test::VelodyneBlock& { return blocks[static_cast<std::size_t>(i)]; };
    const auto bank_of = [&](int i) { return i % together / copies; };
    const auto is_sound = [&](int i) {
      return at(i).flag == kFlags[static_cast<std::size_t>(bank_of(i))] && at(i).azimuth < kCircle;
    };
    // The azimuth of a unit is that of its first good block.
    std::vector<std::optional<int>> azimuths(static_cast<std::size_t>(units));
    std::array<bool, 12> is_good{};
    for (int i = 0; i < units * together; i += copies) {
      auto& azimuth = azimuths[static_cast<std::size_t>(i / together)];
      const int own = static_cast<int>(at(i).azimuth);
      if (!is_sound(i) || (azimuth && *azimuth != own)) continue;
      if (is_dual && (!is_sound(i + 1) || at(i + 1).azimuth != at(i).azimuth)) continue;
      azimuth = own;
      is_good[static_cast<std::size_t>(i)] = true;
    }
    std::vector<std::optional<int>> steps(static_cast<std::size_t>(units));
    std::vector<int> jumps;
    int sum = 0, number = 0;
    for (std::size_t u = 0; u + 1 < steps.size() && jumps.size() < 2; ++u) {
      if (!azimuths[u] || !azimuths[u + 1]) continue;
      const int step = (*azimuths[u + 1] - *azimuths[u] + kCircle + kCircle / 2) % kCircle - kCircle / 2;
      if (step < -20 || step > static_cast<int>(40.0 * kCircle * to_seconds(table_.block_period()))) {
        jumps.push_back(static_cast<int>(u) + 1);
        continue;
      }
      steps[u] = step;
      sum += step;
      ++number;
    }
    const float mean = number      ? static_cast<float>(sum) / static_cast<float>(number)
                       : units > 1 ? 0.0f
                                   : static_cast<float>(turn_rate * to_seconds(table_.block_period()));
    for (int i = 0; i < units * together; i += copies) {
      const int u = i / together;
      if (!is_good[static_cast<std::size_t>(i)] || (jumps.size() == 2 && u >= jumps[1])) continue;
      const bool is_behind = !jumps.empty() && u >= jumps[0];
      const int since = is_behind ? u - jumps[0] : u;
      const auto& step = steps[static_cast<std::size_t>(u)];
      for (int f = 0; f < kVelodyneFiringsPerBlock; ++f)
        add(at(i), is_dual ? &at(i + 1) : nullptr, bank_of(i) * kVelodyneFiringsPerBlock + f, f,
            static_cast<std::int32_t>(table_.block_period().count()) * since, step ? static_cast<float>(*step) : mean,
            is_behind ? behind : returns);
    }
  }

 private:
  /// Adds the returns of one firing.
  void add(const test::VelodyneBlock& block, const test::VelodyneBlock* strongest, int firing, int in_block,
           std::int32_t block_ns, float step, std::vector<LaserReturn>& out) const {
    std::vector<test::VelodyneShot> shots{block.shots[static_cast<std::size_t>(in_block)]};
    bool is_last_far = false;
    if (strongest) {
      const test::VelodyneShot other = strongest->shots[static_cast<std::size_t>(in_block)];
      is_last_far = shots[0].distance > other.distance;
      if (shots[0].distance == 0)
        shots[0] = other;
      else if (other.distance != 0 && other.distance != shots[0].distance)
        shots.insert(is_last_far ? shots.begin() : shots.end(), other);
    }
    const int laser = firing % table_.count();
    const VelodyneLaser& l = table_.lasers[static_cast<std::size_t>(laser)];
    const auto offset = table_.sequence_period * (firing / table_.count()) + table_.firing_time(laser);
    const auto sine = [](double angle) { return static_cast<float>(portable::sin(angle)); };
    const auto cosine = [](double angle) { return static_cast<float>(portable::cos(angle)); };
    const double elevation = l.elevation_deg * kPi / 180, own = l.azimuth_deg * kPi / 180;
    const double head = 2 * kPi * static_cast<int>(block.azimuth) / kCircle;

    constexpr auto kTurn = static_cast<float>(2 * kPi), kRadPerCount = static_cast<float>(2 * kPi / kCircle);
    const float turn = step * kRadPerCount * static_cast<float>(to_seconds(offset) / to_seconds(table_.block_period()));
    const float turn2 = turn * turn, sin_turn = turn - turn * turn2 / 6.0f, cos_turn = 1.0f - turn2 / 2.0f;
    const float s = sine(own) * cos_turn + cosine(own) * sin_turn, c = cosine(own) * cos_turn - sine(own) * sin_turn;
    float azimuth = static_cast<float>(block.azimuth) * kRadPerCount + static_cast<float>(own) + turn;
    if (azimuth < 0) azimuth += kTurn;
    if (azimuth >= kTurn) azimuth -= kTurn;
    double window = config_.azimuth_end - config_.azimuth_begin;
    if (window < 0) window += 2 * kPi;
    float past = azimuth - static_cast<float>(config_.azimuth_begin);
    if (past < 0) past += kTurn;
    if (window < 2 * kPi - 1e-9 && past > static_cast<float>(window)) return;

    const auto range_step = static_cast<float>(table_.range_step_m);
    const bool is_near_stronger =
        shots.size() == 2 && (shots[0].reflectivity > shots[1].reflectivity ||
                              (shots[0].reflectivity == shots[1].reflectivity && is_last_far));
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const double metres = shots[i].distance * table_.range_step_m;
      if (shots[i].distance == 0 || metres < config_.min_range_m - 1e-9 ||
          metres > config_.max_range_m.value_or(1e9) + 1e-9)
        continue;
      if (shots.size() == 2 && config_.returns == ReturnChoice::Strongest && (i == 0) != is_near_stronger) continue;
      if (shots.size() == 2 && config_.returns == ReturnChoice::Last && (i == 1) != is_last_far) continue;
      LaserReturn& made = out.emplace_back();
      made.range_m = static_cast<float>(shots[i].distance) * range_step;
      made.x = made.range_m * (cosine(elevation) * (sine(head) * c + cosine(head) * s));
      made.y = made.range_m * (cosine(elevation) * (cosine(head) * c - sine(head) * s));
      made.z = made.range_m * sine(elevation) + static_cast<float>(l.vertical_offset_mm * 1e-3);
      made.azimuth = azimuth;
      made.time_offset_ns = block_ns + static_cast<std::int32_t>(offset.count());
      made.channel = static_cast<std::uint16_t>(std::ranges::count_if(
          table_.lasers, [&](const VelodyneLaser& o) { return o.elevation_deg < l.elevation_deg; }));
      made.reflectivity = static_cast<std::uint8_t>(shots[i].reflectivity);
      made.return_number = static_cast<std::uint8_t>(i + 1);
      made.return_count = static_cast<std::uint8_t>(shots.size());
    }
  }

  VelodyneDecoder::Config config_;
  const VelodyneTable& table_;
};

/// A packet as a scanner that turns may send it: the azimuth passes north, jumps now and then, and some blocks are
/// broken.
test::VelodyneBlocksOfPacket random_packet(test::RandomPackets& random, int banks, bool is_dual) {
  test::VelodyneBlocksOfPacket blocks;
  const unsigned together = static_cast<unsigned>(banks) * (is_dual ? 2 : 1);
  const unsigned usual = random.below(90);
  unsigned azimuth = random.one_in(3) ? 35900 + random.below(100) : random.below(kCircle);
  for (unsigned b = 0; b < 12; ++b) {
    test::VelodyneBlock& block = blocks[b];
    if (b > 0 && b % together == 0)
      azimuth = (azimuth + (random.one_in(20) ? random.below(kCircle) : usual + random.below(3))) % kCircle;
    block.azimuth = random.one_in(60) ? random.below(0x10000) : azimuth;
    block.flag = random.one_in(60) ? random.below(0x10000) : kFlags[b % together / (is_dual ? 2 : 1)];
    unsigned before = 1000;
    for (std::size_t f = 0; f < block.shots.size(); ++f) {
      if (is_dual && b % 2 == 1) before = blocks[b - 1].shots[f].distance;
      block.shots[f] = {random.distance(before), random.one_in(2) ? 7 : random.below(256)};
      before = block.shots[f].distance;
    }
  }
  return blocks;
}

TEST(VelodyneKernel, MakesTheReturnsOfAPlainComputationToTheLastBit) {
  test::with_each_instruction_set([] {
    test::RandomPackets random(11);
    std::size_t compared = 0, compared_behind = 0;
    for (const VelodyneModel model : kVelodyneModels)
      for (const ReturnChoice choice : {ReturnChoice::All, ReturnChoice::Strongest, ReturnChoice::Last})
        for (const bool is_limited : {false, true}) {
          VelodyneDecoder::Config config;
          config.model = model;
          config.returns = choice;
          if (is_limited) {
            config.max_range_m = 90;
            config.azimuth_begin = 5;
            config.azimuth_end = 2;
          }
          VelodyneKernel kernel(config);
          Plain plain(config);
          std::vector<LaserReturn> returns;
          for (int i = 0; i < 60; ++i) {
            const bool is_dual = i % 2 == 1;
            const auto packet = random_packet(random, velodyne_table(model).banks(), is_dual);
            const double turn_rate = 360000.0 + random.below(1000);
            const test::Bytes bytes = test::velodyne_data(packet, random.below(1'000'000), is_dual ? 0x39 : 0x37, 0);
            kernel.decode(bytes, is_dual, turn_rate, returns);
            plain.decode(packet, is_dual, turn_rate);
            test::expect_same(returns, plain.returns);
            test::expect_same(kernel.behind(), plain.behind);
            compared += returns.size();
            compared_behind += kernel.behind().size();
            if (testing::Test::HasFatalFailure()) return;
          }
        }
    EXPECT_GT(compared, 100'000u);
    EXPECT_GT(compared_behind, 5'000u);
  });
}

}  // namespace
}  // namespace hueline::drivers
