// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/hesai/hesai_kernel.cpp"
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
#include "drivers/hesai/hesai_kernel.hpp"
#include "drivers/range_steps.hpp"
#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

using HesaiWords = std::array<std::uint32_t, HesaiKernel::kMost>;

/// Reads the units of a block: distance and reflectivity in the lower bytes. Behind the last channel are none.
HWY_INLINE void load_units(const std::byte* bytes, const HesaiKernel::Units& units, HesaiWords& words) {
  const WordTag d;
  std::size_t c = 0;
  if (units.bytes == 4)
    for (; c + kLanes <= units.channels; c += kLanes)
      hn::Store(hn::LoadU(d, reinterpret_cast<const std::uint32_t*>(bytes + 4 * c)), d, words.data() + c);
  else
    // Behind the blocks of each model there are more than the four bytes that may be read beyond the last unit.
    for (; c + kLanes <= units.channels; c += kLanes) hn::Store(load_triples(bytes + 3 * c), d, words.data() + c);
  for (; c < units.channels; ++c) {
    words[c] = 0;
    std::memcpy(&words[c], bytes + units.bytes * c, 3);
  }
  for (; c % kLanes != 0; ++c) words[c] = 0;
}

/// Writes the returns of kLanes firings from channel `at` on, and returns the end.
template <std::size_t kReturns>
HWY_INLINE LaserReturn* decode_firings(const HesaiKernel::Group& group, const HesaiKernel::Units& units,
                                       const HesaiKernel::Channels& channels,
                                       const std::array<HesaiWords, HesaiKernel::kMostReturns>& blocks, std::size_t at,
                                       LaserReturn* out) {
  const FloatTag d;
  const IntTag whole;
  const WordTag bits;
  const auto load = [&](const HesaiKernel::Floats& table) { return hn::Load(d, table.data() + at); };
  const auto distance_of = [&](auto words) { return hn::And(words, hn::Set(bits, 0xFFFFU)); };
  const auto one = hn::Set(bits, 1U);

  const auto sin_block = hn::Set(d, group.direction.sine), cos_block = hn::Set(d, group.direction.cosine);
  const auto sin_own = load(channels.sin_azimuth), cos_own = load(channels.cos_azimuth);
  const auto sin_still = hn::Add(hn::Mul(sin_block, cos_own), hn::Mul(cos_block, sin_own));
  const auto cos_still = hn::Sub(hn::Mul(cos_block, cos_own), hn::Mul(sin_block, sin_own));
  const auto& times = group.has_other_times ? channels.other_time_ns : channels.time_ns;
  const auto own_time = hn::Load(whole, times.data() + at);
  const auto time = hn::Add(hn::Set(whole, group.time_ns), own_time);
  // The head turns by less than 3 degrees from the block's time to the firing: two terms of the series are enough.
  const auto turn = hn::Mul(hn::ConvertTo(d, own_time), hn::Set(d, units.turn));
  const auto square = hn::Mul(turn, turn);
  const auto sin_turn = hn::Mul(turn, hn::Sub(hn::Set(d, 1.0f), hn::Mul(square, hn::Set(d, 1.0f / 6))));
  const auto cos_turn = hn::Sub(hn::Set(d, 1.0f), hn::Mul(square, hn::Set(d, 0.5f)));
  const auto sine = hn::Add(hn::Mul(sin_still, cos_turn), hn::Mul(cos_still, sin_turn));
  const auto cosine = hn::Sub(hn::Mul(cos_still, cos_turn), hn::Mul(sin_still, sin_turn));
  const auto azimuth = in_circle(hn::Add(hn::Add(hn::Set(d, group.azimuth), load(channels.azimuth)), turn));

  // A distance that is too near becomes a large number, because words have no sign.
  const auto is_kept = [&](auto words) {
    return hn::Lt(hn::Sub(distance_of(words), hn::Set(bits, units.nearest)), hn::Set(bits, units.count));
  };
  /// Gives `use` the quantities of one return of each firing.
  const auto make = [&](auto words, std::uint32_t return_number, const auto& use) {
    const auto range = hn::Mul(hn::ConvertTo(d, hn::BitCast(whole, distance_of(words))), hn::Set(d, units.range_step));
    const auto flat = hn::Mul(range, load(channels.cos_elevation));
    const auto tags = hn::Or(hn::Load(bits, channels.ring.data() + at), hn::Set(bits, tags_of(0, 0, return_number)));
    const auto word = [&](auto lanes) { return hn::BitCast(bits, lanes); };
    return use(word(hn::Mul(flat, sine)), word(hn::Mul(flat, cosine)),
               word(hn::Mul(range, load(channels.sin_elevation))), word(range), word(azimuth), word(time),
               hn::Or(tags, hn::And(words, hn::Set(bits, tags_of(0, 0xFF, 0)))));
  };

  const auto load_block = [&](std::size_t block) {
    const auto words = hn::Load(bits, blocks[block].data() + at);
    return hn::IfThenZeroElse(hn::Lt(distance_of(words), hn::Set(bits, HesaiKernel::kLeastDistance)), words);
  };
  auto first = load_block(0);
  if constexpr (kReturns == 1) {
    return make(first, 1, [&](auto... quantities) { return write_returns(is_kept(first), quantities..., one, out); });
  } else {
    // By range, and of equal ones the first. One that is none, of distance 0, becomes the farthest.
    const auto is_same = [&](auto a, auto b) { return hn::Eq(distance_of(a), distance_of(b)); };
    const auto sort = [&](auto& a, auto& b) {
      const auto is_wrong = hn::Gt(hn::Sub(distance_of(a), one), hn::Sub(distance_of(b), one));
      const auto near = hn::IfThenElse(is_wrong, b, a);
      b = hn::IfThenElse(is_wrong, a, b);
      a = near;
    };
    const auto count_of = [&](auto words) {
      return hn::IfThenElseZero(hn::Ne(distance_of(words), hn::Zero(bits)), one);
    };
    auto second = load_block(1);
    second = hn::IfThenZeroElse(is_same(second, first), second);
    if constexpr (kReturns == 2) {
      sort(first, second);
      const auto count = hn::Add(count_of(first), count_of(second));
      if (hn::AllFalse(bits, is_kept(second)))
        return make(first, 1,
                    [&](auto... quantities) { return write_returns(is_kept(first), quantities..., count, out); });
      Lanes lanes[2];
      make(first, 1, [&](auto... quantities) { lanes[0].store(is_kept(first), quantities..., count); });
      make(second, 2, [&](auto... quantities) { lanes[1].store(is_kept(second), quantities..., count); });
      return write_in_turn(lanes, out);
    } else {
      auto third = load_block(2);
      third = hn::IfThenZeroElse(hn::Or(is_same(third, first), is_same(third, second)), third);
      sort(first, second);
      sort(second, third);
      sort(first, second);
      const auto count = hn::Add(hn::Add(count_of(first), count_of(second)), count_of(third));
      Lanes lanes[3];
      make(first, 1, [&](auto... quantities) { lanes[0].store(is_kept(first), quantities..., count); });
      make(second, 2, [&](auto... quantities) { lanes[1].store(is_kept(second), quantities..., count); });
      make(third, 3, [&](auto... quantities) { lanes[2].store(is_kept(third), quantities..., count); });
      return write_in_turn(lanes, out);
    }
  }
}

