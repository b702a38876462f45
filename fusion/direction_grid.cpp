// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/direction_grid.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/direction_grid.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Returns an angle of 0 to 1 for the quotient smaller / larger of the sides of a right angle: 0.5 at 45 degrees.
/// Within 0.3 degrees of the arc tangent.
template <class D, class V>
V eighth(D d, V smaller, V larger) {
  const auto q = hn::Div(smaller, hn::Max(larger, hn::Set(d, 1e-30f)));
  return hn::Mul(q, hn::Sub(hn::Set(d, 0.67382f), hn::Mul(hn::Set(d, 0.17382f), q)));
}

/// The eyes of a head with axes parallel to ENU.
struct EnuEyes {
  explicit EnuEyes(const RelativeHead& head) : count(std::min(head.eyes.size(), kMost)) {
    const auto& R = head.R_head_enu;
    const auto to_enu = [&R](const std::array<float, 3>& a) {
      return std::array<float, 3>{R[0] * a[0] + R[3] * a[1] + R[6] * a[2], R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
                                  R[2] * a[0] + R[5] * a[1] + R[8] * a[2]};
    };
    for (std::size_t k = 0; k < count; ++k) each[k] = {to_enu(head.eyes[k].axis), to_enu(head.eyes[k].centre)};
  }
  static constexpr std::size_t kMost = 32;
  std::size_t count;
  std::array<LensEye, kMost> each;
};

/// One vector of places. Multiplications and additions stay apart, so that no instruction set rounds differently.
template <bool kWithParallax, class D>
void locate_vector(D d, const CellOrder& order, const RelativeHead& head, const EnuEyes& eyes, float columns,
                   float rows, const float* px, const float* py, const float* pz, std::uint32_t* cell, float* nearness,
                   float* parallax) {
  const auto set = [d](float value) { return hn::Set(d, value); };
  const auto zero = hn::Zero(d), one = set(1.0f);
  const auto x = hn::LoadU(d, px), y = hn::LoadU(d, py), z = hn::LoadU(d, pz);
  auto ex = hn::Add(x, set(head.origin[0])), ey = hn::Add(y, set(head.origin[1])), ez = hn::Add(z, set(head.origin[2]));
  if (eyes.count > 0) {
    auto best = set(-1e30f), cx = zero, cy = zero, cz = zero;
    for (std::size_t k = 0; k < eyes.count; ++k) {
      const auto& [axis, centre] = eyes.each[k];
      const auto along =
          hn::Add(hn::Add(hn::Mul(set(axis[0]), ex), hn::Mul(set(axis[1]), ey)), hn::Mul(set(axis[2]), ez));
      const auto is_nearer = hn::Gt(along, best);
      best = hn::IfThenElse(is_nearer, along, best);
      cx = hn::IfThenElse(is_nearer, set(centre[0]), cx);
      cy = hn::IfThenElse(is_nearer, set(centre[1]), cy);
      cz = hn::IfThenElse(is_nearer, set(centre[2]), cz);
    }
    ex = hn::Sub(ex, cx);
    ey = hn::Sub(ey, cy);
    ez = hn::Sub(ez, cz);
  }
  const auto squared = [](auto a, auto b, auto c) {
    return hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c));
  };
  const auto inverse = [&](auto sum) { return hn::Div(one, hn::Sqrt(hn::Max(sum, set(1e-20f)))); };
  const auto from_head = squared(ex, ey, ez);
  const auto near = inverse(from_head);
  if constexpr (kWithParallax) {
    const auto per_range = inverse(squared(x, y, z));
    const auto side =
        squared(hn::Sub(hn::Mul(ex, near), hn::Mul(x, per_range)), hn::Sub(hn::Mul(ey, near), hn::Mul(y, per_range)),
                hn::Sub(hn::Mul(ez, near), hn::Mul(z, per_range)));
    hn::StoreU(hn::Sqrt(side), d, parallax);
  }
  const auto& R = head.R_head_enu;
  const auto row_of = [&](std::size_t k) {
    return hn::Add(hn::Add(hn::Mul(set(R[k]), ex), hn::Mul(set(R[k + 1]), ey)), hn::Mul(set(R[k + 2]), ez));
  };
  const auto hx = row_of(0), hy = row_of(3), hz = row_of(6);
  const auto ax = hn::Abs(hx), ay = hn::Abs(hy), az = hn::Abs(hz);
  const auto across = hn::Sqrt(hn::Add(hn::Mul(hx, hx), hn::Mul(hy, hy)));
  // Quarters of a turn from the x axis, 0 to 4.
  auto turn = eighth(d, hn::Min(ax, ay), hn::Max(ax, ay));
  turn = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(one, turn), turn);
  turn = hn::IfThenElse(hn::Lt(hx, zero), hn::Sub(set(2.0f), turn), turn);
  turn = hn::IfThenElse(hn::Lt(hy, zero), hn::Sub(set(4.0f), turn), turn);
  auto rise = eighth(d, hn::Min(az, across), hn::Max(az, across));
  rise = hn::IfThenElse(hn::Gt(az, across), hn::Sub(one, rise), rise);
  rise = hn::IfThenElse(hn::Lt(hz, zero), hn::Sub(zero, rise), rise);
  const hn::Rebind<std::int32_t, D> whole;
  const auto column = hn::Min(hn::ConvertTo(whole, hn::Mul(turn, set(columns * 0.25f))),
                              hn::Set(whole, static_cast<std::int32_t>(columns) - 1));
  const auto row = hn::Min(hn::ConvertTo(whole, hn::Mul(hn::Add(rise, one), set(rows * 0.5f))),
                           hn::Set(whole, static_cast<std::int32_t>(rows) - 1));
  const auto index = hn::Add(hn::Mul(row, hn::Set(whole, order.per_row)),
                             hn::Add(hn::Mul(column, hn::Set(whole, order.per_column)), hn::Set(whole, order.first)));
  hn::StoreU(hn::BitCast(hn::Rebind<std::uint32_t, D>(), index), hn::Rebind<std::uint32_t, D>(), cell);
  hn::StoreU(hn::IfThenElse(hn::Gt(from_head, set(1e-6f)), near, zero), d, nearness);
}

