#include "drivers/velodyne/velodyne_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kCircle = 36000;  // in 0.01 degrees
constexpr float kTwoPi = static_cast<float>(2 * kPi);
constexpr float kRadPerCount = static_cast<float>(2 * kPi / kCircle);
constexpr std::size_t kBlockBytes = 100;

/// The fastest model turns 20 times a second. An azimuth step of more than twice that rate is a jump. While the motor
/// rests, the azimuth trembles by at most kTremble (0.01 degrees).
constexpr double kMaxRevolutionsPerSecond = 40;
constexpr int kTremble = 20;

/// The second bytes of the flags of a VLS-128's four blocks.
constexpr unsigned kBankFlags[] = {0xEE, 0xDD, 0xCC, 0xBB};

unsigned u16(const std::byte* p) { return static_cast<unsigned>(p[0]) | static_cast<unsigned>(p[1]) << 8; }

/// Reads the three bytes of each firing: distance in the lower half of the word, then reflectivity. The fourth byte is
/// the next firing's or, behind the last block, the stamp's.
void load_firings(const std::byte* block, std::array<std::uint32_t, kVelodyneFiringsPerBlock>& words) {
  const std::byte* p = block + 4;
  for (std::uint32_t& word : words) {
    std::memcpy(&word, p, 4);
    p += 3;
  }
}

}  // namespace

VelodyneKernel::VelodyneKernel(const VelodyneDecoder::Config& config)
    : table_(velodyne_table(config.model)),
      choice_(config.returns),
      // A range of 0 steps means "no return", whatever the configuration says.
      nearest_(std::max(1, static_cast<std::int32_t>(std::ceil(config.min_range_m / table_.range_step_m - 1e-6)))),
      span_((config.max_range_m ? static_cast<std::int32_t>(
                                      std::min(65535.0, std::floor(*config.max_range_m / table_.range_step_m + 1e-6)))
                                : 65535) -
            nearest_),
      range_step_(static_cast<float>(table_.range_step_m)),
      window_begin_(static_cast<float>(config.azimuth_begin)),
      max_step_(static_cast<int>(kMaxRevolutionsPerSecond * kCircle * to_seconds(table_.block_period()))),
      firings_(static_cast<std::size_t>(table_.banks())),
      sin_(kCircle),
      cos_(kCircle) {
  double width = config.azimuth_end - config.azimuth_begin;
  if (width < 0) width += 2 * kPi;
  has_window_ = width < 2 * kPi - 1e-9;
  window_width_ = static_cast<float>(width);
  for (int i = 0; i < kCircle; ++i) {
    sin_[static_cast<std::size_t>(i)] = static_cast<float>(portable::sin(2 * kPi * i / kCircle));
    cos_[static_cast<std::size_t>(i)] = static_cast<float>(portable::cos(2 * kPi * i / kCircle));
  }
  for (std::size_t bank = 0; bank < firings_.size(); ++bank)
    for (std::size_t f = 0; f < kFirings; ++f) {
      const int firing = static_cast<int>(bank * kFirings + f);
      const int laser = firing % table_.count();
      const VelodyneLaser& l = table_.lasers[static_cast<std::size_t>(laser)];
      const auto offset = table_.sequence_period * (firing / table_.count()) + table_.firing_time(laser);
      const auto ring = std::ranges::count_if(
          table_.lasers, [&](const VelodyneLaser& other) { return other.elevation_deg < l.elevation_deg; });
      const double elevation = l.elevation_deg * kPi / 180, azimuth = l.azimuth_deg * kPi / 180;
      Firings& table = firings_[bank];
      table.sin_elevation[f] = static_cast<float>(portable::sin(elevation));
      table.cos_elevation[f] = static_cast<float>(portable::cos(elevation));
      table.vertical_offset[f] = static_cast<float>(l.vertical_offset_mm * 1e-3);
      table.sin_azimuth[f] = static_cast<float>(portable::sin(azimuth));
      table.cos_azimuth[f] = static_cast<float>(portable::cos(azimuth));
      table.azimuth[f] = static_cast<float>(azimuth);
      table.fraction[f] = static_cast<float>(to_seconds(offset) / to_seconds(table_.block_period()));
      table.offset_ns[f] = static_cast<std::int32_t>(offset.count());
      table.channel[f] = static_cast<std::uint32_t>(ring);
    }
}

