// Angles for vectors, the same bits on every machine.
// The files that include this are compiled once for each instruction set, and include it once for each.
#if defined(HUELINE_DRIVERS_PORTABLE_VECTORS) == defined(HWY_TARGET_TOGGLE)
#ifdef HUELINE_DRIVERS_PORTABLE_VECTORS
#undef HUELINE_DRIVERS_PORTABLE_VECTORS
#else
#define HUELINE_DRIVERS_PORTABLE_VECTORS
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <numbers>

#include "drivers/azimuth_directions.hpp"
#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

constexpr std::size_t kDoubles = kLanes == 1 ? 1 : kLanes / 2;
using DoubleTag = hn::FixedTag<double, kDoubles>;
using Doubles = hn::Vec<DoubleTag>;

constexpr float kLargestAzimuth = 6.2831850f;  ///< the largest float below 2 pi

HWY_INLINE Doubles double_of(double value) { return hn::Set(DoubleTag(), value); }

/// Returns the angles of directions from the x axis to the y axis, 0 to 2 pi, of finite numbers. Of no direction it is
/// 0. The largest error is 5e-7 rad, which is what a float near 2 pi resolves.
HWY_INLINE Floats azimuth_of(Floats y, Floats x) {
  const FloatTag d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const auto across = hn::Abs(y), along = hn::Abs(x);
  const auto larger = hn::Max(hn::Max(across, along), hn::Set(d, 1e-30f)), smaller = hn::Min(across, along);
  // Angles of more than pi/8 from the nearer axis are counted from pi/4.
  const auto is_between = hn::Gt(smaller, hn::Mul(larger, hn::Set(d, 0.41421356f)));
  const auto far = hn::IfThenElseZero(is_between, one);
  const auto t = hn::Div(hn::Sub(smaller, hn::Mul(far, larger)), hn::Add(larger, hn::Mul(far, smaller)));
  const auto q = hn::Mul(t, t);
  // A polynomial for (atan(t) - t) / t^3 whose largest error on this interval is the smallest.
  auto sum = hn::Set(d, 0.0805372006f);
  for (const float term : {-0.1387767795f, 0.1997770996f, -0.3333294914f})
    sum = hn::Add(hn::Set(d, term), hn::Mul(q, sum));
  const auto rest = hn::Add(t, hn::Mul(hn::Mul(t, q), sum));
  const auto flat = hn::Add(hn::Mul(far, hn::Set(d, std::numbers::pi_v<float> / 4)), rest);
  const auto steep = hn::Sub(hn::Set(d, std::numbers::pi_v<float> / 2), flat);
  const auto angle = hn::IfThenElse(hn::Gt(across, along), steep, flat);
  const auto ahead = hn::IfThenElse(hn::Lt(x, zero), hn::Sub(hn::Set(d, std::numbers::pi_v<float>), angle), angle);
  const auto around = hn::Sub(hn::Set(d, 2 * std::numbers::pi_v<float>), ahead);
  // Just below 2 pi the difference is rounded to it.
  return hn::Min(hn::IfThenElse(hn::Lt(y, zero), around, ahead), hn::Set(d, kLargestAzimuth));
}

/// Looks sines and cosines of angles up, which are of 0 to 35999 hundredths of a degree.
HWY_INLINE void look_up_directions(const AzimuthDirection* directions, Ints hundredths, Floats& sine, Floats& cosine) {
  static_assert(sizeof(AzimuthDirection) == 2 * sizeof(float));
  const FloatTag d;
#if HWY_ARCH_X86 && HWY_MAX_BYTES == 64
  // Both are read together. A number of 64 bits is the index of one, with zeros in its upper half.
  const hn::FixedTag<std::int64_t, kLanes / 2> wide;
  const hn::Half<IntTag> half;
  const auto pairs = [&](auto at) {
    return hn::BitCast(
        d, hn::GatherIndex(wide, reinterpret_cast<const std::int64_t*>(directions), hn::PromoteTo(wide, at)));
  };
  const auto low = pairs(hn::LowerHalf(half, hundredths)), high = pairs(hn::UpperHalf(half, hundredths));
  sine = hn::ConcatEven(d, high, low);
  cosine = hn::ConcatOdd(d, high, low);
#else
  const auto at = hn::Add(hundredths, hundredths);
  sine = hn::GatherIndex(d, &directions->sine, at);
  cosine = hn::GatherIndex(d, &directions->sine, hn::Add(at, hn::Set(IntTag(), 1)));
#endif
}

/// Returns the nearest whole numbers, halves away from zero, as std::lround() does.
HWY_INLINE Doubles rounded(Doubles value) {
  const auto size = hn::Abs(value), below = hn::Floor(size);
  const auto is_more = hn::Ge(hn::Sub(size, below), double_of(0.5));
  return hn::CopySign(hn::Add(below, hn::IfThenElseZero(is_more, double_of(1))), value);
}

/// Stores doubles as floats, and whole numbers as integers.
HWY_INLINE void store_floats(Doubles value, float* out) {
  const hn::Rebind<float, DoubleTag> half;
  hn::StoreU(hn::DemoteTo(half, value), half, out);
}
HWY_INLINE void store_integers(Doubles value, std::int32_t* out) {
  const hn::Rebind<std::int32_t, DoubleTag> half;
  hn::StoreU(hn::DemoteTo(half, value), half, out);
}

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
