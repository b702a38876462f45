// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/livox/livox_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "drivers/livox/livox_kernel.hpp"
#include "drivers/portable_vectors-inl.hpp"
#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

constexpr std::size_t kTogether = 16;  ///< firings

/// One return of each of kTogether firings: first what the packet says, then what becomes of it.
struct LivoxEchoes {
  alignas(64) double said[3][kTogether];  ///< x, y, z or range, zenith, azimuth
  alignas(64) float x[kTogether], y[kTogether], z[kTogether], range[kTogether], azimuth[kTogether];
  alignas(64) std::uint32_t reflectivity[kTogether];
};

HWY_INLINE void read_echoes(const LivoxPacket& packet, std::size_t first, std::size_t count, std::size_t which,
                            LivoxEchoes& echoes) {
  for (std::size_t k = 0; k < count; ++k) {
    const LivoxReturn one = read_livox_return(packet, first + k, which);
    for (std::size_t i = 0; i < 3; ++i) echoes.said[i][k] = one.said[i];
    echoes.reflectivity[k] = one.reflectivity;
  }
  for (std::size_t k = count; k < kTogether; ++k)
    for (std::size_t i = 0; i < 3; ++i) echoes.said[i][k] = 0;
}

HWY_INLINE void place_echoes(bool is_spherical, LivoxEchoes& echoes) {
  const DoubleTag d;
  for (std::size_t k = 0; k < kTogether; k += kDoubles) {
    auto x = hn::Load(d, echoes.said[0] + k), y = hn::Load(d, echoes.said[1] + k), z = hn::Load(d, echoes.said[2] + k);
    if (is_spherical) {
      const auto range = x;
      auto sin_zenith = y, cos_zenith = y, sin_azimuth = y, cos_azimuth = y;
      sine_cosine(y, sin_zenith, cos_zenith);
      sine_cosine(z, sin_azimuth, cos_azimuth);
      x = hn::Mul(hn::Mul(range, sin_zenith), cos_azimuth);
      y = hn::Mul(hn::Mul(range, sin_zenith), sin_azimuth);
      z = hn::Mul(range, cos_zenith);
    }
    const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const auto azimuth = arc_tangent(y, x);
    const auto behind = hn::Add(azimuth, double_of(2 * std::numbers::pi));
    store_floats(hn::Neg(y), echoes.x + k);
    store_floats(x, echoes.y + k);
    store_floats(z, echoes.z + k);
    store_floats(hn::Sqrt(square), echoes.range + k);
    store_floats(hn::IfThenElse(hn::Lt(azimuth, hn::Zero(d)), behind, azimuth), echoes.azimuth + k);
  }
}

HWY_INLINE LaserReturn* write_single(const LivoxEchoes& echoes, const std::int32_t* time_ns, float nearest_m,
                                     float farthest_m, LaserReturn* out) {
  const FloatTag d;
  const WordTag bits;
  for (std::size_t k = 0; k < kTogether; k += kLanes) {
    const auto word = [&](const auto* quantity) {
      return hn::Load(bits, reinterpret_cast<const std::uint32_t*>(quantity) + k);
    };
    const auto range = hn::Load(d, echoes.range + k);
    const auto is_within = hn::And(hn::Ge(range, hn::Set(d, nearest_m)), hn::Le(range, hn::Set(d, farthest_m)));
    const auto is_kept = hn::RebindMask(bits, hn::And(is_within, hn::Gt(range, hn::Zero(d))));
    const auto tags = hn::Or(hn::ShiftLeft<16>(word(echoes.reflectivity)), hn::Set(bits, tags_of(0, 0, 1)));
    out = write_returns(is_kept, word(echoes.x), word(echoes.y), word(echoes.z), word(echoes.range),
                        word(echoes.azimuth), word(time_ns), tags, hn::Set(bits, 1U), out);
  }
  return out;
}

