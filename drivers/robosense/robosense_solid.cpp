#include "drivers/robosense/robosense_solid.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kHead = 32;
constexpr std::size_t kM1Bytes = 1210, kM1Blocks = 25, kM1BlockBytes = 47, kM1Points = 5, kM1PointBytes = 9;
constexpr std::size_t kE1Bytes = 1200, kE1Blocks = 96, kE1BlockBytes = 12;
constexpr double kRangeUnit = 0.005, kVectorUnit = 1.0 / 32768, kRadPerHundredth = std::numbers::pi / 18000;

unsigned u8(std::span<const std::byte> bytes, std::size_t at) { return static_cast<unsigned>(bytes[at]); }
unsigned u16(std::span<const std::byte> bytes, std::size_t at) { return u8(bytes, at) << 8 | u8(bytes, at + 1); }

/// A return on the maker's axes.
LaserReturn made_of(double x, double y, double z, double range) {
  LaserReturn out;
  out.x = static_cast<float>(-y);
  out.y = static_cast<float>(x);
  out.z = static_cast<float>(z);
  out.range_m = static_cast<float>(range);
  const double azimuth = portable::atan2(y, x);
  out.azimuth = std::min(static_cast<float>(azimuth < 0 ? azimuth + 2 * std::numbers::pi : azimuth), 6.2831850f);
  return out;
}

}  // namespace

std::optional<RobosenseSolidPacket> decode_robosense_solid(std::span<const std::byte> bytes) {
  if ((bytes.size() != kM1Bytes && bytes.size() != kE1Bytes) || u16(bytes, 0) != 0x55AA || u16(bytes, 2) != 0x5AA5)
    return {};
  RobosenseSolidPacket out;
  out.is_m1 = bytes.size() == kM1Bytes;
  out.name = out.is_m1 ? "RS-LiDAR-M1" : "RS-LiDAR-E1";
  out.sequence = static_cast<std::uint16_t>(u16(bytes, 4));
  out.is_dual = u8(bytes, 8) == 0;
  out.follows_ptp = u8(bytes, 9) != 0;
  std::uint64_t second = 0, microsecond = 0;
  for (std::size_t i = 10; i < 16; ++i) second = second << 8 | u8(bytes, i);
  for (std::size_t i = 16; i < 20; ++i) microsecond = microsecond << 8 | u8(bytes, i);
  if (second <= 4'294'967'295u && microsecond <= 999'999)
    out.time = UnixTime(std::chrono::seconds(static_cast<std::int64_t>(second)) +
                        std::chrono::microseconds(static_cast<std::int64_t>(microsecond)));
  return out;
}

void decode_robosense_solid_points(std::span<const std::byte> bytes, const RobosenseSolidPacket& packet,
                                   double min_range_m, double max_range_m, std::vector<LaserReturn>& out) {
  const auto is_kept = [&](double range) { return range > 0 && range >= min_range_m && range <= max_range_m; };
  if (!packet.is_m1) {
    for (std::size_t block = 0; block < kE1Blocks; ++block) {
      const std::size_t at = kHead + block * kE1BlockBytes;
      const double range = kRangeUnit * u16(bytes, at + 2);
      if (!is_kept(range)) continue;
      const auto part = [&](std::size_t offset) {
        return range * kVectorUnit * static_cast<std::int16_t>(u16(bytes, at + offset));
      };
      LaserReturn made = made_of(part(4), part(6), part(8), range);
      made.time_offset_ns = static_cast<std::int32_t>(1000 * u16(bytes, at));
      made.reflectivity = static_cast<std::uint8_t>(bytes[at + 10]);
      out.push_back(made);
    }
    return;
  }
  for (std::size_t block = 0; block < kM1Blocks; ++block) {
    const std::size_t head = kHead + block * kM1BlockBytes;
    for (std::size_t point = 0; point < kM1Points; ++point) {
      const std::size_t at = head + 2 + point * kM1PointBytes;
      const double range = kRangeUnit * u16(bytes, at);
      if (!is_kept(range)) continue;
      const double elevation = kRadPerHundredth * (static_cast<int>(u16(bytes, at + 2)) - 32768);
      const double azimuth = kRadPerHundredth * (static_cast<int>(u16(bytes, at + 4)) - 32768);
      LaserReturn made =
          made_of(range * portable::cos(elevation) * portable::cos(azimuth),
                  range * portable::cos(elevation) * portable::sin(azimuth), range * portable::sin(elevation), range);
      made.time_offset_ns = static_cast<std::int32_t>(1000 * u8(bytes, head));
      made.channel = static_cast<std::uint16_t>(point);
      made.reflectivity = static_cast<std::uint8_t>(bytes[at + 6]);
      if (packet.is_dual) {
        made.return_count = 2;
        made.return_number = u8(bytes, head + 1) == 2 ? 2 : 1;
      }
      out.push_back(made);
    }
  }
}

}  // namespace hueline::drivers