int VelodyneKernel::step(int from, int to) const {
  const int d = to - from;
  return d < -kCircle / 2 ? d + kCircle : d >= kCircle / 2 ? d - kCircle : d;
}

bool VelodyneKernel::is_plausible(int step) const { return step >= -kTremble && step <= max_step_; }

bool VelodyneKernel::is_block(const std::byte* block, int bank) const {
  return block[0] == std::byte{0xFF} && static_cast<unsigned>(block[1]) == kBankFlags[bank] &&
         u16(block + 2) < static_cast<unsigned>(kCircle);
}

VelodyneBlocks VelodyneKernel::decode(std::span<const std::byte> bytes, bool is_dual, double turn_rate,
                                      std::vector<LaserReturn>& returns) {
  const int banks = table_.banks();
  const int copies = is_dual ? 2 : 1;          // blocks of the same firings
  const int blocks_per_unit = banks * copies;  // blocks of the same azimuth
  const int units = kVelodyneBlocks / blocks_per_unit;
  const auto block = [&](int i) { return bytes.data() + kBlockBytes * static_cast<std::size_t>(i); };

  std::array<Unit, kVelodyneBlocks> unit;
  std::array<bool, kVelodyneBlocks> is_good{};
  VelodyneBlocks result;
  for (int u = 0; u < units; ++u) {
    const int first = u * blocks_per_unit;
    auto& [azimuth, is_valid] = unit[static_cast<std::size_t>(u)];
    for (int i = first; i < first + blocks_per_unit; i += copies) {
      const int bank = (i - first) / copies;
      const int found = static_cast<int>(u16(block(i) + 2));
      const bool good = is_block(block(i), bank) && (!is_valid || found == azimuth) &&
                        (!is_dual || (is_block(block(i + 1), bank) && std::memcmp(block(i), block(i + 1), 4) == 0));
      if (good && !is_valid) azimuth = found;
      is_valid |= good;
      is_good[static_cast<std::size_t>(i)] = good;
      if (!good) result.malformed += copies;
    }
  }

  // The azimuth steps between neighbouring units of this packet. A jump (the scanner's field of view, a broken
  // encoder) ends what the packet's stamp can date, because the packet does not say how long the scanner was silent.
  std::array<int, kVelodyneBlocks> steps{};
  std::array<bool, kVelodyneBlocks> has_step{};
  int sum = 0, number = 0;
  int jump = units, second_jump = units;  // the first units behind
  for (int u = 0; u + 1 < second_jump; ++u) {
    const auto i = static_cast<std::size_t>(u);
    if (!unit[i].is_valid || !unit[i + 1].is_valid) continue;
    steps[i] = step(unit[i].azimuth, unit[i + 1].azimuth);
    has_step[i] = is_plausible(steps[i]);
    if (has_step[i]) {
      sum += steps[i];
      ++number;
    } else if (jump == units) {
      jump = u + 1;
      result.jump_azimuth = unit[i + 1].azimuth;
    } else {
      second_jump = u + 1;
    }
  }
  const double period_s = to_seconds(table_.block_period());
  const float mean_step = number      ? static_cast<float>(sum) / static_cast<float>(number)
                          : units > 1 ? 0.0f
                                      : static_cast<float>(turn_rate * period_s);
  if (number > 0) result.turn_rate = static_cast<double>(sum) / number / period_s;

  LaserReturn* out = scratch_.data();
  LaserReturn* end_of_timed = out;
  for (int u = 0; u < units; ++u) {
    const auto i = static_cast<std::size_t>(u);
    if (!unit[i].is_valid) continue;
    const bool is_behind = u >= jump;
    const auto unit_ns = static_cast<std::int32_t>(table_.block_period().count() * (is_behind ? u - jump : u));
    for (int b = u * blocks_per_unit; b < (u + 1) * blocks_per_unit; b += copies) {
      if (!is_good[static_cast<std::size_t>(b)]) continue;
      if (u >= second_jump) {
        result.untimed += copies;
        continue;
      }
      const Firings& firings = firings_[static_cast<std::size_t>((b - u * blocks_per_unit) / copies)];
      fill_directions(firings, unit[i].azimuth, has_step[i] ? static_cast<float>(steps[i]) : mean_step);
      out = is_dual ? decode_pair(firings, block(b), block(b + 1), unit_ns, out)
                    : decode_single(firings, block(b), unit_ns, out);
      if (is_behind) {
        result.behind += copies;
        result.behind_azimuth = unit[i].azimuth;
        continue;
      }
      end_of_timed = out;
      if (result.decoded == 0) result.first_azimuth = unit[i].azimuth;
      result.last_azimuth = unit[i].azimuth;
      result.decoded += copies;
    }
  }
  result.behind_duration = table_.block_period() * (units - jump);
  returns.assign(scratch_.data(), end_of_timed);
  behind_.assign(end_of_timed, out);
  return result;
}

