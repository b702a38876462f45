// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/panorama_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include "fusion/panorama_cells.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

/// Returns the angle of the direction (x, y) from the x axis, -pi to pi, rad.
V angle_of(V y, V x) {
  const D d;
  const V ax = hn::Abs(x), ay = hn::Abs(y), longer = hn::Max(ax, ay), shorter = hn::Min(ax, ay);
  const V q = hn::Div(shorter, hn::Max(longer, hn::Set(d, 1e-30f))), q2 = hn::Mul(q, q);
  // Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49: within 2e-8 for 0 to 1.
  constexpr std::array kTerms{0.0028662257f, -0.0161657367f, 0.0429096138f, -0.0752896400f,
                              0.1065626393f, -0.1420889944f, 0.1999355085f, -0.3333314528f};
  V sum = hn::Zero(d);
  for (const float term : kTerms) sum = hn::Mul(hn::Add(sum, hn::Set(d, term)), q2);
  V angle = hn::Add(q, hn::Mul(q, sum));
  constexpr auto kPi = std::numbers::pi_v<float>;
  angle = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, kPi / 2), angle), angle);
  angle = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, kPi), angle), angle);
  return hn::IfThenElse(hn::Lt(y, hn::Zero(d)), hn::Neg(angle), angle);
}

void find_vector(float width, const float* points, std::int32_t* column, std::int32_t* row, std::int32_t* reach,
                 float* nearness) {
  const D d;
  const hn::RebindToSigned<D> whole;
  const auto set = [d](float value) { return hn::Set(d, value); };
  V x, y, z;
  hn::LoadInterleaved3(d, points, x, y, z);
  const V across2 = hn::Add(hn::Mul(x, x), hn::Mul(y, y)), across = hn::Sqrt(across2),
          distance = hn::Sqrt(hn::Add(across2, hn::Mul(z, z)));
  const auto is_good = hn::And(hn::Gt(distance, set(0.05f)), hn::Lt(distance, set(std::numeric_limits<float>::max())));
  const V per_rad = set(width / (2 * std::numbers::pi_v<float>));
  // Where the point is no good, the cell is the first: no conversion of what is not finite.
  const auto number = [&](V value, float last) {
    const V bounded = hn::Min(hn::Max(value, hn::Zero(d)), set(last));
    return hn::ConvertTo(whole, hn::IfThenElseZero(is_good, bounded));
  };
  hn::StoreU(number(hn::Mul(angle_of(across, z), per_rad), 0.5f * width - 1), whole, row);
  hn::StoreU(number(hn::Sub(set(0.5f * width), hn::Mul(angle_of(y, x), per_rad)), width - 1), whole, column);
  // Towards the poles a cell gets narrower than a point.
  const V half = hn::Div(hn::Mul(set(0.5f), distance), hn::Max(across, hn::Mul(set(1e-3f), distance)));
  hn::StoreU(number(half, width / 8), whole, reach);
  hn::StoreU(hn::IfThenElseZero(is_good, hn::Div(set(1.0f), distance)), d, nearness);
}

void find_cells(std::uint32_t width, std::span<const Eigen::Vector3f> points, PanoramaCells& out) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const D d;
  const std::size_t lanes = hn::Lanes(d), count = points.size();
  const auto w = static_cast<float>(width);
  const float* from = count == 0 ? nullptr : points[0].data();
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    find_vector(w, from + 3 * i, &out.column[i], &out.row[i], &out.reach[i], &out.nearness[i]);
  if (i == count) return;
  std::array<float, 48> last{};
  std::array<std::int32_t, 16> column, row, reach;
  std::array<float, 16> nearness;
  std::copy_n(from + 3 * i, 3 * (count - i), last.begin());
  find_vector(w, last.data(), column.data(), row.data(), reach.data(), nearness.data());
  std::copy_n(column.begin(), count - i, &out.column[i]);
  std::copy_n(row.begin(), count - i, &out.row[i]);
  std::copy_n(reach.begin(), count - i, &out.reach[i]);
  std::copy_n(nearness.begin(), count - i, &out.nearness[i]);
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
HWY_EXPORT(find_cells);

void find_cells(std::uint32_t width, std::span<const Eigen::Vector3f> points, PanoramaCells& out) {
  out.column.resize(points.size());
  out.row.resize(points.size());
  out.reach.resize(points.size());
  out.nearness.resize(points.size());
  HWY_DYNAMIC_DISPATCH(find_cells)(width, points, out);
}

}  // namespace hueline::fusion
#endif
