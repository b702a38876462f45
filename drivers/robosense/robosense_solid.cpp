// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/robosense/robosense_solid.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/portable_vectors-inl.hpp"
#include "drivers/range_steps.hpp"
#include "drivers/robosense/robosense_solid.hpp"
#include "drivers/robosense/robosense_wire.hpp"
#include "drivers/write_returns-inl.hpp"
#include "drivers/written_ahead.hpp"

#ifndef HUELINE_DRIVERS_ROBOSENSE_SOLID_ONCE
#define HUELINE_DRIVERS_ROBOSENSE_SOLID_ONCE
namespace hueline::drivers {

/// The most points of a packet, up to the next multiple of what a vector has.
constexpr std::size_t kMostSolidPoints = 128;
constexpr double kSolidRangeUnit = 0.005;  ///< m

/// The points of a packet as it says them. Behind them are points without range, up to the next multiple of 16.
struct RobosenseSolidPoints {
  std::size_t count = 0;
  bool is_spherical = false;
  /// Of an M1 range, elevation and azimuth, 0.01 deg from half a turn, and reflectivity; otherwise range and the unit
  /// vector on the maker's axes in 32768ths. A range of 0 is none.
  alignas(64) std::int32_t said[kMostSolidPoints][4];
  alignas(64) std::array<std::uint32_t, kMostSolidPoints> time_ns, tags;  ///< of an M1 without reflectivity
};

constexpr std::size_t kSolidHead = 32;
constexpr std::size_t kM1Bytes = 1210, kM1Blocks = 25, kM1BlockBytes = 47, kM1Points = 5, kM1PointBytes = 9;

}  // namespace hueline::drivers
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

/// Reads what the points of a packet of an M1 say.
void read_m1_points(std::span<const std::byte> bytes, RobosenseSolidPoints& points) {
  std::size_t k = 0;
  for (std::size_t block = 0; block < kM1Blocks; ++block)
    for (std::size_t point = 0; point < kM1Points; ++point, ++k) {
      const std::size_t at = kSolidHead + block * kM1BlockBytes + 2 + point * kM1PointBytes;
#if HWY_TARGET != HWY_SCALAR
      // Behind the last point there are fewer than 16 bytes.
      if (at + 16 <= bytes.size()) {
        constexpr std::uint8_t kNo = 0x80;
        alignas(16) constexpr std::uint8_t kPlaces[16] = {1, 0, kNo, kNo, 3, 2,   kNo, kNo,
                                                          5, 4, kNo, kNo, 6, kNo, kNo, kNo};
        const hn::FixedTag<std::uint8_t, 16> d;
        const hn::FixedTag<std::int32_t, 4> words;
        const auto said = hn::LoadU(d, reinterpret_cast<const std::uint8_t*>(bytes.data() + at));
        hn::Store(hn::BitCast(words, hn::TableLookupBytesOr0(said, hn::Load(d, kPlaces))), words, points.said[k]);
        continue;
      }
#endif
      for (std::size_t i = 0; i < 3; ++i)
        points.said[k][i] = static_cast<std::int32_t>(robosense_u16(bytes, at + 2 * i));
      points.said[k][3] = static_cast<std::int32_t>(robosense_u8(bytes, at + 6));
    }
}

