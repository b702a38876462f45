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
#include <span>
#include <type_traits>
#include <vector>

#include "drivers/livox/livox_kernel.hpp"
#include "drivers/portable_vectors-inl.hpp"
#include "drivers/write_returns-inl.hpp"
#include "drivers/written_ahead.hpp"

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

/// Reads return `which` of one firing after the other.
HWY_INLINE void read_one_by_one(const LivoxForm& form, const std::byte* firing, std::size_t count, std::size_t which,
                                std::int32_t (*out)[4]) {
  for (std::size_t k = 0; k < count; ++k, firing += form.point_bytes) {
    const LivoxReturn one = read_livox_return(form, firing, which);
    for (std::size_t i = 0; i < 3; ++i) out[k][i] = one.said[i];
    out[k][3] = one.reflectivity;
  }
}

HWY_INLINE void read_firings(const LivoxPacket& packet, std::size_t first, std::size_t count, std::size_t which,
                             LivoxSaid& out) {
  const LivoxForm& form = *packet.form;
  const std::byte* firing = packet.data.data() + first * form.point_bytes;
  std::size_t k = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::FixedTag<std::uint8_t, 16> bytes;
  const hn::FixedTag<std::int32_t, 4> words;
  // Where the bytes of the four words are. Words of 16 bits come to the upper halves, and are shifted with their sign.
  constexpr std::uint8_t kNo = 0x80;
  alignas(16) constexpr std::uint8_t kCartesian[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, kNo, kNo, kNo};
  alignas(16) constexpr std::uint8_t kShort[16] = {kNo, kNo, 0, 1, kNo, kNo, 2, 3, kNo, kNo, 4, 5, kNo, kNo, 6, kNo};
  alignas(16) constexpr std::uint8_t kSpherical[16] = {0, 1, 2, 3, 4, 5, kNo, kNo, 6, 7, kNo, kNo, 8, kNo, kNo, kNo};
  const auto places = hn::Load(bytes, form.is_spherical ? kSpherical : form.is_short ? kShort : kCartesian);
  const std::size_t own = which * 14;  // of a firing with several returns, whose direction is not shared
  const std::size_t rest = packet.data.size() - first * form.point_bytes;
  const auto read = [&](const auto& finish) {
    // Behind the last firings there may be no 16 bytes.
    for (; k < count && k * form.point_bytes + own + 16 <= rest; ++k, firing += form.point_bytes) {
      const auto said = hn::LoadU(bytes, reinterpret_cast<const std::uint8_t*>(firing + own));
      hn::Store(finish(hn::BitCast(words, hn::TableLookupBytesOr0(said, places))), words, out.words[k]);
    }
  };
  const bool is_shared = form.is_spherical && form.returns > 1;
  if (form.is_short)
    read([](auto said) { return hn::ShiftRight<16>(said); });
  else if (!is_shared)
    read([](auto said) { return said; });
#endif
  read_one_by_one(form, firing, count - k, which, out.words + k);
  for (k = count; k % kLanes != 0; ++k) std::memset(out.words[k], 0, sizeof out.words[k]);
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
               hn::BitCast(bits, hn::LoadU(IntTag(), time_ns)),
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

/// Fills the times of firings, as many as there is room for, which is a multiple of 16.
void fill_livox_times(double interval_ns, std::span<std::int32_t> time_ns) {
  for (std::size_t k = 0; k < time_ns.size(); k += kDoubles) {
    const auto number = hn::Iota(DoubleTag(), static_cast<double>(k));
    store_integers(rounded(hn::Mul(double_of(interval_ns), number)), time_ns.data() + k);
  }
}

template <std::size_t kReturns>
HWY_INLINE LaserReturn* decode_points(const LivoxPacket& packet, const AzimuthDirection* directions,
                                      const std::int32_t* time_ns, float nearest_m, float farthest_m,
                                      LaserReturn* out) {
  LivoxSaid said[kReturns];
  for (std::size_t first = 0; first < packet.points; first += kTogether, time_ns += kTogether) {
    const std::size_t count = std::min(kTogether, packet.points - first);
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

/// Replaces `returns` by those of the packet. `scratch` has room for kWrittenAhead more.
void decode_livox_points(const LivoxPacket& packet, const AzimuthDirection* directions, const std::int32_t* time_ns,
                         float nearest_m, float farthest_m, LaserReturn* scratch, std::vector<LaserReturn>& returns) {
  const auto decode = [&](auto count) {
    return decode_points<count.value>(packet, directions, time_ns, nearest_m, farthest_m, scratch);
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
HWY_EXPORT(fill_livox_times);
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
  const std::size_t most = packet.points * packet.form->returns + kWrittenAhead;
  if (scratch_.size() < most) scratch_.resize(most);
  if (interval_ns != interval_ns_ || times_.size() < packet.points) {
    interval_ns_ = interval_ns;
    times_.resize(std::max(times_.size(), (packet.points + 15) / 16 * 16));
    HWY_DYNAMIC_DISPATCH(fill_livox_times)(interval_ns, times_);
  }
  HWY_DYNAMIC_DISPATCH(decode_livox_points)
  (packet, azimuth_directions().data(), times_.data(), nearest_m_, farthest_m_, scratch_.data(), returns);
}

}  // namespace hueline::drivers
#endif
