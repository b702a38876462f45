// The kernel beside a plain computation of the same returns, one after the other, on random packets.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "drivers/hesai/hesai_kernel.hpp"
#include "tests/drivers/same_returns.hpp"
#include "tests/support/each_instruction_set.hpp"
#include "tests/support/pcap_writer.hpp"

namespace hueline::drivers {
namespace {

constexpr int kCircle = 36000;

unsigned u16(const std::byte* p) { return static_cast<unsigned>(p[0]) | static_cast<unsigned>(p[1]) << 8U; }

/// Returns the returns of a packet whose header and tail are `data`. Their times count from the packet's time.
std::vector<LaserReturn> plain(const test::Bytes& bytes, const HesaiPacket& data, const HesaiDecoder::Config& config) {
  const HesaiTable& table = hesai_table(config.model);
  std::vector<LaserReturn> out;
  for (int b = 0; b < table.blocks; b += data.returns) {
    const auto block = [&](int i) {
      return bytes.data() + table.head + table.block_bytes() * static_cast<std::size_t>(b + i);
    };
    const unsigned azimuth = u16(block(0) + table.flag);
    bool is_good = azimuth < kCircle;
    for (int i = 0; i < data.returns; ++i)
      is_good &= u16(block(i) + table.flag) == azimuth && (table.flag == 0 || u16(block(i)) == 0xEEFF);
    if (!is_good) continue;
    const std::int32_t period = data.is_fine ? table.fine_period : table.block_period;
    const std::int32_t block_ns = table.first_block != 0
                                      ? table.first_block + period * (b / data.returns)
                                      : table.last_block - period * ((table.blocks - b - 1) / data.returns);
    const bool is_second = !table.times_of_second.empty() && (data.returns == 1 ? b % 2 != 0 : data.is_second);
    for (std::size_t c = 0; c < table.beams.size(); ++c) {
      struct Echo {
        unsigned distance, reflectivity;
      };
      std::vector<Echo> echoes;
      for (int i = 0; i < data.returns; ++i) {
        const std::byte* unit = block(i) + table.flag + 2 + table.unit * c;
        const Echo echo{u16(unit), static_cast<unsigned>(unit[2])};
        if (echo.distance >= 4 &&
            std::ranges::none_of(echoes, [&](const Echo& other) { return other.distance == echo.distance; }))
          echoes.push_back(echo);
      }
      std::ranges::sort(echoes, {}, &Echo::distance);
      const auto sine = [](double angle) { return static_cast<float>(portable::sin(angle)); };
      const auto cosine = [](double angle) { return static_cast<float>(portable::cos(angle)); };
      const double head = 2 * std::numbers::pi * azimuth / kCircle,
                   elevation = table.beams[c].elevation_deg * kRadPerDeg, own = table.beams[c].azimuth_deg * kRadPerDeg;
      for (std::size_t k = 0; k < echoes.size(); ++k) {
        const double metres = echoes[k].distance * data.range_step_m;
        if (metres < config.min_range_m - 1e-9 || metres > config.max_range_m.value_or(1e9) + 1e-9) continue;
        LaserReturn& made = out.emplace_back();
        made.range_m = static_cast<float>(echoes[k].distance) * static_cast<float>(data.range_step_m);
        std::int32_t own_ns = (is_second ? table.times_of_second : table.times)[c];
        if (data.is_fine && own_ns >= table.fine_period) own_ns -= table.fine_period;
        const float turn =
            static_cast<float>(own_ns) * static_cast<float>(data.turns_per_min * (2 * std::numbers::pi / 60e9));
        const float sin_turn = turn * (1.0f - turn * turn * (1.0f / 6)), cos_turn = 1.0f - turn * turn * 0.5f;
        const float sin_still = sine(head) * cosine(own) + cosine(head) * sine(own);
        const float cos_still = cosine(head) * cosine(own) - sine(head) * sine(own);
        const float flat = made.range_m * cosine(elevation);
        made.x = flat * (sin_still * cos_turn + cos_still * sin_turn);
        made.y = flat * (cos_still * cos_turn - sin_still * sin_turn);
        made.z = made.range_m * sine(elevation);
        constexpr auto kTurn = static_cast<float>(2 * std::numbers::pi);
        made.azimuth = static_cast<float>(azimuth) * static_cast<float>(2 * std::numbers::pi / kCircle) +
                       static_cast<float>(own) + turn;
        if (made.azimuth < 0) made.azimuth += kTurn;
        if (made.azimuth >= kTurn) made.azimuth -= kTurn;
        made.time_offset_ns = block_ns + own_ns;
        made.channel = static_cast<std::uint16_t>(std::ranges::count_if(
            table.beams, [&](const HesaiBeam& o) { return o.elevation_deg < table.beams[c].elevation_deg; }));
        made.reflectivity = static_cast<std::uint8_t>(echoes[k].reflectivity);
        made.return_number = static_cast<std::uint8_t>(k + 1);
        made.return_count = static_cast<std::uint8_t>(echoes.size());
      }
    }
  }
  return out;
}

/// A packet without header and tail, whose azimuth passes north. Now and then a block is broken.
test::Bytes random_packet(test::RandomPackets& random, const HesaiTable& table, int returns) {
  test::ByteWriter out(false);
  out.zeros(table.head);
  unsigned azimuth = random.one_in(3) ? kCircle - 1 - random.below(60) : random.below(kCircle);
  std::vector<unsigned> before(table.beams.size(), 1000);
  for (int b = 0; b < table.blocks; ++b) {
    if (b > 0 && b % returns == 0) azimuth = (azimuth + random.below(40)) % kCircle;
    if (table.flag != 0) out.u16(random.one_in(30) ? random.below(0x10000) : 0xEEFF);
    out.u16(random.one_in(30) ? random.below(0x10000) : azimuth);
    for (unsigned& distance : before) {
      distance = random.one_in(12) ? random.below(5) : random.distance(distance);
      out.u16(distance).u8(random.below(256)).zeros(table.unit - 3);
    }
  }
  return out.zeros(table.least_bytes() - out.size()).bytes();
}

TEST(HesaiKernel, MakesTheReturnsOfAPlainComputationToTheLastBit) {
  test::with_each_instruction_set([] {
    test::RandomPackets random(12);
    std::size_t compared = 0;
    for (const HesaiTable& table : hesai_tables())
      for (const bool is_limited : {false, true}) {
        HesaiDecoder::Config config;
        config.model = table.model;
        if (is_limited) config.max_range_m = 90;
        HesaiKernel kernel(config);
        for (int i = 0; i < 60; ++i) {
          HesaiPacket data;
          data.returns = 1 + i % 3;
          if (table.blocks % data.returns != 0) continue;
          data.range_step_m = (1 + random.below(20)) * 1e-3;
          data.turns_per_min = random.below(3001);
          data.is_second = random.one_in(2);
          data.is_fine = table.fine_period != 0 && random.one_in(2);
          const test::Bytes bytes = random_packet(random, table, data.returns);
          std::vector<LaserReturn> returns;
          const HesaiBlocks blocks = kernel.decode(bytes, data, returns);
          for (LaserReturn& r : returns) r.time_offset_ns += static_cast<std::int32_t>(blocks.first_firing.count());
          test::expect_same(returns, plain(bytes, data, config));
          compared += returns.size();
          if (testing::Test::HasFatalFailure()) FAIL() << table.name << ", " << data.returns << " returns";
        }
      }
    EXPECT_GT(compared, 50'000u);
  });
}

}  // namespace
}  // namespace hueline::drivers