/// Replaces `returns` by those of the points, whose firings have `return_count` returns.
void place_solid_points(const RobosenseSolidPoints& points, const AzimuthDirection* directions,
                        std::uint32_t return_count, RangeSteps kept, std::vector<LaserReturn>& returns) {
  const FloatTag d;
  const IntTag whole;
  const WordTag bits;
  alignas(64) std::array<LaserReturn, kMostSolidPoints + kWrittenAhead> scratch;
  LaserReturn* out = scratch.data();
  for (std::size_t at = 0; at < points.count; at += kLanes) {
    auto steps = hn::Zero(whole), first = steps, second = steps, third = steps;
    hn::LoadInterleaved4(whole, points.said[at], steps, first, second, third);
    auto tags = hn::Load(bits, points.tags.data() + at);
    const auto range = hn::Mul(hn::ConvertTo(d, steps), hn::Set(d, static_cast<float>(kSolidRangeUnit)));
    auto x = hn::Zero(d), y = x, z = x, azimuth = x;
    if (points.is_spherical) {
      auto sin_elevation = x, cos_elevation = x, sin_azimuth = x, cos_azimuth = x;
      const auto hundredths = [&](auto angle) {
        const auto turned = hn::Sub(angle, hn::Set(whole, 32768));
        return hn::Add(turned, hn::IfThenElseZero(hn::Lt(turned, hn::Zero(whole)), hn::Set(whole, kAzimuthsOfCircle)));
      };
      const auto around = hundredths(second);
      look_up_directions(directions, hundredths(first), sin_elevation, cos_elevation);
      look_up_directions(directions, around, sin_azimuth, cos_azimuth);
      const auto across = hn::Mul(range, cos_elevation);
      x = hn::Mul(across, cos_azimuth), y = hn::Mul(across, sin_azimuth), z = hn::Mul(range, sin_elevation);
      azimuth = hn::Mul(hn::ConvertTo(d, around), hn::Set(d, kAzimuthStep));
      tags = hn::Or(tags, hn::BitCast(bits, hn::ShiftLeft<16>(third)));
    } else {
      const auto unit = hn::Mul(range, hn::Set(d, 1.0f / 32768));
      const auto place = [&](auto said) { return hn::Mul(unit, hn::ConvertTo(d, said)); };
      x = place(first), y = place(second), z = place(third);
      azimuth = azimuth_of(y, x);
    }
    // A range that is too near becomes a large number, because words have no sign.
    const auto is_kept =
        hn::Lt(hn::Sub(hn::BitCast(bits, steps), hn::Set(bits, kept.nearest)), hn::Set(bits, kept.count));
    const auto word = [&](auto lanes) { return hn::BitCast(bits, lanes); };
    out = write_returns(is_kept, word(hn::Neg(y)), word(x), word(z), word(range), word(azimuth),
                        hn::Load(bits, points.time_ns.data() + at), tags, hn::Set(bits, return_count), out);
  }
  returns.assign(scratch.data(), out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(place_solid_points);
HWY_EXPORT(read_m1_points);
namespace {

constexpr std::size_t kE1Bytes = 1200, kE1Blocks = 96, kE1BlockBytes = 12;

constexpr std::uint32_t tags_of(unsigned channel, unsigned reflectivity, unsigned return_number) {
  return channel | reflectivity << 16U | return_number << 24U;
}

}  // namespace

std::optional<RobosenseSolidPacket> decode_robosense_solid(std::span<const std::byte> bytes) {
  if ((bytes.size() != kM1Bytes && bytes.size() != kE1Bytes) || robosense_u16(bytes, 0) != 0x55AA ||
      robosense_u16(bytes, 2) != 0x5AA5)
    return {};
  RobosenseSolidPacket out;
  out.is_m1 = bytes.size() == kM1Bytes;
  out.name = out.is_m1 ? "RS-LiDAR-M1" : "RS-LiDAR-E1";
  out.sequence = static_cast<std::uint16_t>(robosense_u16(bytes, 4));
  out.is_dual = robosense_u8(bytes, 8) == 0;
  out.follows_ptp = robosense_u8(bytes, 9) != 0;
  std::uint64_t second = 0, microsecond = 0;
  for (std::size_t i = 10; i < 16; ++i) second = second << 8 | robosense_u8(bytes, i);
  for (std::size_t i = 16; i < 20; ++i) microsecond = microsecond << 8 | robosense_u8(bytes, i);
  if (second <= 4'294'967'295u && microsecond <= 999'999)
    out.time = UnixTime(std::chrono::seconds(static_cast<std::int64_t>(second)) +
                        std::chrono::microseconds(static_cast<std::int64_t>(microsecond)));
  return out;
}

void decode_robosense_solid_points(std::span<const std::byte> bytes, const RobosenseSolidPacket& packet,
                                   double min_range_m, double max_range_m, std::vector<LaserReturn>& out) {
  RobosenseSolidPoints points;
  points.is_spherical = packet.is_m1;
  const auto number = [&](std::size_t at) { return static_cast<std::int32_t>(robosense_u16(bytes, at)); };
  std::size_t k = 0;
  if (packet.is_m1) {
    HWY_DYNAMIC_DISPATCH(read_m1_points)(bytes, points);
    for (std::size_t block = 0; block < kM1Blocks; ++block) {
      const std::size_t head = kSolidHead + block * kM1BlockBytes;
      const unsigned return_number = packet.is_dual && robosense_u8(bytes, head + 1) == 2 ? 2 : 1;
      const std::uint32_t time_ns = 1000 * robosense_u8(bytes, head), tags = tags_of(0, 0, return_number);
      for (unsigned point = 0; point < kM1Points; ++point, ++k) {
        points.time_ns[k] = time_ns;
        points.tags[k] = tags + point;
      }
    }
  } else {
    for (std::size_t block = 0; block < kE1Blocks; ++block, ++k) {
      const std::size_t at = kSolidHead + block * kE1BlockBytes;
      points.said[k][0] = number(at + 2);
      for (std::size_t i = 0; i < 3; ++i) points.said[k][i + 1] = static_cast<std::int16_t>(number(at + 4 + 2 * i));
      points.time_ns[k] = 1000 * robosense_u16(bytes, at);
      points.tags[k] = tags_of(0, robosense_u8(bytes, at + 10), 1);
    }
  }
  points.count = k;
  for (; k % 16 != 0; ++k) {
    std::ranges::fill(points.said[k], 0);
    points.time_ns[k] = points.tags[k] = 0;
  }
  HWY_DYNAMIC_DISPATCH(place_solid_points)
  (points, azimuth_directions().data(), packet.is_m1 && packet.is_dual ? 2 : 1,
   range_steps(min_range_m, max_range_m, kSolidRangeUnit), out);
}

}  // namespace hueline::drivers
#endif
