// Functions of core/portable_math.hpp for vectors: the same operations in the same order, so they give the same bits.
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

#include "drivers/write_returns-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {

constexpr std::size_t kDoubles = kLanes == 1 ? 1 : kLanes / 2;
using DoubleTag = hn::FixedTag<double, kDoubles>;
using Doubles = hn::Vec<DoubleTag>;

HWY_INLINE Doubles double_of(double value) { return hn::Set(DoubleTag(), value); }

/// Computes the sine and the cosine of angles up to a million, rad.
HWY_INLINE void sine_cosine(Doubles angle, Doubles& sine, Doubles& cosine) {
  const auto add = [](auto a, auto b) { return hn::Add(a, b); };
  const auto sub = [](auto a, auto b) { return hn::Sub(a, b); };
  const auto mul = [](auto a, auto b) { return hn::Mul(a, b); };
  const auto one = double_of(1), half = double_of(0.5);
  // An angle of -pi/4 to pi/4 as a sum, and the quarters of a turn before it.
  const auto quarters = hn::Round(hn::Div(angle, double_of(0x1.921fb544p+0)));
  const auto first = sub(angle, mul(quarters, double_of(0x1.921fb544p+0)));
  const auto second = mul(quarters, double_of(0x1.0b4611a6p-34));
  const auto x = sub(first, second);
  const auto rest = sub(sub(sub(first, x), second), mul(quarters, double_of(0x1.3198a2e037073p-69)));

  const auto q = mul(x, x);
  auto sum = double_of(1 / 355687428096000.0);
  for (const double term :
       {-1 / 1307674368000.0, 1 / 6227020800.0, -1 / 39916800.0, 1 / 362880.0, -1 / 5040.0, 1 / 120.0, -1 / 6.0})
    sum = add(double_of(term), mul(q, sum));
  const auto sine_of_rest = add(x, add(mul(mul(x, q), sum), mul(rest, sub(one, mul(half, q)))));
  sum = double_of(-(1 / 6402373705728000.0));
  for (const double term :
       {1 / 20922789888000.0, -1 / 87178291200.0, 1 / 479001600.0, -1 / 3628800.0, 1 / 40320.0, -1 / 720.0, 1 / 24.0})
    sum = add(double_of(term), mul(q, sum));
  const auto half_square = mul(half, q), most = sub(one, half_square);
  const auto cosine_of_rest = add(most, add(sub(sub(one, most), half_square), sub(mul(mul(q, q), sum), mul(x, rest))));

  const auto pairs = hn::Floor(mul(half, quarters)), twos = mul(half, pairs);
  const auto is_odd = hn::Ne(mul(half, quarters), pairs), is_behind = hn::Ne(twos, hn::Floor(twos));
  const auto sine_size = hn::IfThenElse(is_odd, cosine_of_rest, sine_of_rest);
  const auto cosine_size = hn::IfThenElse(is_odd, sine_of_rest, cosine_of_rest);
  sine = hn::IfThenElse(is_behind, hn::Neg(sine_size), sine_size);
  cosine = hn::IfThenElse(hn::Xor(is_odd, is_behind), hn::Neg(cosine_size), cosine_size);
}

/// Returns the angles of directions from the x axis, -pi to pi, of finite numbers.
HWY_INLINE Doubles arc_tangent(Doubles y, Doubles x) {
  constexpr double kPi = std::numbers::pi, kPiRest = 1.2246467991473532e-16;
  // The arc tangents of eighths, as sums.
  static constexpr double kEighths[9] = {0,
                                         0x1.fd5ba9aac2f6ep-4,
                                         0x1.f5b75f92c80ddp-3,
                                         0x1.6f61941e4def1p-2,
                                         0x1.dac670561bb4fp-2,
                                         0x1.1e00babdefeb4p-1,
                                         0x1.4978fa3269ee1p-1,
                                         0x1.700a7c5784634p-1,
                                         0x1.921fb54442d18p-1};
  static constexpr double kRests[9] = {0,
                                       -0x1.cd37686760c17p-59,
                                       0x1.8ab6e3cf7afbdp-57,
                                       -0x1.c63aae6f6e918p-56,
                                       0x1.a2b7f222f65e2p-56,
                                       -0x1.928df287a668fp-58,
                                       0x1.2419a87f2a458p-56,
                                       -0x1.8c34d25aadef6p-56,
                                       0x1.1a62633145c07p-55};
  const DoubleTag d;
  const hn::RebindToSigned<DoubleTag> whole;
  const auto across = hn::Abs(y), along = hn::Abs(x), larger = hn::Max(across, along);
  const auto is_none = hn::Eq(larger, hn::Zero(d));
  const auto ratio = hn::IfThenZeroElse(is_none, hn::Div(hn::Min(across, along), larger));
  const auto eighth = hn::Round(hn::Mul(double_of(8), ratio)), near = hn::Mul(eighth, double_of(0.125));
  // The whole number stands in the lowest bits of its sum with 2^52.
  const auto index = hn::And(hn::BitCast(whole, hn::Add(eighth, double_of(0x1p52))), hn::Set(whole, 15));
  const auto t = hn::Div(hn::Sub(ratio, near), hn::Add(double_of(1), hn::Mul(ratio, near))), q = hn::Mul(t, t);
  auto sum = hn::Mul(q, double_of(-1.0 / 15));
  for (const double term : {1.0 / 13, -1.0 / 11, 1.0 / 9, -1.0 / 7, 1.0 / 5, -1.0 / 3})
    sum = hn::Mul(q, hn::Add(double_of(term), sum));
  const auto rest = hn::Add(t, hn::Add(hn::Mul(t, sum), hn::GatherIndex(d, kRests, index)));
  const auto flat = hn::Add(hn::GatherIndex(d, kEighths, index), rest);
  const auto steep = hn::Sub(double_of(kPi / 2), hn::Sub(flat, double_of(kPiRest / 2)));
  const auto angle = hn::IfThenElse(hn::Gt(across, along), steep, flat);
  const auto behind = hn::Sub(double_of(kPi), hn::Sub(angle, double_of(kPiRest)));
  // Also -0 is behind.
  const auto is_behind = hn::Lt(hn::CopySign(double_of(1), x), hn::Zero(d));
  return hn::CopySign(hn::IfThenElse(is_behind, behind, angle), y);
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