template <std::size_t kReturns>
HWY_INLINE LaserReturn* decode_group(const HesaiKernel::Group& group, const HesaiKernel::Units& units,
                                     const HesaiKernel::Channels& channels, LaserReturn* out) {
  alignas(64) std::array<HesaiWords, HesaiKernel::kMostReturns> blocks;
  for (std::size_t i = 0; i < kReturns; ++i) load_units(group.units[i], units, blocks[i]);
  for (std::size_t c = 0; c < units.channels; c += kLanes)
    out = decode_firings<kReturns>(group, units, channels, blocks, c, out);
  return out;
}

/// Replaces `returns` by those of the groups, whose firings have up to `most` returns. `scratch` has room for one more.
void decode_groups(std::span<const HesaiKernel::Group> groups, int most, const HesaiKernel::Units& units,
                   const HesaiKernel::Channels& channels, LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  LaserReturn* out = scratch;
  for (const HesaiKernel::Group& group : groups)
    out = most == 1   ? decode_group<1>(group, units, channels, out)
          : most == 2 ? decode_group<2>(group, units, channels, out)
                      : decode_group<3>(group, units, channels, out);
  returns.assign(scratch, out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(decode_groups);
namespace {

unsigned u16(const std::byte* p) { return static_cast<unsigned>(p[0]) | static_cast<unsigned>(p[1]) << 8U; }

}  // namespace

HesaiKernel::HesaiKernel(const HesaiDecoder::Config& config)
    : table_(hesai_table(config.model)),
      min_range_m_(config.min_range_m),
      max_range_m_(config.max_range_m.value_or(1e9)),
      scratch_(table_.beams.size() * static_cast<std::size_t>(table_.blocks) + 1) {
  const auto beam = [&](std::size_t c) {
    if (config.elevations_deg.empty()) return table_.beams[c];
    return HesaiBeam{config.elevations_deg[c], config.azimuths_deg[c]};
  };
  for (std::size_t c = 0; c < table_.beams.size(); ++c) {
    const double elevation = beam(c).elevation_deg * kRadPerDeg, azimuth = beam(c).azimuth_deg * kRadPerDeg;
    std::uint32_t ring = 0;
    for (std::size_t other = 0; other < table_.beams.size(); ++other)
      ring += beam(other).elevation_deg < beam(c).elevation_deg ? 1 : 0;
    channels_.sin_elevation[c] = static_cast<float>(portable::sin(elevation));
    channels_.cos_elevation[c] = static_cast<float>(portable::cos(elevation));
    channels_.sin_azimuth[c] = static_cast<float>(portable::sin(azimuth));
    channels_.cos_azimuth[c] = static_cast<float>(portable::cos(azimuth));
    channels_.azimuth[c] = static_cast<float>(azimuth);
    channels_.time_ns[c] = table_.times[c];
    channels_.other_time_ns[c] = !table_.times_of_second.empty()         ? table_.times_of_second[c]
                                 : table_.times[c] >= table_.fine_period ? table_.times[c] - table_.fine_period
                                                                         : table_.times[c];
    channels_.ring[c] = ring;
  }
}

/// Returns the time of a block after the packet's time. The blocks of the same firings have the same.
std::int32_t HesaiKernel::block_ns(int block, const HesaiPacket& packet) const {
  const std::int32_t period = packet.is_fine ? table_.fine_period : table_.block_period;
  if (table_.first_block != 0) return table_.first_block + period * (block / packet.returns);
  return table_.last_block - period * ((table_.blocks - block - 1) / packet.returns);
}

HesaiBlocks HesaiKernel::decode(std::span<const std::byte> bytes, const HesaiPacket& packet,
                                std::vector<LaserReturn>& returns) {
  const auto& directions = azimuth_directions();
  Units units{};
  units.channels = table_.beams.size();
  units.bytes = table_.unit;
  units.range_step = static_cast<float>(packet.range_step_m);
  units.turn = static_cast<float>(packet.turns_per_min * (2 * std::numbers::pi / 60e9));
  const auto [nearest, steps] = range_steps(min_range_m_, max_range_m_, packet.range_step_m);
  units.nearest = nearest;
  units.count = steps;

  HesaiBlocks result;
  const auto& times = packet.is_fine ? channels_.other_time_ns : channels_.time_ns;
  const auto shortest = *std::min_element(times.begin(), times.begin() + table_.channels());
  const std::int32_t first_ns = block_ns(0, packet) + shortest;
  result.first_firing = nanoseconds(first_ns);
  std::array<Group, kMostBlocks> groups;
  std::size_t count = 0;
  for (int b = 0; b < table_.blocks; b += packet.returns) {
    const std::byte* first = bytes.data() + table_.head + table_.block_bytes() * static_cast<std::size_t>(b);
    const auto azimuth = static_cast<int>(u16(first + table_.flag));
    bool is_good = azimuth < kAzimuthsOfCircle;
    for (int i = 0; i < packet.returns; ++i) {
      const std::byte* block = first + table_.block_bytes() * static_cast<std::size_t>(i);
      is_good &= std::memcmp(block, first, table_.flag + 2) == 0;
      is_good &= table_.flag == 0 || u16(block) == 0xEEFF;
    }
    if (!is_good) {
      result.malformed += packet.returns;
      continue;
    }
    const bool is_second = !table_.times_of_second.empty() && (packet.returns == 1 ? b % 2 != 0 : packet.is_second);
    Group& group = groups[count++];
    group.units = {};
    for (int i = 0; i < packet.returns; ++i)
      group.units[static_cast<std::size_t>(i)] =
          first + table_.block_bytes() * static_cast<std::size_t>(i) + table_.flag + 2;
    group.azimuth = static_cast<float>(azimuth) * kAzimuthStep;
    group.direction = directions[static_cast<std::size_t>(azimuth)];
    group.time_ns = block_ns(b, packet) - first_ns;
    group.has_other_times = is_second || packet.is_fine;
  }
  HWY_DYNAMIC_DISPATCH(decode_groups)
  ({groups.data(), count}, packet.returns, units, channels_, scratch_.data(), returns);
  return result;
}

}  // namespace hueline::drivers
#endif
