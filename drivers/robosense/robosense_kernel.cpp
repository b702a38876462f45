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

using RobosenseWords = std::array<std::uint32_t, RobosenseKernel::kChannels>;

/// Range in the lower half of the word, then reflectivity. Units that are none have range 0, as those behind the last.
HWY_INLINE void read_units(const std::byte* unit, std::size_t count, RobosenseWords& words) {
  words.fill(0);
  for (std::size_t c = 0; c < count; ++c, unit += 3) {
    const unsigned range = static_cast<unsigned>(unit[0]) << 8U | static_cast<unsigned>(unit[1]);
    words[c] = (range == 0xFFFF ? 0 : range) | static_cast<unsigned>(unit[2]) << 16U;
  }
}

/// Directions and times of the firings of a block.
struct RobosenseDirections {
  alignas(64) RobosenseKernel::Doubles sin_azimuth, cos_azimuth, lens_x, lens_y;
  alignas(64) std::array<float, RobosenseKernel::kChannels> azimuth;
  alignas(64) std::array<std::int32_t, RobosenseKernel::kChannels> time_ns;
};

HWY_INLINE void fill_directions(const RobosenseBlock& block, const RobosenseKernel::Units& units,
                                const RobosenseKernel::Channels& channels, std::size_t count,
                                RobosenseDirections& out) {
  const DoubleTag d;
  const auto turn = double_of(2 * std::numbers::pi), zero = hn::Zero(d);
  for (std::size_t c = 0; c < count; c += kDoubles) {
    const auto after = hn::Load(d, channels.after_us.data() + c);
    auto turned = hn::Div(hn::Mul(double_of(block.step), after), double_of(units.firing_period_us));
    turned = hn::Add(double_of(block.azimuth), turned);
    auto azimuth = hn::Add(turned, hn::Load(d, channels.azimuth.data() + c));
    if (units.is_reversed) turned = hn::Neg(turned), azimuth = hn::Neg(azimuth);
    auto sine = zero, cosine = zero;
    sine_cosine(azimuth, sine, cosine);
    hn::Store(sine, d, out.sin_azimuth.data() + c);
    hn::Store(cosine, d, out.cos_azimuth.data() + c);
    sine_cosine(turned, sine, cosine);
    hn::Store(hn::Mul(double_of(units.lens_radius_m), sine), d, out.lens_x.data() + c);
    hn::Store(hn::Mul(double_of(units.lens_radius_m), cosine), d, out.lens_y.data() + c);
    // Less than two turns either way. What remains of an angle has its sign, also if it is 0, as std::fmod() has it.
    auto within = hn::Sub(azimuth, hn::IfThenElseZero(hn::Ge(azimuth, turn), turn));
    within = hn::CopySign(hn::Add(within, hn::IfThenElseZero(hn::Le(within, hn::Neg(turn)), turn)), azimuth);
    within = hn::IfThenElse(hn::Lt(within, zero), hn::Add(within, turn), within);
    store_floats(within, out.azimuth.data() + c);
    const auto time_us = hn::Add(double_of(block.time_us), after);
    store_integers(rounded(hn::Mul(time_us, double_of(1e3))), out.time_ns.data() + c);
  }
}

