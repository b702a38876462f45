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
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

#include "drivers/livox/livox_kernel.hpp"
#include "drivers/portable_vectors-inl.hpp"
#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

/// So many firings are read before they are placed, because numbers that were just written can be loaded one by one
/// only.
constexpr std::size_t kTogether = 128;

/// One return of each of kTogether firings as the packet says it: LivoxReturn::said, then reflectivity in the lowest
/// byte. Behind them are some without range, up to the next multiple of kLanes.
struct LivoxSaid {
  alignas(64) std::int32_t words[kTogether][4];
};

enum LivoxQuantity : std::size_t { kX, kY, kZ, kRange, kAzimuth, kReflectivity, kQuantities };

/// One return of each of kLanes firings, as bits, in memory: some vectors cannot be members. One that is none has a
/// range of 0.
struct LivoxEcho {
  alignas(64) std::uint32_t words[kQuantities][kLanes];

  HWY_INLINE Words word(LivoxQuantity which) const { return hn::Load(WordTag(), words[which]); }
  HWY_INLINE Floats number(LivoxQuantity which) const { return hn::BitCast(FloatTag(), word(which)); }
  template <class V>
  HWY_INLINE void set(LivoxQuantity which, V value) {
    hn::Store(hn::BitCast(WordTag(), value), WordTag(), words[which]);
  }
};

HWY_INLINE void read_firings(const LivoxPacket& packet, std::size_t first, std::size_t count, std::size_t which,
                             LivoxSaid& out) {
  const LivoxForm& form = *packet.form;
  if (form.is_spherical || form.is_short) {
    for (std::size_t k = 0; k < count; ++k) {
      const LivoxReturn one = read_livox_return(form, packet.data.data() + (first + k) * form.point_bytes, which);
      for (std::size_t i = 0; i < 3; ++i) out.words[k][i] = one.said[i];
      out.words[k][3] = one.reflectivity;
    }
  } else {
    // The words stand in the packet as they are wanted. Behind the last firing there may be no more than its own bytes.
    const std::byte* firing = packet.data.data() + first * form.point_bytes + which * 14;
    for (std::size_t k = 0; k + 1 < count; ++k, firing += form.point_bytes)
      std::memcpy(out.words[k], firing, sizeof out.words[k]);
    std::memcpy(out.words[count - 1], firing, 13);
  }
  for (std::size_t k = count; k % kLanes != 0; ++k) std::memset(out.words[k], 0, sizeof out.words[k]);
}

/// Places the returns of kLanes firings from `at` on.
HWY_INLINE void place_firings(const LivoxForm& form, const AzimuthDirection* directions, const LivoxSaid& said,
                              std::size_t at, LivoxEcho& out) {
  const FloatTag d;
  const IntTag whole;
  auto first = hn::Zero(whole), second = first, third = first, fourth = first;
  hn::LoadInterleaved4(whole, said.words[at], first, second, third, fourth);
  out.set(kReflectivity, hn::And(fourth, hn::Set(whole, 0xFF)));
  if (!form.is_spherical) {
    const auto unit_m = hn::Set(d, form.is_short ? 0.01f : 0.001f);
    const auto metres = [&](auto number) { return hn::Mul(hn::ConvertTo(d, number), unit_m); };
    const auto x = metres(first), y = metres(second), z = metres(third);
    const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    out.set(kX, hn::Neg(y)), out.set(kY, x), out.set(kZ, z);
    out.set(kRange, hn::Sqrt(square)), out.set(kAzimuth, azimuth_of(y, x));
    return;
  }
  // Numbers of 16 bits, and a zenith of more than half a turn, which is one on the other side.
  const auto turn = hn::Set(whole, kAzimuthsOfCircle), half = hn::Set(whole, kAzimuthsOfCircle / 2);
  const auto last = hn::Set(whole, kAzimuthsOfCircle - 1);
  const auto within = [&](auto angle) { return hn::Sub(angle, hn::IfThenElseZero(hn::Gt(angle, last), turn)); };
  auto zenith = within(second), azimuth = within(third);
  const auto is_behind = hn::Gt(zenith, half);
  zenith = hn::IfThenElse(is_behind, hn::Sub(turn, zenith), zenith);
  azimuth = within(hn::Add(azimuth, hn::IfThenElseZero(is_behind, half)));
  auto sin_zenith = hn::Zero(d), cos_zenith = sin_zenith, sin_azimuth = sin_zenith, cos_azimuth = sin_zenith;
  look_up_directions(directions, zenith, sin_zenith, cos_zenith);
  look_up_directions(directions, azimuth, sin_azimuth, cos_azimuth);
  const auto range = hn::Mul(hn::ConvertTo(d, first), hn::Set(d, 0.001f));
  const auto across = hn::Mul(range, sin_zenith);
  out.set(kX, hn::Neg(hn::Mul(across, sin_azimuth))), out.set(kY, hn::Mul(across, cos_azimuth));
  out.set(kZ, hn::Mul(range, cos_zenith)), out.set(kRange, range);
  out.set(kAzimuth, hn::Mul(hn::ConvertTo(d, azimuth), hn::Set(d, kAzimuthStep)));
}

