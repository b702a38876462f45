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

/// Reads the units of kLanes channels from `at` on: distance and reflectivity in the lower bytes. Behind the last
/// channel are none. Models with units of four bytes have a multiple of 16 channels. Behind the blocks of each model
/// there are more than the four bytes that may be read beyond the last unit.
HWY_INLINE Words load_units(const std::byte* bytes, const HesaiKernel::Units& units, std::size_t at) {
  if (units.bytes == 4) return hn::LoadU(WordTag(), reinterpret_cast<const std::uint32_t*>(bytes + 4 * at));
  return load_triples(bytes + 3 * at, units.channels - at);
}

/// Writes the returns of kLanes firings from channel `at` on, and returns the end.
template <std::size_t kReturns>
HWY_INLINE LaserReturn* decode_firings(const HesaiKernel::Group& group, const HesaiKernel::Units& units,
                                       const HesaiKernel::Channels& channels, std::size_t at, LaserReturn* out) {
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
  const auto time = hn::Add(hn::Set(whole, group.time_ns), hn::Load(whole, group.turns->time_ns.data() + at));
  const auto sin_turn = load(group.turns->sine), cos_turn = load(group.turns->cosine);
  const auto sine = hn::Add(hn::Mul(sin_still, cos_turn), hn::Mul(cos_still, sin_turn));
  const auto cosine = hn::Sub(hn::Mul(cos_still, cos_turn), hn::Mul(sin_still, sin_turn));
  const auto still = hn::Add(hn::Set(d, group.azimuth), load(channels.azimuth));
  const auto turned = hn::Add(still, load(group.turns->angle));
  const auto azimuth = group.is_near_north ? in_circle(turned) : turned;

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
    const auto words = load_units(group.units[block], units, at);
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
HWY_INLINE LaserReturn* decode_all(std::span<const HesaiKernel::Group> groups, const HesaiKernel::Units& units,
                                   const HesaiKernel::Channels& channels, LaserReturn* out) {
  for (const HesaiKernel::Group& group : groups)
    for (std::size_t c = 0; c < units.channels; c += kLanes)
      out = decode_firings<kReturns>(group, units, channels, c, out);
  return out;
}

/// Replaces `returns` by those of the groups, whose firings have up to `most` returns. `scratch` has room for
/// kWrittenAhead more.
void decode_groups(std::span<const HesaiKernel::Group> groups, int most, const HesaiKernel::Units& units,
                   const HesaiKernel::Channels& channels, LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  returns.assign(scratch, most == 1   ? decode_all<1>(groups, units, channels, scratch)
                          : most == 2 ? decode_all<2>(groups, units, channels, scratch)
                                      : decode_all<3>(groups, units, channels, scratch));
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
      scratch_(table_.beams.size() * static_cast<std::size_t>(table_.blocks) + kWrittenAhead) {
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
    channels_.ring[c] = ring;
    turns_.time_ns[c] = table_.times[c];
    other_turns_.time_ns[c] = !table_.times_of_second.empty()         ? table_.times_of_second[c]
                              : table_.times[c] >= table_.fine_period ? table_.times[c] - table_.fine_period
                                                                      : table_.times[c];
    most_aside_ = std::max(most_aside_, std::abs(channels_.azimuth[c]));
  }
  for (Turns* turns : {&turns_, &other_turns_})
    turns->first_ns = *std::min_element(turns->time_ns.begin(), turns->time_ns.begin() + table_.channels());
  units_.channels = table_.beams.size();
  units_.bytes = table_.unit;
}

/// Fills what depends on the packet's step of the distances and on its speed of the head, if it has changed.
void HesaiKernel::follow(const HesaiPacket& packet) {
  if (packet.range_step_m != step_m_) {
    step_m_ = packet.range_step_m;
    units_.range_step = static_cast<float>(step_m_);
    const auto [nearest, count] = range_steps(min_range_m_, max_range_m_, step_m_);
    units_.nearest = nearest;
    units_.count = count;
  }
  if (packet.turns_per_min == turns_per_min_) return;
  turns_per_min_ = packet.turns_per_min;
  const auto rad_per_ns = static_cast<float>(turns_per_min_ * (2 * std::numbers::pi / 60e9));
  aside_ = most_aside_;
  for (Turns* turns : {&turns_, &other_turns_})
    for (std::size_t c = 0; c < units_.channels; ++c) {
      // The head turns by less than 3 degrees from the block's time to the firing: two terms of the series are enough.
      const float turn = static_cast<float>(turns->time_ns[c]) * rad_per_ns, square = turn * turn;
      turns->angle[c] = turn;
      aside_ = std::max(aside_, most_aside_ + std::abs(turn));
      turns->sine[c] = turn * (1.0f - square * (1.0f / 6));
      turns->cosine[c] = 1.0f - square * 0.5f;
    }
}

HesaiBlocks HesaiKernel::decode(std::span<const std::byte> bytes, const HesaiPacket& packet,
                                std::vector<LaserReturn>& returns) {
  follow(packet);
  const auto& directions = azimuth_directions();
  const std::int32_t period = packet.is_fine ? table_.fine_period : table_.block_period;
  const int groups = table_.blocks / packet.returns;
  std::int32_t since_first = table_.first_block != 0 ? table_.first_block : table_.last_block - period * (groups - 1);
  HesaiBlocks result;
  const std::int32_t first_ns = since_first + (packet.is_fine ? other_turns_ : turns_).first_ns;
  result.first_firing = nanoseconds(first_ns);
  since_first -= first_ns;

  std::array<Group, kMostBlocks> wanted;
  std::size_t count = 0;
  const std::byte* block = bytes.data() + table_.head;
  for (int g = 0; g < groups; ++g, since_first += period) {
    Group& group = wanted[count];
    group.units = {};
    const unsigned azimuth = u16(block + table_.flag);
    bool is_good = azimuth < static_cast<unsigned>(kAzimuthsOfCircle);
    for (int i = 0; i < packet.returns; ++i, block += table_.block_bytes()) {
      is_good &= u16(block + table_.flag) == azimuth;
      is_good &= table_.flag == 0 || u16(block) == 0xEEFF;
      group.units[static_cast<std::size_t>(i)] = block + table_.flag + 2;
    }
    if (!is_good) {
      result.malformed += packet.returns;
      continue;
    }
    const bool is_second = !table_.times_of_second.empty() && (packet.returns == 1 ? g % 2 != 0 : packet.is_second);
    group.turns = is_second || packet.is_fine ? &other_turns_ : &turns_;
    group.azimuth = static_cast<float>(azimuth) * kAzimuthStep;
    // A little more than what is aside, for the sum of three angles is rounded.
    const float aside = aside_ + 1e-5f;
    group.is_near_north = group.azimuth < aside || group.azimuth > 2 * std::numbers::pi_v<float> - aside;
    group.direction = directions[azimuth];
    group.time_ns = since_first;
    ++count;
  }
  HWY_DYNAMIC_DISPATCH(decode_groups)
  ({wanted.data(), count}, packet.returns, units_, channels_, scratch_.data(), returns);
  return result;
}

}  // namespace hueline::drivers
#endif