/// Writes the returns of kLanes firings from `at` on, and returns the end.
template <bool kIsDual>
HWY_INLINE LaserReturn* decode_firings(const RobosenseKernel::Units& units, const RobosenseKernel::Channels& channels,
                                       const RobosenseDirections& directions, const RobosenseWords& first_words,
                                       const RobosenseWords& second_words, std::size_t at, LaserReturn* out) {
  const DoubleTag wide;
  const WordTag bits;
  const auto one = hn::Set(bits, 1U);
  const auto range_of = [&](auto words) { return hn::And(words, hn::Set(bits, 0xFFFFU)); };
  // A range that is too near becomes a large number, because words have no sign.
  const auto is_kept = [&](auto words) {
    return hn::Lt(hn::Sub(range_of(words), hn::Set(bits, units.nearest)), hn::Set(bits, units.count));
  };
  const auto azimuth = hn::Min(hn::Load(FloatTag(), directions.azimuth.data() + at), hn::Set(FloatTag(), 6.2831850f));
  /// Gives `use` the quantities of one return of each firing.
  const auto make = [&](auto words, std::uint32_t return_number, const auto& use) {
    alignas(64) std::int32_t steps[kLanes];
    alignas(64) float x[kLanes], y[kLanes], z[kLanes], range_m[kLanes];
    hn::Store(hn::BitCast(IntTag(), range_of(words)), IntTag(), steps);
    for (std::size_t k = 0; k < kLanes; k += kDoubles) {
      const auto load = [&](const RobosenseKernel::Doubles& table) { return hn::Load(wide, table.data() + at + k); };
      const hn::Rebind<std::int32_t, DoubleTag> half;
      const auto range = hn::Mul(double_of(units.range_unit_m), hn::PromoteTo(wide, hn::LoadU(half, steps + k)));
      const auto across = hn::Mul(range, load(channels.cos_elevation));
      store_floats(hn::Add(hn::Mul(across, load(directions.sin_azimuth)), load(directions.lens_x)), x + k);
      store_floats(hn::Add(hn::Mul(across, load(directions.cos_azimuth)), load(directions.lens_y)), y + k);
      store_floats(hn::Add(hn::Mul(range, load(channels.sin_elevation)), double_of(units.lens_height_m)), z + k);
      store_floats(range, range_m + k);
    }
    const auto word = [&](const auto* quantity) {
      return hn::Load(bits, reinterpret_cast<const std::uint32_t*>(quantity));
    };
    const auto tags = hn::Or(word(channels.ring.data() + at), hn::Set(bits, tags_of(0, 0, return_number)));
    return use(word(x), word(y), word(z), word(range_m), hn::BitCast(bits, azimuth),
               word(directions.time_ns.data() + at), hn::Or(tags, hn::And(words, hn::Set(bits, tags_of(0, 0xFF, 0)))));
  };

  const auto first = hn::Load(bits, first_words.data() + at);
  if constexpr (!kIsDual) {
    return make(first, 1, [&](auto... quantities) { return write_returns(is_kept(first), quantities..., one, out); });
  } else {
    // The nearer return first. One that is none, of range 0, becomes the farthest. Equal ones are one.
    const auto second = hn::Load(bits, second_words.data() + at);
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

/// Replaces `returns` by those of the firings. `scratch` has room for one more.
void decode_robosense_firings(std::span<const RobosenseKernel::Firings> all, const RobosenseKernel::Units& units,
                              const RobosenseKernel::Channels& channels, LaserReturn* scratch,
                              std::vector<LaserReturn>& returns) {
  LaserReturn* out = scratch;
  RobosenseDirections directions;
  alignas(64) RobosenseWords first, second;
  for (const RobosenseKernel::Firings& firings : all) {
    fill_directions(firings.block, units, channels, firings.count, directions);
    read_units(firings.first, firings.count, first);
    if (firings.second) read_units(firings.second, firings.count, second);
    for (std::size_t c = 0; c < firings.count; c += kLanes)
      out = firings.second ? decode_firings<true>(units, channels, directions, first, second, c, out)
                           : decode_firings<false>(units, channels, directions, first, second, c, out);
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
    channels_.azimuth[c] = description.azimuths[c % beams];
    channels_.sin_elevation[c] = portable::sin(elevation);
    channels_.cos_elevation[c] = portable::cos(elevation);
    channels_.ring[c] = static_cast<std::uint32_t>(
        std::ranges::count_if(description.elevations, [&](double other) { return other < elevation; }));
  }
  units_.range_unit_m = range_unit_m;
  units_.firing_period_us = table.firing_period_us;
  units_.lens_radius_m = table.lens_radius_m;
  units_.lens_height_m = table.lens_height_m;
  units_.is_reversed = description.is_reversed;
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
