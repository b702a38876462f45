#include "drivers/velodyne/velodyne_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

unsigned u16(const std::byte* p) { return static_cast<unsigned>(p[0]) | static_cast<unsigned>(p[1]) << 8; }

}  // namespace

VelodyneKernel::VelodyneKernel(const VelodyneDecoder::Config& config)
    : table_(velodyne_table(config.model)),
      choice_(config.returns),
      // A range of 0 steps means "no return", whatever the configuration says.
      nearest_(std::max(1u, static_cast<unsigned>(std::ceil(config.min_range_m / table_.range_step_m - 1e-6)))),
      span_(static_cast<unsigned>(std::min(65535.0, std::floor(config.max_range_m / table_.range_step_m + 1e-6))) -
            nearest_),
      range_step_(static_cast<float>(table_.range_step_m)),
      window_begin_(static_cast<float>(config.azimuth_begin)),
      max_step_(static_cast<int>(kMaxRevolutionsPerSecond * kCircle * to_seconds(table_.block_period()))),
      sin_(kCircle),
      cos_(kCircle) {
  double width = config.azimuth_end - config.azimuth_begin;
  if (width < 0) width += 2 * kPi;
  has_window_ = width < 2 * kPi - 1e-9;
  window_width_ = static_cast<float>(width);
  for (int i = 0; i < kCircle; ++i) {
    sin_[static_cast<std::size_t>(i)] = static_cast<float>(std::sin(2 * kPi * i / kCircle));
    cos_[static_cast<std::size_t>(i)] = static_cast<float>(std::cos(2 * kPi * i / kCircle));
  }
  for (int firing = 0; firing < kVelodyneFiringsPerBlock; ++firing) {
    const auto f = static_cast<std::size_t>(firing);
    const int laser = firing % table_.lasers;
    const VelodyneLaser& l = table_.laser[static_cast<std::size_t>(laser)];
    const auto offset = table_.sequence_period * (firing / table_.lasers) + table_.firing_period * laser;
    std::uint16_t ring = 0;
    for (int other = 0; other < table_.lasers; ++other)
      if (table_.laser[static_cast<std::size_t>(other)].elevation_deg < l.elevation_deg) ++ring;
    const double elevation = l.elevation_deg * kPi / 180;
    firings_.sin_elevation[f] = static_cast<float>(std::sin(elevation));
    firings_.cos_elevation[f] = static_cast<float>(std::cos(elevation));
    firings_.vertical_offset[f] = static_cast<float>(l.vertical_offset_mm * 1e-3);
    firings_.fraction[f] = static_cast<float>(to_seconds(offset) / to_seconds(table_.block_period()));
    firings_.offset_ns[f] = static_cast<std::int32_t>(offset.count());
    firings_.channel[f] = ring;
  }
}

int VelodyneKernel::step(int from, int to) const {
  const int d = to - from;
  return d < -kCircle / 2 ? d + kCircle : d >= kCircle / 2 ? d - kCircle : d;
}

bool VelodyneKernel::is_plausible(int step) const { return step >= -kTremble && step <= max_step_; }

VelodyneBlocks VelodyneKernel::decode(std::span<const std::byte> bytes, bool is_dual,
                                      std::vector<LaserReturn>& returns) {
  const int blocks_per_unit = is_dual ? 2 : 1;
  const int units = kVelodyneBlocks / blocks_per_unit;
  const auto block = [&](int i) { return bytes.data() + kBlockBytes * static_cast<std::size_t>(i); };
  const auto is_block = [&](int i) {
    return u16(block(i)) == 0xEEFF && u16(block(i) + 2) < static_cast<unsigned>(kCircle);
  };

  std::array<Unit, kVelodyneBlocks> unit;
  VelodyneBlocks result;
  for (int u = 0; u < units; ++u) {
    const int first = u * blocks_per_unit;
    auto& [azimuth, is_valid] = unit[static_cast<std::size_t>(u)];
    azimuth = static_cast<int>(u16(block(first) + 2));
    is_valid = is_block(first) &&
               (!is_dual || (is_block(first + 1) && u16(block(first + 1) + 2) == static_cast<unsigned>(azimuth)));
    if (!is_valid) result.malformed += blocks_per_unit;
  }

  // The azimuth steps between neighbouring blocks of this packet. A jump (the scanner's field of view, a broken
  // encoder) ends what the packet's stamp can date, because the packet does not say how long the scanner was silent.
  std::array<int, kVelodyneBlocks> steps{};
  std::array<bool, kVelodyneBlocks> has_step{};
  int sum = 0, number = 0, timed_units = units;
  int sum_behind = 0, number_behind = 0;
  for (int u = 0; u + 1 < units; ++u) {
    const auto i = static_cast<std::size_t>(u);
    if (!unit[i].is_valid || !unit[i + 1].is_valid) continue;
    steps[i] = step(unit[i].azimuth, unit[i + 1].azimuth);
    if (timed_units < units) {
      if (!is_plausible(steps[i])) continue;
      sum_behind += steps[i];
      ++number_behind;
    } else if (!is_plausible(steps[i])) {
      timed_units = u + 1;
      result.jump_azimuth = unit[i + 1].azimuth;
    } else {
      has_step[i] = true;
      sum += steps[i];
      ++number;
    }
  }
  const float mean_step = number ? static_cast<float>(sum) / static_cast<float>(number) : 0.0f;
  if (number + number_behind > 0)
    result.turn_rate =
        static_cast<double>(sum + sum_behind) / (number + number_behind) / to_seconds(table_.block_period());

  LaserReturn* out = scratch_.data();
  for (int u = 0; u < units; ++u) {
    const auto i = static_cast<std::size_t>(u);
    if (!unit[i].is_valid) continue;
    if (u >= timed_units) {
      result.untimed += blocks_per_unit;
      continue;
    }
    fill_directions(unit[i].azimuth, has_step[i] ? static_cast<float>(steps[i]) : mean_step);
    const auto block_ns = static_cast<std::int32_t>(table_.block_period().count() * u);
    if (is_dual)
      out = decode_pair(block(2 * u), block(2 * u + 1), block_ns, out);
    else
      out = decode_single(block(u), block_ns, out);
    if (result.decoded == 0) result.first_azimuth = unit[i].azimuth;
    result.last_azimuth = unit[i].azimuth;
    result.decoded += blocks_per_unit;
  }
  returns.assign(scratch_.data(), out);
  return result;
}