/// Exchanges returns where the second is nearer, or the first is none.
HWY_INLINE void sort_by_range(LivoxEcho& near, LivoxEcho& far) {
  const auto zero = hn::Zero(FloatTag());
  const auto near_m = near.number(kRange), far_m = far.number(kRange);
  const auto is_wrong = hn::RebindMask(
      WordTag(), hn::And(hn::Gt(far_m, zero), hn::Or(hn::Not(hn::Gt(near_m, zero)), hn::Gt(near_m, far_m))));
  for (std::size_t i = 0; i < kQuantities; ++i) {
    const auto which = static_cast<LivoxQuantity>(i);
    const auto a = near.word(which), b = far.word(which);
    near.set(which, hn::IfThenElse(is_wrong, b, a));
    far.set(which, hn::IfThenElse(is_wrong, a, b));
  }
}

/// Writes the returns of kLanes firings that may have `kReturns`, counted by range. Equal ones are one.
template <std::size_t kReturns>
HWY_INLINE LaserReturn* write_echoes(LivoxEcho (&echoes)[kReturns], const std::int32_t* time_ns, float nearest_m,
                                     float farthest_m, LaserReturn* out) {
  const FloatTag d;
  const WordTag bits;
  const auto zero = hn::Zero(d);
  /// Gives `use` the quantities of one return of each firing.
  const auto make = [&](const LivoxEcho& echo, std::uint32_t number, const auto& use) {
    const auto range = echo.number(kRange);
    const auto is_within = hn::And(hn::Ge(range, hn::Set(d, nearest_m)), hn::Le(range, hn::Set(d, farthest_m)));
    const auto is_kept = hn::RebindMask(bits, hn::And(is_within, hn::Gt(range, zero)));
    return use(is_kept, echo.word(kX), echo.word(kY), echo.word(kZ), echo.word(kRange), echo.word(kAzimuth),
               hn::BitCast(bits, hn::Load(IntTag(), time_ns)),
               hn::Or(hn::ShiftLeft<16>(echo.word(kReflectivity)), hn::Set(bits, tags_of(0, 0, number))));
  };
  if constexpr (kReturns == 1) {
    return make(echoes[0], 1, [&](auto... quantities) { return write_returns(quantities..., hn::Set(bits, 1U), out); });
  } else {
    auto count = hn::Zero(bits);
    for (std::size_t i = 0; i < kReturns; ++i) {
      LivoxEcho& one = echoes[i];
      for (std::size_t other = 0; other < i; ++other) {
        const auto is_equal = [&](LivoxQuantity which) {
          return hn::Eq(one.number(which), echoes[other].number(which));
        };
        const auto is_same = hn::And(hn::And(is_equal(kX), is_equal(kY)), is_equal(kZ));
        one.set(kRange, hn::IfThenZeroElse(is_same, one.number(kRange)));
      }
      const auto is_one = hn::RebindMask(bits, hn::Gt(one.number(kRange), zero));
      count = hn::Add(count, hn::IfThenElseZero(is_one, hn::Set(bits, 1U)));
    }
    sort_by_range(echoes[0], echoes[1]);
    if constexpr (kReturns == 3) sort_by_range(echoes[1], echoes[2]), sort_by_range(echoes[0], echoes[1]);
    Lanes lanes[kReturns];
    for (std::size_t i = 0; i < kReturns; ++i)
      make(echoes[i], static_cast<std::uint32_t>(i + 1),
           [&](auto... quantities) { lanes[i].store(quantities..., count); });
    return write_in_turn(lanes, out);
  }
}

template <std::size_t kReturns>
HWY_INLINE LaserReturn* decode_points(const LivoxPacket& packet, const AzimuthDirection* directions, double interval_ns,
                                      float nearest_m, float farthest_m, LaserReturn* out) {
  const DoubleTag d;
  LivoxSaid said[kReturns];
  alignas(64) std::int32_t time_ns[kTogether];
  for (std::size_t first = 0; first < packet.points; first += kTogether) {
    const std::size_t count = std::min(kTogether, packet.points - first);
    for (std::size_t k = 0; k < count; k += kDoubles) {
      const auto number = hn::Iota(d, static_cast<double>(first + k));
      store_integers(rounded(hn::Mul(double_of(interval_ns), number)), time_ns + k);
    }
    for (std::size_t which = 0; which < kReturns; ++which) read_firings(packet, first, count, which, said[which]);
    for (std::size_t k = 0; k < count; k += kLanes) {
      LivoxEcho echoes[kReturns];
      for (std::size_t which = 0; which < kReturns; ++which)
        place_firings(*packet.form, directions, said[which], k, echoes[which]);
      out = write_echoes(echoes, time_ns + k, nearest_m, farthest_m, out);
    }
  }
  return out;
}

/// Replaces `returns` by those of the packet. `scratch` has room for one more.
void decode_livox_points(const LivoxPacket& packet, const AzimuthDirection* directions, double interval_ns,
                         float nearest_m, float farthest_m, LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  const auto decode = [&](auto count) {
    return decode_points<count.value>(packet, directions, interval_ns, nearest_m, farthest_m, scratch);
  };
  LaserReturn* out = packet.form->returns == 1   ? decode(std::integral_constant<std::size_t, 1>())
                     : packet.form->returns == 2 ? decode(std::integral_constant<std::size_t, 2>())
                                                 : decode(std::integral_constant<std::size_t, 3>());
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
  (packet, azimuth_directions().data(), interval_ns, nearest_m_, farthest_m_, scratch_.data(), returns);
}

}  // namespace hueline::drivers
#endif
