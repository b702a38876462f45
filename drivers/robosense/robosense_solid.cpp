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
#include <numbers>
#include <vector>

#include "drivers/portable_vectors-inl.hpp"
#include "drivers/robosense/robosense_solid.hpp"
#include "drivers/robosense/robosense_wire.hpp"
#include "drivers/write_returns-inl.hpp"

#ifndef HUELINE_DRIVERS_ROBOSENSE_SOLID_ONCE
#define HUELINE_DRIVERS_ROBOSENSE_SOLID_ONCE
namespace hueline::drivers {

/// The most points of a packet, up to the next multiple of what a vector has.
constexpr std::size_t kMostSolidPoints = 128;

/// The points of a packet as it says them.
struct RobosenseSolidPoints {
  std::size_t count = 0;  ///< behind them ranges are 0 up to the next multiple of 16
  bool is_spherical = false;
  alignas(64) std::array<double, kMostSolidPoints> range_m;  ///< 0: it is not kept
  /// Elevation and azimuth, rad, or places on the maker's axes, m.
  alignas(64) std::array<std::array<double, kMostSolidPoints>, 3> said;
  alignas(64) std::array<std::uint32_t, kMostSolidPoints> time_ns, tags;
};

}  // namespace hueline::drivers
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

/// Replaces `returns` by those of the points, whose firings have `return_count` returns.
void place_solid_points(const RobosenseSolidPoints& points, std::uint32_t return_count,
                        std::vector<LaserReturn>& returns) {
  const DoubleTag d;
  const FloatTag narrow;
  const WordTag bits;
  alignas(64) std::array<LaserReturn, kMostSolidPoints + 1> scratch;
  LaserReturn* out = scratch.data();
  for (std::size_t at = 0; at < points.count; at += kLanes) {
    alignas(64) float x_m[kLanes], y_m[kLanes], z_m[kLanes], range_m[kLanes], azimuth[kLanes];
    for (std::size_t k = 0; k < kLanes; k += kDoubles) {
      const auto load = [&](const auto& quantity) { return hn::Load(d, quantity.data() + at + k); };
      const auto range = load(points.range_m);
      auto x = load(points.said[0]), y = load(points.said[1]), z = load(points.said[2]);
      if (points.is_spherical) {
        auto sin_elevation = x, cos_elevation = x, sin_azimuth = y, cos_azimuth = y;
        sine_cosine(x, sin_elevation, cos_elevation);
        sine_cosine(y, sin_azimuth, cos_azimuth);
        x = hn::Mul(hn::Mul(range, cos_elevation), cos_azimuth);
        y = hn::Mul(hn::Mul(range, cos_elevation), sin_azimuth);
        z = hn::Mul(range, sin_elevation);
      }
      const auto angle = arc_tangent(y, x);
      const auto behind = hn::Add(angle, double_of(2 * std::numbers::pi));
      store_floats(hn::Neg(y), x_m + k);
      store_floats(x, y_m + k);
      store_floats(z, z_m + k);
      store_floats(range, range_m + k);
      store_floats(hn::IfThenElse(hn::Lt(angle, hn::Zero(d)), behind, angle), azimuth + k);
    }
    const auto word = [&](const float* quantity) { return hn::BitCast(bits, hn::Load(narrow, quantity)); };
    const auto within = hn::BitCast(bits, hn::Min(hn::Load(narrow, azimuth), hn::Set(narrow, 6.2831850f)));
    const auto is_kept = hn::RebindMask(bits, hn::Gt(hn::Load(narrow, range_m), hn::Zero(narrow)));
    out = write_returns(is_kept, word(x_m), word(y_m), word(z_m), word(range_m), within,
                        hn::Load(bits, points.time_ns.data() + at), hn::Load(bits, points.tags.data() + at),
                        hn::Set(bits, return_count), out);
  }
  returns.assign(scratch.data(), out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(place_solid_points);
namespace {

constexpr std::size_t kHead = 32;
constexpr std::size_t kM1Bytes = 1210, kM1Blocks = 25, kM1BlockBytes = 47, kM1Points = 5, kM1PointBytes = 9;
constexpr std::size_t kE1Bytes = 1200, kE1Blocks = 96, kE1BlockBytes = 12;
constexpr double kRangeUnit = 0.005, kVectorUnit = 1.0 / 32768, kRadPerHundredth = std::numbers::pi / 18000;

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
  const auto add_range = [&](std::size_t at) {
    const double range = kRangeUnit * robosense_u16(bytes, at);
    points.range_m[points.count] = range >= min_range_m && range <= max_range_m ? range : 0;
    return range;
  };
  if (packet.is_m1) {
    for (std::size_t block = 0; block < kM1Blocks; ++block) {
      const std::size_t head = kHead + block * kM1BlockBytes;
      const unsigned number = packet.is_dual && robosense_u8(bytes, head + 1) == 2 ? 2 : 1;
      for (unsigned point = 0; point < kM1Points; ++point, ++points.count) {
        const std::size_t at = head + 2 + point * kM1PointBytes;
        add_range(at);
        points.said[0][points.count] = kRadPerHundredth * (static_cast<int>(robosense_u16(bytes, at + 2)) - 32768);
        points.said[1][points.count] = kRadPerHundredth * (static_cast<int>(robosense_u16(bytes, at + 4)) - 32768);
        points.said[2][points.count] = 0;
        points.time_ns[points.count] = 1000 * robosense_u8(bytes, head);
        points.tags[points.count] = tags_of(point, robosense_u8(bytes, at + 6), number);
      }
    }
  } else {
    for (std::size_t block = 0; block < kE1Blocks; ++block, ++points.count) {
      const std::size_t at = kHead + block * kE1BlockBytes;
      const double range = add_range(at + 2);
      for (std::size_t i = 0; i < 3; ++i)
        points.said[i][points.count] =
            range * kVectorUnit * static_cast<std::int16_t>(robosense_u16(bytes, at + 4 + 2 * i));
      points.time_ns[points.count] = 1000 * robosense_u16(bytes, at);
      points.tags[points.count] = tags_of(0, robosense_u8(bytes, at + 10), 1);
    }
  }
  for (std::size_t k = points.count; k % 16 != 0; ++k) {
    points.range_m[k] = points.said[0][k] = points.said[1][k] = points.said[2][k] = 0;
    points.time_ns[k] = points.tags[k] = 0;
  }
  HWY_DYNAMIC_DISPATCH(place_solid_points)(points, packet.is_m1 && packet.is_dual ? 2 : 1, out);
}

}  // namespace hueline::drivers
#endif
