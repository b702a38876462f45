// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/robosense/robosense_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/portable_math.hpp"
#include "drivers/portable_vectors-inl.hpp"
#include "drivers/robosense/robosense_kernel.hpp"
#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

/// Directions and times of the firings of a block.
struct RobosenseDirections {
  alignas(64) RobosenseKernel::Floats sin_azimuth, cos_azimuth, lens_x, lens_y, azimuth;
  alignas(64) std::array<std::int32_t, RobosenseKernel::kChannels> time_ns;
};

HWY_INLINE void fill_directions(const RobosenseBlock& block, const RobosenseKernel::Units& units,
                                const RobosenseKernel::Channels& channels, std::size_t count,
                                RobosenseDirections& out) {
  const FloatTag d;
  const auto set = [&](double value) { return hn::Set(d, static_cast<float>(value)); };
  const auto mul = [](auto a, auto b) { return hn::Mul(a, b); };
  const auto sin_block = hn::Set(d, block.direction.sine), cos_block = hn::Set(d, block.direction.cosine);
  const auto to_side = set(units.is_reversed ? -1 : 1), radius = set(units.lens_radius_m);
  for (std::size_t c = 0; c < count; c += kLanes) {
    const auto load = [&](const RobosenseKernel::Floats& table) { return hn::Load(d, table.data() + c); };
    const auto store = [&](auto value, RobosenseKernel::Floats& table) { hn::Store(value, d, table.data() + c); };
    // Since the block's azimuth was read the scanner has turned a degree or two at most.
    const auto since = mul(set(block.step), load(channels.after_periods));
    const auto q = mul(since, since);
    auto sin_since = set(1.0 / 120), cos_since = set(-1.0 / 720);
    sin_since = hn::Add(since, mul(mul(since, q), hn::Add(set(-1.0 / 6), mul(q, sin_since))));
    for (const double term : {1.0 / 24, -1.0 / 2, 1.0}) cos_since = hn::Add(set(term), mul(q, cos_since));
    const auto sin_turned = hn::Add(mul(sin_block, cos_since), mul(cos_block, sin_since));
    const auto cos_turned = hn::Sub(mul(cos_block, cos_since), mul(sin_block, sin_since));
    const auto sin_own = load(channels.sin_azimuth), cos_own = load(channels.cos_azimuth);
    store(mul(to_side, hn::Add(mul(sin_turned, cos_own), mul(cos_turned, sin_own))), out.sin_azimuth);
    store(hn::Sub(mul(cos_turned, cos_own), mul(sin_turned, sin_own)), out.cos_azimuth);
    store(mul(to_side, mul(radius, sin_turned)), out.lens_x);
    store(mul(radius, cos_turned), out.lens_y);
  }
  const DoubleTag wide;
  const auto turn = double_of(2 * std::numbers::pi), zero = hn::Zero(wide);
  const double aside = units.most_aside + block.step * units.most_after;
  const bool is_within = !units.is_reversed && block.azimuth > aside && block.azimuth < 2 * std::numbers::pi - aside;
  for (std::size_t c = 0; c < count; c += kDoubles) {
    const auto load = [&](const RobosenseKernel::Doubles& table) { return hn::Load(wide, table.data() + c); };
    const auto since = hn::Mul(double_of(block.step), load(channels.after));
    const auto azimuth = hn::Add(hn::Add(double_of(block.azimuth), since), load(channels.azimuth));
    auto within = units.is_reversed ? hn::Neg(azimuth) : azimuth;
    if (!is_within) {  // less than two turns either way
      within = hn::Sub(within, hn::IfThenElseZero(hn::Ge(within, turn), turn));
      for (int i = 0; i < 2; ++i) within = hn::Add(within, hn::IfThenElseZero(hn::Lt(within, zero), turn));
    }
    store_floats(within, out.azimuth.data() + c);
    const auto time_us = hn::Add(double_of(block.time_us), load(channels.after_us));
    store_integers(rounded(hn::Mul(time_us, double_of(1e3))), out.time_ns.data() + c);
  }
}