void VelodyneKernel::fill_directions(const Firings& firings, int azimuth, float step) {
  const float sin_block = sin_[static_cast<std::size_t>(azimuth)], cos_block = cos_[static_cast<std::size_t>(azimuth)];
  const float block_rad = static_cast<float>(azimuth) * kRadPerCount;
  const float step_rad = step * kRadPerCount;  // at most 0.03 rad, so the error of the series below is at most 4e-8
  for (std::size_t f = 0; f < kFirings; ++f) {
    const float turn = step_rad * firings.fraction[f];
    const float turn2 = turn * turn;
    const float sin_turn = turn - turn * turn2 / 6.0f;
    const float cos_turn = 1.0f - turn2 / 2.0f;
    const float s = firings.sin_azimuth[f] * cos_turn + firings.cos_azimuth[f] * sin_turn;
    const float c = firings.cos_azimuth[f] * cos_turn - firings.sin_azimuth[f] * sin_turn;
    directions_.x[f] = firings.cos_elevation[f] * (sin_block * c + cos_block * s);
    directions_.y[f] = firings.cos_elevation[f] * (cos_block * c - sin_block * s);
    directions_.azimuth[f] = in_circle(block_rad + firings.azimuth[f] + turn);
  }
  if (!has_window_) return;
  for (std::size_t f = 0; f < kFirings; ++f) {
    const float past = directions_.azimuth[f] - window_begin_;
    directions_.is_inside[f] = (past < 0.0f ? past + kTwoPi : past) <= window_width_ ? 1 : 0;
  }
}

/// Fills the lanes with what depends on distance and direction, and with whether that distance is kept.
inline void VelodyneKernel::fill_places(const Firings& firings, const std::array<std::int32_t, kFirings>& distance,
                                        std::int32_t block_ns, Lanes& lanes) const {
  const float range_step = range_step_;
  const std::int32_t nearest = nearest_, span = span_;
  for (std::size_t f = 0; f < kFirings; ++f) {
    const float range = static_cast<float>(distance[f]) * range_step;
    lanes.x[f] = range * directions_.x[f];
    lanes.y[f] = range * directions_.y[f];
    lanes.z[f] = range * firings.sin_elevation[f] + firings.vertical_offset[f];
    lanes.range[f] = range;
    lanes.azimuth[f] = directions_.azimuth[f];
    lanes.time_ns[f] = block_ns + firings.offset_ns[f];
    const std::int32_t past = distance[f] - nearest;
    lanes.keep[f] = static_cast<std::uint32_t>(past >= 0) & static_cast<std::uint32_t>(past <= span);
  }
  if (!has_window_) return;
  for (std::size_t f = 0; f < kFirings; ++f) lanes.keep[f] &= directions_.is_inside[f];
}