template <bool kWithParallax>
void locate_with(const DirectionGrid& grid, const CellOrder& order, const RelativeHead& head, const float* px,
                 const float* py, const float* pz, SeenPlaces& out) {
  const hn::CappedTag<float, 16> d;
  const std::size_t lanes = hn::Lanes(d), count = out.cell.size();
  const auto columns = static_cast<float>(grid.columns), rows = static_cast<float>(grid.rows);
  const EnuEyes eyes(head);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    locate_vector<kWithParallax>(d, order, head, eyes, columns, rows, px + i, py + i, pz + i, out.cell.data() + i,
                                 out.nearness.data() + i, kWithParallax ? out.parallax.data() + i : nullptr);
  if (i == count) return;
  std::array<float, 16> x{}, y{}, z{}, nearness{}, parallax{};
  std::array<std::uint32_t, 16> cell{};
  const auto last = static_cast<std::ptrdiff_t>(count - i), first = static_cast<std::ptrdiff_t>(i);
  std::copy_n(px + first, last, x.begin());
  std::copy_n(py + first, last, y.begin());
  std::copy_n(pz + first, last, z.begin());
  locate_vector<kWithParallax>(d, order, head, eyes, columns, rows, x.data(), y.data(), z.data(), cell.data(),
                               nearness.data(), parallax.data());
  std::copy_n(cell.begin(), last, out.cell.begin() + first);
  std::copy_n(nearness.begin(), last, out.nearness.begin() + first);
  if (kWithParallax) std::copy_n(parallax.begin(), last, out.parallax.begin() + first);
}

void locate(const DirectionGrid& grid, const CellOrder& order, const RelativeHead& head, const float* px,
            const float* py, const float* pz, bool with_parallax, SeenPlaces& out) {
  if (with_parallax) {
    locate_with<true>(grid, order, head, px, py, pz, out);
  } else {
    locate_with<false>(grid, order, head, px, py, pz, out);
  }
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
HWY_EXPORT(locate);

namespace {
CellOrder row_by_row(const DirectionGrid& grid) { return {1, grid.columns, 0}; }
}  // namespace

DirectionGrid::DirectionGrid(double cell)
    : columns(std::max(8, static_cast<int>(std::lround(2 * std::numbers::pi / cell)))),
      rows(std::max(4, static_cast<int>(std::lround(std::numbers::pi / cell)))) {}

void locate(const DirectionGrid& grid, const RelativeHead& head, const RelativePlaces& places, SeenPlaces& out) {
  out.cell.resize(places.size());
  out.nearness.resize(places.size());
  out.parallax.resize(places.size());
  HWY_DYNAMIC_DISPATCH(locate)
  (grid, row_by_row(grid), head, places.x.data(), places.y.data(), places.z.data(), true, out);
}

namespace {
void locate_cells_from(const DirectionGrid& grid, const CellOrder& order, const RelativeHead& head,
                       const RelativePlaces& places, std::size_t begin, std::size_t end, SeenPlaces& out) {
  out.cell.resize(end - begin);
  out.nearness.resize(end - begin);
  out.parallax.clear();
  HWY_DYNAMIC_DISPATCH(locate)
  (grid, order, head, places.x.data() + begin, places.y.data() + begin, places.z.data() + begin, false, out);
}
}  // namespace

void locate_cells(const DirectionGrid& grid, const RelativeHead& head, const RelativePlaces& places, std::size_t begin,
                  std::size_t end, SeenPlaces& out) {
  locate_cells_from(grid, row_by_row(grid), head, places, begin, end, out);
}

void locate_cells(const DirectionGrid& grid, const RelativeHead& head, const RelativePlaces& places, SeenPlaces& out) {
  locate_cells(grid, head, places, 0, places.size(), out);
}

void locate_cells(const DirectionGrid& grid, const CellOrder& order, const RelativeHead& head,
                  const RelativePlaces& places, SeenPlaces& out) {
  locate_cells_from(grid, order, head, places, 0, places.size(), out);
}
}  // namespace hueline::fusion
#endif
