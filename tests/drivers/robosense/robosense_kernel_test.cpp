// The kernels beside a plain computation of the same returns, one after the other, on random packets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/portable_math.hpp"
#include "drivers/robosense/robosense_kernel.hpp"
#include "drivers/robosense/robosense_solid.hpp"
#include "tests/drivers/robosense/robosense_packets.hpp"
#include "tests/drivers/same_returns.hpp"
#include "tests/support/each_instruction_set.hpp"

namespace hueline::drivers {
namespace {

constexpr double kTurn = 2 * std::numbers::pi, kNearest = 0.3;

unsigned u16(const std::byte* p) { return static_cast<unsigned>(p[0]) << 8U | static_cast<unsigned>(p[1]); }

std::vector<LaserReturn> plain(std::span<const RobosenseKernel::Firings> all, const RobosenseTable& table,
                               const RobosenseDescription& description, double unit, double farthest) {
  std::vector<LaserReturn> out;
  for (const RobosenseKernel::Firings& firings : all)
    for (std::size_t channel = 0; channel < firings.count; ++channel) {
      struct Echo {
        unsigned range;
        std::uint8_t reflectivity;
      };
      std::vector<Echo> echoes;
      for (const std::byte* units : {firings.first, firings.second}) {
        if (!units) continue;
        const unsigned range = u16(units + 3 * channel);
        if (range == 0 || range == 0xFFFF || (!echoes.empty() && echoes[0].range == range)) continue;
        echoes.push_back({range, static_cast<std::uint8_t>(units[3 * channel + 2])});
      }
      std::ranges::sort(echoes, {}, &Echo::range);
      const std::size_t beam = channel % static_cast<std::size_t>(table.beams);
      const double after_us = table.channel_us[channel];
      double turned = firings.block.azimuth + firings.block.step * after_us / table.firing_period_us;
      double azimuth = turned + description.azimuths[beam];
      if (description.is_reversed) {
        turned = -turned;
        azimuth = -azimuth;
      }
      const double elevation = description.elevations[beam];
      const auto narrow = [](double value) { return static_cast<float>(value); };
      for (std::size_t i = 0; i < echoes.size(); ++i) {
        if (unit * echoes[i].range < kNearest || unit * echoes[i].range > farthest) continue;
        const float range = narrow(unit) * static_cast<float>(echoes[i].range),
                    across = range * narrow(portable::cos(elevation));
        LaserReturn& made = out.emplace_back();
        made.x = across * narrow(portable::sin(azimuth)) + narrow(table.lens_radius_m * portable::sin(turned));
        made.y = across * narrow(portable::cos(azimuth)) + narrow(table.lens_radius_m * portable::cos(turned));
        made.z = range * narrow(portable::sin(elevation)) + narrow(table.lens_height_m);
        made.range_m = range;
        const double rest = std::fmod(azimuth, kTurn);
        made.azimuth = std::min(static_cast<float>(rest < 0 ? rest + kTurn : rest), 6.2831850f);
        made.time_offset_ns = static_cast<std::int32_t>(std::lround((firings.block.time_us + after_us) * 1e3));
        made.channel = static_cast<std::uint16_t>(
            std::ranges::count_if(description.elevations, [&](double other) { return other < elevation; }));
        made.reflectivity = echoes[i].reflectivity;
        made.return_number = static_cast<std::uint8_t>(i + 1);
        made.return_count = static_cast<std::uint8_t>(echoes.size());
      }
    }
  return out;
}

TEST(RobosenseKernel, MakesTheReturnsOfAPlainComputation) {
  test::SameAlways same;
  test::with_each_instruction_set([&] {
    same.begin();
    test::RandomPackets random(15);
    const auto angle = [&](double largest) { return largest * (static_cast<double>(random.below(20'001)) / 1e4 - 1); };
    std::size_t compared = 0;
    for (const RobosenseModel model : {RobosenseModel::Rs16, RobosenseModel::Rs32, RobosenseModel::Bpearl,
                                       RobosenseModel::Bpearl4, RobosenseModel::Helios, RobosenseModel::Helios16})
      for (int round = 0; round < 12; ++round) {
        const RobosenseTable& table = robosense_table(model);
        RobosenseDescription description;
        description.is_reversed = random.one_in(2);
        for (int beam = 0; beam < table.beams; ++beam) {
          description.elevations.push_back(angle(1.5));
          description.azimuths.push_back(angle(round % 3 == 0 ? std::numbers::pi : 0.2));
        }
        description.azimuths[0] = 0;
        description.azimuths[1] = random.one_in(2) ? kTurn / 2 : -kTurn / 2;
        const double unit = random.one_in(2) ? 0.01 : table.range_unit_m, farthest = random.one_in(2) ? 1e9 : 60.0;
        RobosenseKernel kernel(table, description, unit, kNearest, farthest);
        const bool is_dual = round % 2 == 1, is_twice = table.beams == 16;
        test::Bytes bytes(2 * 96 * kRobosenseBlocks + 4);  // more can be read than is there
        std::vector<RobosenseKernel::Firings> all;
        for (std::size_t block = 0; block < kRobosenseBlocks; block += is_dual && !is_twice ? 2 : 1) {
          std::byte* units = bytes.data() + 192 * block;
          unsigned before = 1000;
          for (std::size_t unit_at = 0; unit_at < 192; unit_at += 3) {
            // The second return is 96 bytes behind the first, of 16 beams 48.
            const std::size_t back = is_twice ? 48 : 96;
            if (unit_at >= back) before = u16(units + unit_at - back);
            before = random.distance(before);
            units[unit_at] = static_cast<std::byte>(before >> 8U);
            units[unit_at + 1] = static_cast<std::byte>(before & 0xFFU);
            units[unit_at + 2] = static_cast<std::byte>(random.below(256));
          }
          RobosenseBlock times;
          unsigned hundredths = random.one_in(4) ? 35990 + random.below(10) : random.below(36'000);
          times.step = random.below(100) * 0.01 / 180 * std::numbers::pi;
          if (random.one_in(4)) hundredths = 0, times.step = 0;
          times.azimuth = hundredths * 0.01 / 180 * std::numbers::pi;
          times.direction = azimuth_directions()[hundredths];
          times.time_us = 55.5 * static_cast<double>(block) + 0.001 * random.below(100'000);
          all.push_back({times, units, is_dual ? units + (is_twice ? 48 : 96) : nullptr,
                         is_dual && is_twice ? 16 : RobosenseKernel::kChannels});
        }
        std::vector<LaserReturn> returns;
        kernel.decode(all, returns);
        test::expect_close(returns, plain(all, table, description, unit, farthest), 3e-7);
        same.add(returns);
        compared += returns.size();
        if (testing::Test::HasFatalFailure()) FAIL() << table.name;
      }
    EXPECT_GT(compared, 10'000u);
  });
}

/// The returns of an M1 or, otherwise, of an E1.
std::vector<LaserReturn> plain_solid(const test::Bytes& bytes, bool is_m1, bool is_dual, double farthest) {
  std::vector<LaserReturn> out;
  const auto at = [&](std::size_t place) { return bytes.data() + place; };
  for (std::size_t k = 0; k < (is_m1 ? 125u : 96u); ++k) {
    const std::size_t head = is_m1 ? 32 + k / 5 * 47 : 32 + 12 * k, point = is_m1 ? head + 2 + k % 5 * 9 : head + 2;
    const float range = static_cast<float>(u16(at(point))) * 0.005f;
    if (!(range > 0 && 0.005 * u16(at(point)) >= kNearest && 0.005 * u16(at(point)) <= farthest)) continue;
    LaserReturn& made = out.emplace_back();
    double azimuth = 0;
    float x = 0, y = 0;
    if (is_m1) {
      const auto angle = [&](std::size_t place) {
        return std::numbers::pi / 18000 * ((static_cast<int>(u16(at(place))) + 36000 - 32768) % 36000);
      };
      const auto sine = [](double of) { return static_cast<float>(portable::sin(of)); };
      const auto cosine = [](double of) { return static_cast<float>(portable::cos(of)); };
      azimuth = angle(point + 4);
      const float across = range * cosine(angle(point + 2));
      x = across * cosine(azimuth);
      y = across * sine(azimuth);
      made.z = range * sine(angle(point + 2));
      made.time_offset_ns = 1000 * static_cast<int>(bytes[head]);
      made.channel = static_cast<std::uint16_t>(k % 5);
      made.reflectivity = static_cast<std::uint8_t>(bytes[point + 6]);
      if (is_dual) made.return_count = 2;
      if (is_dual && bytes[head + 1] == std::byte{2}) made.return_number = 2;
    } else {
      const auto part = [&](std::size_t i) {
        return range / 32768 * static_cast<float>(static_cast<std::int16_t>(u16(at(point + 2 + 2 * i))));
      };
      x = part(0), y = part(1);
      made.z = part(2);
      azimuth = portable::atan2(y, x);
      made.time_offset_ns = static_cast<std::int32_t>(1000 * u16(at(head)));
      made.reflectivity = static_cast<std::uint8_t>(bytes[point + 8]);
    }
    made.x = -y;
    made.y = x;
    made.range_m = range;
    made.azimuth = static_cast<float>(azimuth < 0 ? azimuth + kTurn : azimuth);
  }
  return out;
}

TEST(RobosenseSolid, MakesTheReturnsOfAPlainComputation) {
  test::SameAlways same;
  test::with_each_instruction_set([&] {
    same.begin();
    test::RandomPackets random(16);
    std::size_t compared = 0;
    for (int round = 0; round < 60; ++round) {
      const bool is_m1 = round % 2 == 0, is_dual = random.one_in(2);
      test::ByteWriter out(true);
      out.u32(0x55AA5AA5).u16(1).zeros(2).u8(is_dual ? 0 : 1).zeros(23);
      while (out.size() < (is_m1 ? 1210u : 1200u)) out.u8(random.one_in(6) ? random.below(3) : random.below(256));
      const test::Bytes bytes = out.bytes();
      const auto packet = decode_robosense_solid(bytes);
      ASSERT_TRUE(packet);
      const double farthest = random.one_in(2) ? 1e9 : 200.0;
      std::vector<LaserReturn> returns;
      decode_robosense_solid_points(bytes, *packet, kNearest, farthest, returns);
      test::expect_close(returns, plain_solid(bytes, is_m1, is_dual, farthest), 1e-9);
      same.add(returns);
      compared += returns.size();
      if (testing::Test::HasFatalFailure()) FAIL() << packet->name;
    }
    EXPECT_GT(compared, 3'000u);
  });
}

}  // namespace
}  // namespace hueline::drivers
