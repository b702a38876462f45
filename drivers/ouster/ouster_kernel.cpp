// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/ouster/ouster_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <vector>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "drivers/ouster/ouster_kernel.hpp"
#include "drivers/write_returns-inl.hpp"
#include "drivers/written_ahead.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

/// The first two words of each pixel of a column.
struct OusterWords {
  alignas(64) std::array<std::uint32_t, OusterKernel::kMost> first, second;
};

/// Reads the pixels of a column. Behind the last channel are none.
HWY_INLINE void load_pixels(const std::byte* bytes, const OusterKernel::Pixels& pixels, OusterWords& words) {
  const WordTag d;
  const std::size_t count = pixels.channels, stride = pixels.profile.pixel_bytes;
  std::size_t c = 0;
  const auto load_whole = [&](const auto& load) {
    for (; c + kLanes <= count; c += kLanes) {
      Words first, second, unused;
      load(reinterpret_cast<const std::uint32_t*>(bytes + stride * c), first, second, unused);
      hn::Store(first, d, words.first.data() + c);
      hn::Store(second, d, words.second.data() + c);
    }
  };
  if (stride == 4)
    load_whole([&](const std::uint32_t* p, Words& first, Words& second, Words&) { first = second = hn::LoadU(d, p); });
  else if (stride == 8)
    load_whole([&](const std::uint32_t* p, Words& first, Words& second, Words&) {
      hn::LoadInterleaved2(d, p, first, second);
    });
  else if (stride == 12)
    load_whole([&](const std::uint32_t* p, Words& first, Words& second, Words& unused) {
      hn::LoadInterleaved3(d, p, first, second, unused);
    });
  else if (stride == 16)
    load_whole([&](const std::uint32_t* p, Words& first, Words& second, Words& unused) {
      hn::LoadInterleaved4(d, p, first, second, unused, unused);
    });
  for (; c < count; ++c) {
    std::memcpy(&words.first[c], bytes + stride * c, 4);
    std::memcpy(&words.second[c], bytes + stride * c + (stride > 4 ? 4 : 0), 4);
  }
  for (; c % kLanes != 0; ++c) words.first[c] = words.second[c] = 0;
}

