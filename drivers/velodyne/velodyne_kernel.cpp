// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/velodyne/velodyne_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <vector>

#include "core/portable_math.hpp"
#include "drivers/range_steps.hpp"
#include "drivers/velodyne/velodyne_kernel.hpp"
#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

constexpr std::size_t kFiringsAt = 4;  // in a block

/// Fills the turns of all banks for an azimuth step from the block to the next. It is at most 0.03 rad, so the error of
/// the series is at most 4e-8.
void fill_turns(std::span<const VelodyneKernel::Firings> banks, float step, VelodyneKernel::Turn* turns) {
  for (const VelodyneKernel::Firings& firings : banks) {
    VelodyneKernel::Turn& turn = *turns++;
    for (std::size_t f = 0; f < VelodyneKernel::kFirings; ++f) {
      const float turned = step * firings.fraction[f], turned2 = turned * turned;
      const float sin_turn = turned - turned * turned2 / 6.0f, cos_turn = 1.0f - turned2 / 2.0f;
      turn.sin_ahead[f] = firings.sin_azimuth[f] * cos_turn + firings.cos_azimuth[f] * sin_turn;
      turn.cos_ahead[f] = firings.cos_azimuth[f] * cos_turn - firings.sin_azimuth[f] * sin_turn;
      turn.turned[f] = turned;
    }
  }
}

/// Writes the returns of kLanes firings from `at` on, and returns the end.
template <bool kIsPair>
HWY_INLINE LaserReturn* decode_firings(const VelodyneKernel::Block& block, const VelodyneKernel::Choice& choice,
                                       std::size_t at, LaserReturn* out) {
  const FloatTag d;
  const IntTag whole;
  const WordTag bits;
  const VelodyneKernel::Firings& firings = *block.firings;
  const auto load = [&](const VelodyneKernel::Floats& table) { return hn::Load(d, table.data() + at); };
  const auto distance_of = [&](auto words) { return hn::And(words, hn::Set(bits, 0xFFFFU)); };

  // Directions.
  const auto sin_ahead = load(block.turn->sin_ahead), cos_ahead = load(block.turn->cos_ahead);
  const auto sin_block = hn::Set(d, block.direction.sine), cos_block = hn::Set(d, block.direction.cosine);
  const auto sine = hn::Add(hn::Mul(sin_block, cos_ahead), hn::Mul(cos_block, sin_ahead));
  const auto cosine = hn::Sub(hn::Mul(cos_block, cos_ahead), hn::Mul(sin_block, sin_ahead));
  const auto along = load(firings.cos_elevation), x = hn::Mul(along, sine), y = hn::Mul(along, cosine);
  const auto own = hn::Add(hn::Set(d, block.azimuth), load(firings.azimuth));
  const auto ahead = hn::Add(own, load(block.turn->turned));
  const auto azimuth = block.is_near_north ? in_circle(ahead) : ahead;
  const auto time = hn::Add(hn::Set(whole, block.time_ns), hn::Load(whole, firings.offset_ns.data() + at));

  // A distance that is too near becomes a large number, because words have no sign.
  const auto is_within = [&](auto words) {
    const auto past = hn::Sub(distance_of(words), hn::Set(bits, choice.nearest));
    return hn::Lt(past, hn::Set(bits, choice.count));
  };
  auto is_inside = hn::Eq(hn::Zero(bits), hn::Zero(bits));
  if (choice.has_window) {
    const auto past = hn::Sub(azimuth, hn::Set(d, choice.window_begin));
    const auto turn = hn::Set(d, static_cast<float>(2 * std::numbers::pi));
    const auto from_begin = hn::Add(past, hn::IfThenElseZero(hn::Lt(past, hn::Zero(d)), turn));
    is_inside = hn::RebindMask(bits, hn::Le(from_begin, hn::Set(d, choice.window_width)));
  }
  /// Gives `use` the quantities of one return of each firing, whose distance and reflectivity are in `words`.
  const auto make = [&](auto words, std::uint32_t return_number, const auto& use) {
    const auto range = hn::Mul(hn::ConvertTo(d, hn::BitCast(whole, distance_of(words))), hn::Set(d, choice.range_step));
    const auto z = hn::Add(hn::Mul(range, load(firings.sin_elevation)), load(firings.vertical_offset));
    const auto tags = hn::Or(hn::Load(bits, firings.channel.data() + at), hn::Set(bits, tags_of(0, 0, return_number)));
    const auto word = [&](auto lanes) { return hn::BitCast(bits, lanes); };
    return use(word(hn::Mul(range, x)), word(hn::Mul(range, y)), word(z), word(range), word(azimuth), word(time),
               hn::Or(tags, hn::And(words, hn::Set(bits, tags_of(0, 0xFF, 0)))));
  };

  const auto one = hn::Set(bits, 1U), two = hn::Set(bits, 2U);
  const auto last = load_triples(block.last + kFiringsAt + 3 * at);
  if constexpr (!kIsPair) {
    const auto is_kept = hn::And(is_inside, is_within(last));
    return make(last, 1, [&](auto... quantities) { return write_returns(is_kept, quantities..., one, out); });
  } else {
    // The even block holds the last return. The odd one holds the strongest, or the second strongest if the strongest
    // is the last. A firing with one return has it in both blocks, or in one of them only.
    const auto strongest = load_triples(block.strongest + kFiringsAt + 3 * at);
    // A distance of 0, which is none, becomes the largest, so that the one return that there is becomes the near one.
    const auto last_key = hn::Sub(distance_of(last), one), strongest_key = hn::Sub(distance_of(strongest), one);
    const auto last_is_far = hn::Gt(last_key, strongest_key),
               is_pair = hn::AndNot(hn::Eq(hn::Max(last_key, strongest_key), hn::Set(bits, ~0U)),
                                    hn::Ne(last_key, strongest_key));
    const auto near = hn::IfThenElse(last_is_far, strongest, last), far = hn::IfThenElse(last_is_far, last, strongest);
    auto wants_near = hn::And(is_inside, is_within(near)),
         wants_far = hn::And(hn::And(is_inside, is_pair), is_within(far));
    if (choice.returns != ReturnChoice::All) {
      const auto reflectivity = hn::Set(bits, tags_of(0, 0xFF, 0));
      const auto of_near = hn::And(near, reflectivity), of_far = hn::And(far, reflectivity);
      const auto near_is_stronger = hn::Or(hn::Gt(of_near, of_far), hn::And(hn::Eq(of_near, of_far), last_is_far));
      const auto near_is_chosen = choice.returns == ReturnChoice::Last ? hn::Not(last_is_far) : near_is_stronger;
      wants_near = hn::And(wants_near, hn::Or(hn::Not(is_pair), near_is_chosen));
      wants_far = hn::AndNot(near_is_chosen, wants_far);
    }
    const auto count = hn::IfThenElse(is_pair, two, one);
    if (hn::AllFalse(bits, wants_far))
      return make(near, 1, [&](auto... quantities) { return write_returns(wants_near, quantities..., count, out); });
    Lanes lanes[2];
    make(near, 1, [&](auto... quantities) { lanes[0].store(wants_near, quantities..., count); });
    make(far, 2, [&](auto... quantities) { lanes[1].store(wants_far, quantities..., two); });
    return write_in_turn(lanes, out);
  }
}