/// Writes the returns of firings that may have several, counted by range. Equal ones are one.
HWY_INLINE LaserReturn* write_several(const std::array<LivoxEchoes, 3>& echoes, std::size_t most, std::size_t count,
                                      const std::int32_t* time_ns, float nearest_m, float farthest_m,
                                      LaserReturn* out) {
  for (std::size_t k = 0; k < count; ++k) {
    std::array<std::size_t, 3> found{};
    std::size_t number = 0;
    for (std::size_t which = 0; which < most; ++which) {
      const LivoxEchoes& made = echoes[which];
      bool is_new = made.range[k] != 0;
      for (std::size_t i = 0; i < number; ++i) {
        const LivoxEchoes& other = echoes[found[i]];
        is_new &= other.x[k] != made.x[k] || other.y[k] != made.y[k] || other.z[k] != made.z[k];
      }
      if (!is_new) continue;
      std::size_t place = number++;
      for (; place > 0 && echoes[found[place - 1]].range[k] > made.range[k]; --place) found[place] = found[place - 1];
      found[place] = which;
    }
    for (std::size_t i = 0; i < number; ++i) {
      const LivoxEchoes& made = echoes[found[i]];
      out->x = made.x[k];
      out->y = made.y[k];
      out->z = made.z[k];
      out->range_m = made.range[k];
      out->azimuth = made.azimuth[k];
      out->time_offset_ns = time_ns[k];
      out->channel = 0;
      out->reflectivity = static_cast<std::uint8_t>(made.reflectivity[k]);
      out->return_number = static_cast<std::uint8_t>(i + 1);
      out->return_count = static_cast<std::uint8_t>(number);
      out += made.range[k] >= nearest_m && made.range[k] <= farthest_m ? 1 : 0;
    }
  }
  return out;
}

/// Replaces `returns` by those of the packet. `scratch` has room for one more.
void decode_livox_points(const LivoxPacket& packet, double interval_ns, float nearest_m, float farthest_m,
                         LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  const DoubleTag d;
  LaserReturn* out = scratch;
  std::array<LivoxEchoes, 3> echoes;
  alignas(64) std::int32_t time_ns[kTogether];
  for (std::size_t first = 0; first < packet.points; first += kTogether) {
    const std::size_t count = std::min(kTogether, packet.points - first);
    for (std::size_t k = 0; k < kTogether; k += kDoubles) {
      const auto number = hn::Iota(d, static_cast<double>(first + k));
      store_integers(rounded(hn::Mul(double_of(interval_ns), number)), time_ns + k);
    }
    for (std::size_t which = 0; which < packet.form->returns; ++which) {
      read_echoes(packet, first, count, which, echoes[which]);
      place_echoes(packet.form->is_spherical, echoes[which]);
    }
    out = packet.form->returns == 1
              ? write_single(echoes[0], time_ns, nearest_m, farthest_m, out)
              : write_several(echoes, packet.form->returns, count, time_ns, nearest_m, farthest_m, out);
  }
  returns.assign(scratch, out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::drivers {
HWY_EXPORT(decode_livox_points);
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace

/// Ranges are compared as floats: with the least that is not below `min_range_m`, and the largest that is not above
/// `max_range_m`.
LivoxKernel::LivoxKernel(double min_range_m, double max_range_m)
    : nearest_m_(static_cast<float>(min_range_m)), farthest_m_(static_cast<float>(max_range_m)) {
  if (nearest_m_ < min_range_m) nearest_m_ = std::nextafter(nearest_m_, kInfinity);
  if (farthest_m_ > max_range_m) farthest_m_ = std::nextafter(farthest_m_, -kInfinity);
}

void LivoxKernel::decode(const LivoxPacket& packet, double interval_ns, std::vector<LaserReturn>& returns) {
  // A return is written before it is known whether it is kept.
  const std::size_t most = packet.points * packet.form->returns + 1;
  if (scratch_.size() < most) scratch_.resize(most);
  HWY_DYNAMIC_DISPATCH(decode_livox_points)
  (packet, interval_ns, nearest_m_, farthest_m_, scratch_.data(), returns);
}

}  // namespace hueline::drivers
#endif