/// Writes the returns of kLanes channels from `at` on, and returns the end.
template <bool kIsDual>
HWY_INLINE LaserReturn* decode_pixels(const OusterKernel::Column& column, const OusterKernel::Pixels& pixels,
                                      const OusterKernel::Beams& beams, const OusterWords& words, std::size_t at,
                                      LaserReturn* out) {
  const FloatTag d;
  const IntTag whole;
  const WordTag bits;
  const OusterKernel::Turn& turn = *column.turn;
  const auto load = [&](const OusterKernel::Floats& table) { return hn::Load(d, table.data() + at); };
  const auto one = hn::Set(bits, 1U), byte = hn::Set(bits, 0xFFU);
  const auto word = [&](auto lanes) { return hn::BitCast(bits, lanes); };
  const auto shifted = [&](auto lanes, std::size_t places) {
    return hn::And(hn::ShiftRightSame(lanes, static_cast<int>(8 * (places % 4))), byte);
  };
  const auto range_of = [&](auto lanes) {
    return hn::ShiftLeftSame(hn::And(lanes, hn::Set(bits, pixels.profile.range_mask)), pixels.profile.range_shift);
  };
  // A range that is too near becomes a large number, because words have no sign.
  const auto is_kept = [&](auto range_mm) {
    return hn::Lt(hn::Sub(range_mm, hn::Set(bits, pixels.nearest_mm)), hn::Set(bits, pixels.count));
  };

  const auto azimuth = word(in_circle(hn::Add(hn::Set(d, turn.azimuth), load(beams.azimuth))));
  const auto time = hn::Set(bits, static_cast<std::uint32_t>(column.time_ns));
  /// Gives `use` the quantities of one return of each channel.
  const auto make = [&](auto range_mm, auto reflectivity, std::uint32_t return_number, const auto& use) {
    const auto range = hn::Mul(hn::ConvertTo(d, hn::BitCast(whole, range_mm)), hn::Set(d, 1e-3f));
    const auto beam = hn::Sub(range, hn::Set(d, pixels.beam_m));
    const auto along = hn::Mul(beam, load(beams.along)), left = hn::Mul(beam, load(beams.left)),
               up = hn::Mul(beam, load(beams.up));
    const auto place = [&](int axis) {
      const auto part = [&](auto length, const Eigen::Vector3f& direction) {
        return hn::Mul(length, hn::Set(d, direction[axis]));
      };
      const auto flat = hn::Add(part(along, turn.along), part(left, turn.left));
      return word(hn::Add(hn::Add(flat, part(up, pixels.up)), hn::Set(d, turn.origin[axis])));
    };
    const auto tags = hn::Or(hn::Load(bits, beams.ring.data() + at), hn::Set(bits, tags_of(0, 0, return_number)));
    return use(place(0), place(1), place(2), word(range), azimuth, time, hn::Or(tags, hn::ShiftLeft<16>(reflectivity)));
  };

  const auto first = hn::Load(bits, words.first.data() + at), second = hn::Load(bits, words.second.data() + at);
  const auto first_mm = range_of(first);
  const auto of_first = shifted(pixels.reflectivity_at < 4 ? first : second, pixels.reflectivity_at);
  if constexpr (!kIsDual) {
    return make(first_mm, of_first, 1,
                [&](auto... quantities) { return write_returns(is_kept(first_mm), quantities..., one, out); });
  } else {
    // The nearer return first. One that is none, of range 0, becomes the farthest. Equal ones are one.
    const auto second_mm = range_of(second), of_second = shifted(second, pixels.reflectivity_at);
    const auto first_key = hn::Sub(first_mm, one), second_key = hn::Sub(second_mm, one);
    const auto is_exchanged = hn::Gt(first_key, second_key);
    const auto is_pair =
        hn::AndNot(hn::Eq(hn::Max(first_key, second_key), hn::Set(bits, ~0U)), hn::Ne(first_key, second_key));
    const auto near = hn::IfThenElse(is_exchanged, second_mm, first_mm),
               far = hn::IfThenElse(is_exchanged, first_mm, second_mm);
    const auto of_near = hn::IfThenElse(is_exchanged, of_second, of_first),
               of_far = hn::IfThenElse(is_exchanged, of_first, of_second);
    const auto keeps_far = hn::And(is_pair, is_kept(far));
    const auto count = hn::IfThenElse(is_pair, hn::Set(bits, 2U), one);
    if (hn::AllFalse(bits, keeps_far))
      return make(near, of_near, 1,
                  [&](auto... quantities) { return write_returns(is_kept(near), quantities..., count, out); });
    Lanes lanes[2];
    make(near, of_near, 1, [&](auto... quantities) { lanes[0].store(is_kept(near), quantities..., count); });
    make(far, of_far, 2, [&](auto... quantities) { lanes[1].store(keeps_far, quantities..., count); });
    return write_in_turn(lanes, out);
  }
}