LaserReturn* VelodyneKernel::decode_single(const Firings& firings, const std::byte* block, std::int32_t block_ns,
                                           LaserReturn* out) {
  alignas(16) std::array<std::uint32_t, kFirings> words;
  alignas(16) std::array<std::int32_t, kFirings> distance;
  load_firings(block, words);
  for (std::size_t f = 0; f < kFirings; ++f) {
    distance[f] = static_cast<std::int32_t>(words[f] & 0xFFFFU);
    near_.tags[f] = tags_of(firings.channel[f], words[f] >> 16U & 0xFFU, 1);
    near_.return_count[f] = 1;
  }
  fill_places(firings, distance, block_ns, near_);
  return write_returns(near_, kFirings, out);
}

/// The even block holds the last return. The odd one holds the strongest, or the second strongest if the strongest is
/// the last. A firing with one return has it in both blocks, or in one of them only.
LaserReturn* VelodyneKernel::decode_pair(const Firings& firings, const std::byte* last, const std::byte* strongest,
                                         std::int32_t block_ns, LaserReturn* out) {
  alignas(16) std::array<std::uint32_t, kFirings> last_words, strongest_words;
  alignas(16) std::array<std::int32_t, kFirings> near, far;
  alignas(16) std::array<std::uint32_t, kFirings> wants_near, wants_far;
  load_firings(last, last_words);
  load_firings(strongest, strongest_words);
  // All bits or none, because GCC makes no vectors of a loop with branches.
  const std::int32_t wants_all = choice_ == ReturnChoice::All ? -1 : 0,
                     wants_last = choice_ == ReturnChoice::Last ? -1 : 0;
  const auto mask = [](bool is_set) { return -static_cast<std::int32_t>(is_set); };
  for (std::size_t f = 0; f < kFirings; ++f) {
    const auto a = static_cast<std::int32_t>(last_words[f] & 0xFFFFU),
               b = static_cast<std::int32_t>(strongest_words[f] & 0xFFFFU);
    const std::int32_t is_pair = ~(mask(a == b) | mask(a == 0) | mask(b == 0)), last_is_far = mask(a > b);
    // Of a pair the smaller distance is near; of one return it is the one that is not 0, and `a` of two equal ones.
    const std::int32_t near_is_b = (is_pair & last_is_far) | (~is_pair & mask(a == 0));
    const std::uint32_t exchanged = (last_words[f] ^ strongest_words[f]) & static_cast<std::uint32_t>(near_is_b);
    const std::uint32_t near_word = last_words[f] ^ exchanged, far_word = strongest_words[f] ^ exchanged;
    near[f] = static_cast<std::int32_t>(near_word & 0xFFFFU);
    far[f] = static_cast<std::int32_t>(far_word & 0xFFFFU);
    const auto near_reflectivity = static_cast<std::int32_t>(near_word >> 16U & 0xFFU),
               far_reflectivity = static_cast<std::int32_t>(far_word >> 16U & 0xFFU);
    const std::int32_t near_is_stronger =
        mask(near_reflectivity > far_reflectivity) | (mask(near_reflectivity == far_reflectivity) & last_is_far);
    const std::int32_t chosen_near = (wants_last & ~last_is_far) | (~wants_last & near_is_stronger);
    wants_near[f] = static_cast<std::uint32_t>(~is_pair | wants_all | chosen_near) & 1U;
    wants_far[f] = static_cast<std::uint32_t>(is_pair & (wants_all | ~chosen_near)) & 1U;
    near_.tags[f] = tags_of(firings.channel[f], static_cast<std::uint32_t>(near_reflectivity), 1);
    far_.tags[f] = tags_of(firings.channel[f], static_cast<std::uint32_t>(far_reflectivity), 2);
    near_.return_count[f] = 1U + (static_cast<std::uint32_t>(is_pair) & 1U);
    far_.return_count[f] = 2;
  }
  fill_places(firings, near, block_ns, near_);
  fill_places(firings, far, block_ns, far_);
  for (std::size_t f = 0; f < kFirings; ++f) {
    near_.keep[f] &= wants_near[f];
    far_.keep[f] &= wants_far[f];
  }
  return write_returns(near_, far_, kFirings, out);
}

}  // namespace hueline::drivers
