// The kernel beside a plain computation of the same returns, one after the other, on random packets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "drivers/ouster/ouster_kernel.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"
#include "tests/drivers/same_returns.hpp"
#include "tests/support/each_instruction_set.hpp"

namespace hueline::drivers {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kNearest = 0.3;

std::uint32_t u32(const std::byte* p) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(p[i]) << (8 * i);
  return value;
}

/// Returns the returns of the columns of a packet that are valid; the earliest is the first.
std::vector<LaserReturn> plain(const test::Bytes& bytes, const OusterMetadata& metadata, double farthest_m) {
  const OusterProfile& profile = *metadata.profile;
  Eigen::Matrix3d R_scanner_sensor;
  R_scanner_sensor << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3d R = R_scanner_sensor * metadata.R_sensor_lidar;
  const Eigen::Vector3f upwards = R.col(2).cast<float>();
  std::vector<LaserReturn> out;
  std::optional<std::uint64_t> first_ns;
  for (int i = 0; i < metadata.columns_per_packet; ++i) {
    const std::byte* at = bytes.data() + metadata.head_bytes() + metadata.column_bytes() * static_cast<std::size_t>(i);
    const OusterColumn column = decode_ouster_column(at, metadata);
    if (!column.is_valid) continue;
    if (!first_ns) first_ns = column.time_ns;
    const double encoder = -kTwoPi * column.number / metadata.columns_per_frame;
    const Eigen::Vector3d along_axis = R * Eigen::Vector3d(portable::cos(encoder), portable::sin(encoder), 0);
    const Eigen::Vector3f along = along_axis.cast<float>(),
                          left =
                              (R * Eigen::Vector3d(-portable::sin(encoder), portable::cos(encoder), 0)).cast<float>(),
                          origin = (along_axis * metadata.beam_x_m + R.col(2) * metadata.beam_z_m).cast<float>();
    const double turned = portable::atan2(along_axis.x(), along_axis.y());
    for (std::size_t c = 0; c < static_cast<std::size_t>(metadata.channels); ++c) {
      const std::byte* pixel = at + metadata.column_head_bytes() + profile.pixel_bytes * c;
      struct Echo {
        std::uint32_t mm;
        std::uint8_t reflectivity;
      };
      std::vector<Echo> echoes;
      for (std::size_t k = 0; k < (profile.is_dual ? 2u : 1u); ++k) {
        const std::uint32_t mm = (u32(pixel + 4 * k) & profile.range_mask) << profile.range_shift;
        const std::size_t byte = profile.reflectivity_at + 4 * k + (metadata.has_wide_reflectivity ? 1 : 0);
        if (mm != 0 && (echoes.empty() || echoes[0].mm != mm))
          echoes.push_back({mm, static_cast<std::uint8_t>(pixel[byte])});
      }
      std::ranges::sort(echoes, {}, &Echo::mm);
      for (std::size_t k = 0; k < echoes.size(); ++k) {
        if (echoes[k].mm < kNearest * 1e3 - 1e-6 || echoes[k].mm > farthest_m * 1e3 + 1e-6) continue;
        const double altitude = metadata.altitudes_deg[c] * kRadPerDeg, azimuth = metadata.azimuths_deg[c] * kRadPerDeg;
        LaserReturn& made = out.emplace_back();
        made.range_m = static_cast<float>(echoes[k].mm) * 1e-3f;
        const float beam = made.range_m - static_cast<float>(portable::hypot(metadata.beam_x_m, metadata.beam_z_m));
        const float a = beam * static_cast<float>(portable::cos(altitude) * portable::cos(azimuth)),
                    l = beam * static_cast<float>(-portable::cos(altitude) * portable::sin(azimuth)),
                    u = beam * static_cast<float>(portable::sin(altitude));
        made.x = a * along.x() + l * left.x() + u * upwards.x() + origin.x();
        made.y = a * along.y() + l * left.y() + u * upwards.y() + origin.y();
        made.z = a * along.z() + l * left.z() + u * upwards.z() + origin.z();
        constexpr auto kTurn = static_cast<float>(kTwoPi);
        made.azimuth = static_cast<float>(turned < 0 ? turned + kTwoPi : turned) + static_cast<float>(azimuth);
        if (made.azimuth < 0) made.azimuth += kTurn;
        if (made.azimuth >= kTurn) made.azimuth -= kTurn;
        made.time_offset_ns = static_cast<std::int32_t>(column.time_ns - *first_ns);
        made.channel = static_cast<std::uint16_t>(std::ranges::count_if(
            metadata.altitudes_deg, [&](double other) { return other < metadata.altitudes_deg[c]; }));
        made.reflectivity = echoes[k].reflectivity;
        made.return_number = static_cast<std::uint8_t>(k + 1);
        made.return_count = static_cast<std::uint8_t>(echoes.size());
      }
    }
  }
  return out;
}

TEST(OusterKernel, MakesTheReturnsOfAPlainComputationToTheLastBit) {
  test::with_each_instruction_set([] {
    test::RandomPackets random(13);
    std::size_t compared = 0;
    for (const OusterProfile& profile : ouster_profiles())
      for (const int channels : {4, 16, 20, 128}) {
        test::OusterText text;
        text.profile = profile.name;
        text.channels = channels;
        if (std::string_view(profile.name) == "LEGACY" && channels == 16) text.firmware = "v2.0.0";
        const auto metadata = parse_ouster_metadata(test::ouster_metadata(text));
        ASSERT_TRUE(metadata.ok()) << metadata.error().message;
        for (const double farthest_m : {50.0, 1e9}) {
          OusterKernel kernel(*metadata, kNearest, farthest_m);
          test::OusterPacket packet;
          packet.is_legacy = metadata->is_legacy();
          packet.channels = channels;
          packet.first_column = static_cast<int>(16 * random.below(64));
          packet.invalid_columns = random.one_in(2) ? 0 : random.below(0x10000);
          packet.pixel.resize(profile.pixel_bytes);
          test::Bytes bytes = test::ouster_bytes(packet);
          for (std::size_t i = 0; i < 16; ++i)
            for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
              std::byte* pixel = bytes.data() + metadata->head_bytes() + metadata->column_bytes() * i +
                                 metadata->column_head_bytes() + profile.pixel_bytes * c;
              unsigned before = 1000;
              for (std::size_t k = 0; k < profile.pixel_bytes; k += 2) {
                before = k % 4 == 0 ? random.distance(before) : random.below(0x10000);
                pixel[k] = static_cast<std::byte>(before & 0xFFU);
                pixel[k + 1] = static_cast<std::byte>(before >> 8U);
                // Few ranges have more than 16 bits.
                if (k % 4 == 2 && random.one_in(2)) pixel[k] = std::byte{0};
                if (k % 4 == 2)
                  before = static_cast<unsigned>(pixel[k - 2]) | static_cast<unsigned>(pixel[k - 1]) << 8U;
              }
            }
          std::vector<LaserReturn> returns;
          kernel.decode(bytes, returns);
          test::expect_same(returns, plain(bytes, *metadata, farthest_m));
          compared += returns.size();
          if (testing::Test::HasFatalFailure()) FAIL() << profile.name << ", " << channels << " channels";
        }
      }
    EXPECT_GT(compared, 20'000u);
  });
}

}  // namespace
}  // namespace hueline::drivers