/// Replaces `returns` by those of the columns. `scratch` has room for kWrittenAhead more.
void decode_columns(std::span<const OusterKernel::Column> columns, const OusterKernel::Pixels& pixels,
                    const OusterKernel::Beams& beams, LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  LaserReturn* out = scratch;
  for (const OusterKernel::Column& column : columns) {
    OusterWords words;
    load_pixels(column.pixels, pixels, words);
    for (std::size_t c = 0; c < pixels.channels; c += kLanes)
      out = pixels.profile.is_dual ? decode_pixels<true>(column, pixels, beams, words, c, out)
                                   : decode_pixels<false>(column, pixels, beams, words, c, out);
  }
  returns.assign(scratch, out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(decode_columns);
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

/// Columns of one packet are fired within milliseconds. If their times differ by more, one of them is wrong.
constexpr std::uint64_t kLongestPacketNs = 1'000'000'000;

/// Returns the angle in [0, 2 pi).
double whole_turn(double angle) {
  const double rest = std::fmod(angle, kTwoPi);
  return rest < 0 ? rest + kTwoPi : rest;
}

}  // namespace

OusterKernel::OusterKernel(const OusterMetadata& metadata, double min_range_m, double max_range_m)
    : metadata_(metadata),
      scratch_(2 * static_cast<std::size_t>(metadata.channels) * static_cast<std::size_t>(metadata.columns_per_packet) +
               kWrittenAhead) {
  pixels_.profile = *metadata.profile;
  pixels_.channels = static_cast<std::size_t>(metadata.channels);
  pixels_.reflectivity_at = metadata.profile->reflectivity_at + (metadata.has_wide_reflectivity ? 1 : 0);
  // A range of 0 means "no return", whatever the configuration says.
  const double nearest_mm = std::max(1.0, std::ceil(min_range_m * 1e3 - 1e-6));
  const double farthest_mm = std::floor(std::min(max_range_m, 2000.0) * 1e3 + 1e-6);
  pixels_.nearest_mm = static_cast<std::uint32_t>(nearest_mm);
  pixels_.count = static_cast<std::uint32_t>(std::max(0.0, farthest_mm - nearest_mm + 1));
  pixels_.beam_m = static_cast<float>(portable::hypot(metadata.beam_x_m, metadata.beam_z_m));
  // The maker's sensor frame has x forward and y left.
  Eigen::Matrix3d R_scanner_sensor;
  R_scanner_sensor << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3d R = R_scanner_sensor * metadata.R_sensor_lidar;
  pixels_.up = R.col(2).cast<float>();
  for (int column = 0; column < metadata.columns_per_frame; ++column) {
    // The encoder counts clockwise seen from above.
    const double encoder = -kTwoPi * column / metadata.columns_per_frame;
    const Eigen::Vector3d along = R * Eigen::Vector3d(portable::cos(encoder), portable::sin(encoder), 0);
    Turn turn;
    turn.along = along.cast<float>();
    turn.left = (R * Eigen::Vector3d(-portable::sin(encoder), portable::cos(encoder), 0)).cast<float>();
    turn.origin = (along * metadata.beam_x_m + R.col(2) * metadata.beam_z_m).cast<float>();
    turn.azimuth = static_cast<float>(whole_turn(portable::atan2(along.x(), along.y())));
    turns_.push_back(turn);
  }
  for (std::size_t c = 0; c < pixels_.channels; ++c) {
    const double altitude = metadata.altitudes_deg[c] * kRadPerDeg, azimuth = metadata.azimuths_deg[c] * kRadPerDeg;
    beams_.along[c] = static_cast<float>(portable::cos(altitude) * portable::cos(azimuth));
    beams_.left[c] = static_cast<float>(-portable::cos(altitude) * portable::sin(azimuth));
    beams_.up[c] = static_cast<float>(portable::sin(altitude));
    beams_.azimuth[c] = static_cast<float>(azimuth);
    beams_.ring[c] = static_cast<std::uint32_t>(
        std::ranges::count_if(metadata.altitudes_deg, [&](double other) { return other < metadata.altitudes_deg[c]; }));
  }
}

OusterColumns OusterKernel::decode(std::span<const std::byte> bytes, std::vector<LaserReturn>& returns) {
  OusterColumns result;
  const std::size_t stride = metadata_.column_bytes();
  const auto column_at = [&](int i) {
    return bytes.data() + metadata_.head_bytes() + stride * static_cast<std::size_t>(i);
  };
  // A clock that is set back within a packet is no reason for times before the packet's.
  bool has_time = false;
  result.first_ns = decode_ouster_column(column_at(0), metadata_).time_ns;
  for (int i = 0; i < metadata_.columns_per_packet; ++i) {
    const OusterColumn column = decode_ouster_column(column_at(i), metadata_);
    if (!column.is_valid) continue;
    result.first_ns = has_time ? std::min(result.first_ns, column.time_ns) : column.time_ns;
    has_time = true;
  }
  columns_.clear();
  for (int i = 0; i < metadata_.columns_per_packet; ++i) {
    const std::byte* bytes_of_column = column_at(i);
    const OusterColumn column = decode_ouster_column(bytes_of_column, metadata_);
    if (!column.is_valid) {
      ++result.invalid;
      continue;
    }
    const std::uint64_t since_first = column.time_ns - result.first_ns;
    if (column.number >= metadata_.columns_per_frame || since_first > kLongestPacketNs) {
      ++result.malformed;
      continue;
    }
    columns_.push_back({bytes_of_column + metadata_.column_head_bytes(),
                        &turns_[static_cast<std::size_t>(column.number)], static_cast<std::int32_t>(since_first)});
  }
  HWY_DYNAMIC_DISPATCH(decode_columns)(columns_, pixels_, beams_, scratch_.data(), returns);
  return result;
}

}  // namespace hueline::drivers
#endif