void VelodyneKernel::fill_directions(int azimuth, float step) {
  const float sin_block = sin_[static_cast<std::size_t>(azimuth)], cos_block = cos_[static_cast<std::size_t>(azimuth)];
  const float block_rad = static_cast<float>(azimuth) * kRadPerCount;
  const float step_rad = step * kRadPerCount;  // at most 0.03 rad, so the error of the series below is at most 4e-8
  for (std::size_t f = 0; f < kVelodyneFiringsPerBlock; ++f) {
    const float turn = step_rad * firings_.fraction[f];
    const float turn2 = turn * turn;
    const float sin_turn = turn - turn * turn2 / 6.0f;
    const float cos_turn = 1.0f - turn2 / 2.0f;
    directions_.x[f] = firings_.cos_elevation[f] * (sin_block * cos_turn + cos_block * sin_turn);
    directions_.y[f] = firings_.cos_elevation[f] * (cos_block * cos_turn - sin_block * sin_turn);
    const float sum = block_rad + turn;
    directions_.azimuth[f] = sum >= kTwoPi ? sum - kTwoPi : sum < 0.0f ? sum + kTwoPi : sum;
  }
  if (!has_window_) return;
  for (std::size_t f = 0; f < kVelodyneFiringsPerBlock; ++f) {
    const float past = directions_.azimuth[f] - window_begin_;
    directions_.is_inside[f] = (past < 0.0f ? past + kTwoPi : past) <= window_width_;
  }
}

inline bool VelodyneKernel::keeps(std::size_t firing, unsigned distance) const {
  return (distance - nearest_ <= span_) & (!has_window_ | directions_.is_inside[firing]);
}

/// Writes the return in place. If it were made elsewhere and copied, the copy would have to wait for the small stores.
inline void VelodyneKernel::write(LaserReturn& r, std::size_t firing, unsigned distance, unsigned reflectivity,
                                  std::int32_t block_ns) const {
  const float range = static_cast<float>(distance) * range_step_;
  const float x = range * directions_.x[firing], y = range * directions_.y[firing];
  const float z = range * firings_.sin_elevation[firing] + firings_.vertical_offset[firing];
  const float azimuth = directions_.azimuth[firing];
  const std::int32_t offset_ns = block_ns + firings_.offset_ns[firing];
  const std::uint16_t channel = firings_.channel[firing];
  r.x = x;
  r.y = y;
  r.z = z;
  r.range_m = range;
  r.azimuth = azimuth;
  r.time_offset_ns = offset_ns;
  r.channel = channel;
  r.reflectivity = static_cast<std::uint8_t>(reflectivity);
  r.return_number = 1;
  r.return_count = 1;
}

LaserReturn* VelodyneKernel::decode_single(const std::byte* block, std::int32_t block_ns, LaserReturn* out) const {
  const std::byte* p = block + 4;
  for (std::size_t f = 0; f < kVelodyneFiringsPerBlock; ++f, p += 3) {
    const unsigned distance = u16(p);
    // Write the return in any case: whether there is one is nearly random, and a wrong branch prediction costs more
    // than the store.
    write(*out, f, distance, static_cast<unsigned>(p[2]), block_ns);
    out += keeps(f, distance);
  }
  return out;
}

LaserReturn* VelodyneKernel::decode_pair(const std::byte* last, const std::byte* strongest, std::int32_t block_ns,
                                         LaserReturn* out) const {
  const std::byte *a = last + 4, *b = strongest + 4;
  for (std::size_t f = 0; f < kVelodyneFiringsPerBlock; ++f, a += 3, b += 3) {
    unsigned near = u16(a), far = u16(b);
    auto near_reflectivity = static_cast<unsigned>(a[2]), far_reflectivity = static_cast<unsigned>(b[2]);
    // A firing with one return has it in both blocks, or in one of them only.
    if (near == far || near == 0 || far == 0) {
      const bool uses_a = near != 0;
      const unsigned distance = uses_a ? near : far;
      write(*out, f, distance, uses_a ? near_reflectivity : far_reflectivity, block_ns);
      out += keeps(f, distance);
      continue;
    }
    // The even block holds the last return. The odd one holds the strongest, or the second strongest if the strongest
    // is the last.
    const bool last_is_far = near > far;
    if (last_is_far) {
      std::swap(near, far);
      std::swap(near_reflectivity, far_reflectivity);
    }
    const bool wants_near =
        choice_ == ReturnChoice::All || (choice_ == ReturnChoice::Last           ? !last_is_far
                                         : near_reflectivity != far_reflectivity ? near_reflectivity > far_reflectivity
                                                                                 : last_is_far);
    const bool wants_far = choice_ == ReturnChoice::All || !wants_near;
    if (wants_near && keeps(f, near)) {
      write(*out, f, near, near_reflectivity, block_ns);
      out->return_count = 2;
      ++out;
    }
    if (wants_far && keeps(f, far)) {
      write(*out, f, far, far_reflectivity, block_ns);
      out->return_number = out->return_count = 2;
      ++out;
    }
  }
  return out;
}

}  // namespace hueline::drivers