/// Writes the returns of kLanes firings from `at` on, and returns the end.
template <bool kIsDual>
HWY_INLINE LaserReturn* decode_firings(const RobosenseKernel::Firings& firings, const RobosenseKernel::Units& units,
                                       const RobosenseKernel::Channels& channels, const RobosenseDirections& directions,
                                       std::size_t at, LaserReturn* out) {
  const FloatTag d;
  const WordTag bits;
  const auto one = hn::Set(bits, 1U);
  const auto range_of = [&](auto words) { return hn::And(words, hn::Set(bits, 0xFFFFU)); };
  /// Range in the lower half of the word, then reflectivity. A range of 0xFFFF is none, as one of 0.
  const auto read = [&](const std::byte* unit) {
    const auto words = load_triples<true>(unit + 3 * at);
    return hn::IfThenZeroElse(hn::Eq(range_of(words), hn::Set(bits, 0xFFFFU)), words);
  };
  // A range that is too near becomes a large number, because words have no sign.
  const auto is_kept = [&](auto words) {
    return hn::Lt(hn::Sub(range_of(words), hn::Set(bits, units.nearest)), hn::Set(bits, units.count));
  };
  const auto load = [&](const RobosenseKernel::Floats& table) { return hn::Load(d, table.data() + at); };
  const auto word = [&](auto lanes) { return hn::BitCast(bits, lanes); };
  const auto azimuth = word(hn::Min(load(directions.azimuth), hn::Set(d, kLargestAzimuth)));
  /// Gives `use` the quantities of one return of each firing.
  const auto make = [&](auto words, std::uint32_t return_number, const auto& use) {
    const auto steps = hn::ConvertTo(d, hn::BitCast(IntTag(), range_of(words)));
    const auto range = hn::Mul(steps, hn::Set(d, units.range_step));
    const auto across = hn::Mul(range, load(channels.cos_elevation));
    const auto x = hn::Add(hn::Mul(across, load(directions.sin_azimuth)), load(directions.lens_x));
    const auto y = hn::Add(hn::Mul(across, load(directions.cos_azimuth)), load(directions.lens_y));
    const auto z = hn::Add(hn::Mul(range, load(channels.sin_elevation)), hn::Set(d, units.lens_height));
    const auto tags = hn::Or(hn::Load(bits, channels.ring.data() + at), hn::Set(bits, tags_of(0, 0, return_number)));
    return use(word(x), word(y), word(z), word(range), azimuth,
               word(hn::Load(IntTag(), directions.time_ns.data() + at)),
               hn::Or(tags, hn::And(words, hn::Set(bits, tags_of(0, 0xFF, 0)))));
  };

  const auto first = read(firings.first);
  if constexpr (!kIsDual) {
    return make(first, 1, [&](auto... quantities) { return write_returns(is_kept(first), quantities..., one, out); });
  } else {
    // The nearer return first. One that is none, of range 0, becomes the farthest. Equal ones are one.
    const auto second = read(firings.second);
    const auto first_key = hn::Sub(range_of(first), one), second_key = hn::Sub(range_of(second), one);
    const auto is_exchanged = hn::Gt(first_key, second_key);
    const auto is_pair =
        hn::AndNot(hn::Eq(hn::Max(first_key, second_key), hn::Set(bits, ~0U)), hn::Ne(first_key, second_key));
    const auto near = hn::IfThenElse(is_exchanged, second, first), far = hn::IfThenElse(is_exchanged, first, second);
    const auto keeps_far = hn::And(is_pair, is_kept(far));
    const auto count = hn::IfThenElse(is_pair, hn::Set(bits, 2U), one);
    if (hn::AllFalse(bits, keeps_far))
      return make(near, 1, [&](auto... quantities) { return write_returns(is_kept(near), quantities..., count, out); });
    Lanes lanes[2];
    make(near, 1, [&](auto... quantities) { lanes[0].store(is_kept(near), quantities..., count); });
    make(far, 2, [&](auto... quantities) { lanes[1].store(keeps_far, quantities..., count); });
    return write_in_turn(lanes, out);
  }
}

/// Replaces `returns` by those of the firings. `scratch` has room for kWrittenAhead more.
void decode_robosense_firings(std::span<const RobosenseKernel::Firings> all, const RobosenseKernel::Units& units,
                              const RobosenseKernel::Channels& channels, LaserReturn* scratch,
                              std::vector<LaserReturn>& returns) {
  LaserReturn* out = scratch;
  RobosenseDirections directions;
  for (const RobosenseKernel::Firings& firings : all) {
    fill_directions(firings.block, units, channels, firings.count, directions);
    for (std::size_t c = 0; c < firings.count; c += kLanes)
      out = firings.second ? decode_firings<true>(firings, units, channels, directions, c, out)
                           : decode_firings<false>(firings, units, channels, directions, c, out);
  }
  returns.assign(scratch, out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(decode_robosense_firings);

RobosenseKernel::RobosenseKernel(const RobosenseTable& table, const RobosenseDescription& description,
                                 double range_unit_m, double min_range_m, double max_range_m) {
  const auto beams = static_cast<std::size_t>(table.beams);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const double elevation = description.elevations[c % beams];
    channels_.after_us[c] = table.channel_us[c];
    channels_.after[c] = table.channel_us[c] / table.firing_period_us;
    channels_.after_periods[c] = static_cast<float>(channels_.after[c]);
    channels_.azimuth[c] = description.azimuths[c % beams];
    channels_.sin_azimuth[c] = static_cast<float>(portable::sin(channels_.azimuth[c]));
    channels_.cos_azimuth[c] = static_cast<float>(portable::cos(channels_.azimuth[c]));
    channels_.sin_elevation[c] = static_cast<float>(portable::sin(elevation));
    channels_.cos_elevation[c] = static_cast<float>(portable::cos(elevation));
    channels_.ring[c] = static_cast<std::uint32_t>(
        std::ranges::count_if(description.elevations, [&](double other) { return other < elevation; }));
  }
  units_.range_step = static_cast<float>(range_unit_m);
  units_.lens_radius_m = table.lens_radius_m;
  units_.lens_height = static_cast<float>(table.lens_height_m);
  units_.is_reversed = description.is_reversed;
  for (const double azimuth : channels_.azimuth) units_.most_aside = std::max(units_.most_aside, std::abs(azimuth));
  for (const double after : channels_.after) units_.most_after = std::max(units_.most_after, after);
  // A range of 0 and one of 0xFFFF mean that there is none.
  const auto is_kept = [&](std::uint32_t range) {
    const double metres = range_unit_m * range;
    return range != 0 && range != 0xFFFF && metres >= min_range_m && metres <= max_range_m;
  };
  while (units_.nearest < 0xFFFF && !is_kept(units_.nearest)) ++units_.nearest;
  while (is_kept(units_.nearest + units_.count)) ++units_.count;
}

void RobosenseKernel::decode(std::span<const Firings> firings, std::vector<LaserReturn>& returns) {
  HWY_DYNAMIC_DISPATCH(decode_robosense_firings)(firings, units_, channels_, scratch_.data(), returns);
}

}  // namespace hueline::drivers
#endif