/// Replaces `returns` by those of the blocks. `scratch` has room for one more. The vector is filled here, because
/// copies are a third of the work, and are made with wide instructions as well.
void decode_blocks(std::span<const VelodyneKernel::Block> blocks, const VelodyneKernel::Choice& choice,
                   LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  LaserReturn* out = scratch;
  for (const VelodyneKernel::Block& block : blocks)
    for (std::size_t f = 0; f < VelodyneKernel::kFirings; f += kLanes)
      out =
          block.strongest ? decode_firings<true>(block, choice, f, out) : decode_firings<false>(block, choice, f, out);
  returns.assign(scratch, out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(decode_blocks);
HWY_EXPORT(fill_turns);
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kCircle = kAzimuthsOfCircle;
constexpr std::size_t kBlockBytes = 100;

/// The fastest model turns 20 times a second. An azimuth step of more than twice that rate is a jump. While the motor
/// rests, the azimuth trembles by at most kTremble (0.01 degrees).
constexpr double kMaxRevolutionsPerSecond = 40;
constexpr int kTremble = 20;

/// No firing's azimuth is further from its block's (0.01 degrees): lasers point up to 6.4 degrees aside, and within a
/// block the mirror turns by less than 2 degrees.
constexpr int kNearNorth = 1000;

/// The flags of a VLS-128's four blocks; other models have the first.
constexpr std::uint32_t kFlags[] = {0xEEFF, 0xDDFF, 0xCCFF, 0xBBFF};

/// Returns flag and azimuth of a block, the flag in the lower half.
std::uint32_t head_of(const std::byte* block) {
  std::uint32_t head;
  std::memcpy(&head, block, sizeof head);  // the program runs on little-endian computers only (novatel/wire.hpp)
  return head;
}

/// Returns the way from one azimuth to another, [-180, 180) degrees; it was computed without regard to north.
int shortest(int way) { return way < -kCircle / 2 ? way + kCircle : way >= kCircle / 2 ? way - kCircle : way; }

}  // namespace

VelodyneKernel::VelodyneKernel(const VelodyneDecoder::Config& config)
    : table_(velodyne_table(config.model)),
      period_(table_.block_period()),
      max_step_(static_cast<int>(kMaxRevolutionsPerSecond * kCircle * to_seconds(period_))),
      firings_(static_cast<std::size_t>(table_.banks())),
      turns_(firings_.size() * static_cast<std::size_t>(kTremble + max_step_ + 1)),
      mean_turns_(firings_.size()) {
  choice_.returns = config.returns;
  const auto [nearest, count] = range_steps(config.min_range_m, config.max_range_m.value_or(1e9), table_.range_step_m);
  choice_.nearest = nearest;
  choice_.count = count;
  choice_.range_step = static_cast<float>(table_.range_step_m);
  double width = config.azimuth_end - config.azimuth_begin;
  if (width < 0) width += 2 * kPi;
  choice_.has_window = width < 2 * kPi - 1e-9;
  choice_.window_begin = static_cast<float>(config.azimuth_begin);
  choice_.window_width = static_cast<float>(width);
  for (std::size_t bank = 0; bank < firings_.size(); ++bank)
    for (std::size_t f = 0; f < kFirings; ++f) {
      const int firing = static_cast<int>(bank * kFirings + f);
      const int laser = firing % table_.count();
      const VelodyneLaser& l = table_.lasers[static_cast<std::size_t>(laser)];
      const auto offset = table_.sequence_period * (firing / table_.count()) + table_.firing_time(laser);
      const auto ring = std::ranges::count_if(
          table_.lasers, [&](const VelodyneLaser& other) { return other.elevation_deg < l.elevation_deg; });
      // The rings keep the order of the nominal elevations, so that two scanners of a model have the same ones.
      const auto own = [&](const std::vector<double>& given, double nominal) {
        return given.empty() ? nominal : given[static_cast<std::size_t>(laser)];
      };
      const double elevation = own(config.elevations_deg, l.elevation_deg) * kPi / 180,
                   azimuth = own(config.azimuths_deg, l.azimuth_deg) * kPi / 180;
      Firings& table = firings_[bank];
      table.sin_elevation[f] = static_cast<float>(portable::sin(elevation));
      table.cos_elevation[f] = static_cast<float>(portable::cos(elevation));
      table.vertical_offset[f] = static_cast<float>(own(config.vertical_offsets_mm, l.vertical_offset_mm) * 1e-3);
      table.sin_azimuth[f] = static_cast<float>(portable::sin(azimuth));
      table.cos_azimuth[f] = static_cast<float>(portable::cos(azimuth));
      table.azimuth[f] = static_cast<float>(azimuth);
      table.fraction[f] = static_cast<float>(to_seconds(offset) / to_seconds(period_));
      table.offset_ns[f] = static_cast<std::int32_t>(offset.count());
      table.channel[f] = static_cast<std::uint32_t>(ring);
    }
  for (int step = -kTremble; step <= max_step_; ++step) HWY_DYNAMIC_DISPATCH(fill_turns)
  (firings_, static_cast<float>(step) * kAzimuthStep,
   &turns_[firings_.size() * static_cast<std::size_t>(step + kTremble)]);
}

/// Reads flag and azimuth of each block.
VelodyneKernel::Units VelodyneKernel::units_of(std::span<const std::byte> bytes, int copies) const {
  const int banks = static_cast<int>(firings_.size());
  Units out;
  for (int i = 0; i + banks * copies <= kVelodyneBlocks; ++out.count) {
    Unit& unit = out.units[static_cast<std::size_t>(out.count)];
    for (int bank = 0; bank < banks; ++bank, i += copies) {
      const std::uint32_t head = head_of(bytes.data() + kBlockBytes * static_cast<std::size_t>(i));
      const int azimuth = static_cast<int>(head >> 16U);
      const bool is_block = (head & 0xFFFFU) == kFlags[bank] && azimuth < kCircle;
      const bool is_partner =
          copies == 1 || head_of(bytes.data() + kBlockBytes * static_cast<std::size_t>(i + 1)) == head;
      if (is_block && is_partner && (unit.good_banks == 0 || azimuth == unit.azimuth)) {
        unit.azimuth = azimuth;
        unit.good_banks |= 1U << static_cast<unsigned>(bank);
      } else {
        out.malformed += copies;
      }
    }
  }
  return out;
}

/// Finds the azimuth steps between neighbouring units of the packet. A jump (the scanner's field of view, a broken
/// encoder) ends what the packet's stamp can date, because the packet does not say how long the scanner was silent.
void VelodyneKernel::find_steps(Units& all) const {
  all.jump = all.second_jump = all.count;
  for (int u = 0; u + 1 < all.second_jump; ++u) {
    Unit& unit = all.units[static_cast<std::size_t>(u)];
    const Unit& next = all.units[static_cast<std::size_t>(u + 1)];
    if (unit.good_banks == 0 || next.good_banks == 0) continue;
    const int step = shortest(next.azimuth - unit.azimuth);
    if (step >= -kTremble && step <= max_step_) {
      unit.step = step;
      all.sum += step;
      ++all.steps;
    } else if (all.jump == all.count) {
      all.jump = u + 1;
    } else {
      all.second_jump = u + 1;
    }
  }
}

VelodyneBlocks VelodyneKernel::decode(std::span<const std::byte> bytes, bool is_dual, double turn_rate,
                                      std::vector<LaserReturn>& returns) {
  const auto& directions = azimuth_directions();
  const std::size_t banks = firings_.size();
  const int copies = is_dual ? 2 : 1;  // blocks of the same firings
  Units all = units_of(bytes, copies);
  find_steps(all);

  VelodyneBlocks result;
  result.malformed = all.malformed;
  if (all.jump < all.count) result.jump_azimuth = all.units[static_cast<std::size_t>(all.jump)].azimuth;
  const double period_s = to_seconds(period_);
  const float mean_step = all.steps       ? static_cast<float>(all.sum) / static_cast<float>(all.steps)
                          : all.count > 1 ? 0.0f
                                          : static_cast<float>(turn_rate * period_s);
  if (all.steps > 0) result.turn_rate = static_cast<double>(all.sum) / all.steps / period_s;
  HWY_DYNAMIC_DISPATCH(fill_turns)(firings_, mean_step * kAzimuthStep, mean_turns_.data());

  std::array<Block, kVelodyneBlocks> wanted;
  std::size_t count = 0, timed = 0;
  const std::byte* block = bytes.data();
  const std::size_t to_next = kBlockBytes * static_cast<std::size_t>(copies);
  for (int u = 0; u < all.count; ++u) {
    const Unit& unit = all.units[static_cast<std::size_t>(u)];
    const bool is_behind = u >= all.jump;
    const auto unit_ns = static_cast<std::int32_t>(period_.count() * (is_behind ? u - all.jump : u));
    const auto azimuth = static_cast<std::size_t>(unit.azimuth);
    const bool is_near_north = unit.azimuth < kNearNorth || unit.azimuth >= kCircle - kNearNorth;
    const Turn* turns =
        unit.step ? &turns_[banks * static_cast<std::size_t>(*unit.step + kTremble)] : mean_turns_.data();
    for (std::size_t bank = 0; bank < banks; ++bank, block += to_next) {
      if ((unit.good_banks >> bank & 1U) == 0) continue;
      if (u >= all.second_jump) {
        result.untimed += copies;
        continue;
      }
      wanted[count++] = {&firings_[bank],
                         &turns[bank],
                         block,
                         is_dual ? block + kBlockBytes : nullptr,
                         static_cast<float>(azimuth) * kAzimuthStep,
                         is_near_north,
                         directions[azimuth],
                         unit_ns};
      if (is_behind) {
        result.behind += copies;
        result.behind_azimuth = unit.azimuth;
        continue;
      }
      timed = count;
      if (result.decoded == 0) result.first_azimuth = unit.azimuth;
      result.last_azimuth = unit.azimuth;
      result.decoded += copies;
    }
  }
  const std::span<const Block> blocks(wanted.data(), count);
  HWY_DYNAMIC_DISPATCH(decode_blocks)(blocks.first(timed), choice_, scratch_.data(), returns);
  behind_.clear();
  if (timed < count) HWY_DYNAMIC_DISPATCH(decode_blocks)(blocks.subspan(timed), choice_, scratch_.data(), behind_);
  result.behind_duration = period_ * (all.count - all.jump);
  return result;
}

}  // namespace hueline::drivers
#endif
