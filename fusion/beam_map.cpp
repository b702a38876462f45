// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/beam_map.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <utility>

#include "fusion/beam_map.hpp"

#ifndef HUELINE_FUSION_BEAM_MAP_ONCE
#define HUELINE_FUSION_BEAM_MAP_ONCE
namespace hueline::fusion {
/// The nearest and the farthest point of each cell, in the lower and the upper half of a word, from `first_cell` on.
/// The one with the index `nothing` is the last, and stands for all other cells.
struct SpanView {
  const std::uint32_t* values;
  std::uint32_t first_cell, nothing;
};
}  // namespace hueline::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// One vector of places.
template <class D>
void count_vector(D d, const SpanView& spans, const std::uint32_t* cell, const float* nearness, std::uint32_t* counts) {
  const hn::Rebind<std::int32_t, D> whole;
  const hn::Rebind<std::uint32_t, D> bits;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  // Cells before the first one are beyond the last when they are counted from it.
  const auto index =
      hn::Min(hn::Sub(hn::LoadU(bits, cell), hn::Set(bits, spans.first_cell)), hn::Set(bits, spans.nothing));
  const auto span = hn::GatherIndex(bits, spans.values, hn::BitCast(whole, index));
  const auto decoded = [&](auto code) {
    return hn::BitCast(d, hn::Add(hn::ShiftLeft<kDroppedBits>(code), hn::Set(bits, kFarthestBits)));
  };
  const auto near_code = hn::And(span, hn::Set(bits, 0xFFFFU));
  const auto near = decoded(near_code), far = decoded(hn::ShiftRight<16>(span));
  const auto place = hn::LoadU(d, nearness), distance = hn::Div(one, hn::Max(place, hn::Set(d, 1e-10f)));
  // Ground that is seen at a grazing angle spans much distance within a cell.
  const auto slack =
      hn::Add(hn::Set(d, 0.25f), hn::Mul(hn::Mul(hn::Set(d, 0.002f), distance), distance));  // m, and 1/m
  const auto is_known = hn::And(hn::RebindMask(d, hn::Gt(near_code, hn::Zero(bits))), hn::Gt(place, zero));
  const auto is_free = hn::And(is_known, hn::Lt(hn::Mul(hn::Add(distance, slack), near), one));
  const auto is_met = hn::And(hn::AndNot(is_free, is_known), hn::Lt(hn::Mul(hn::Sub(distance, slack), far), one));
  const auto before = hn::LoadU(bits, counts);
  const auto most = hn::Set(bits, PresenceCount::kMost);
  const auto add_if = [&](auto count, auto is_one_more, std::uint32_t unit) {
    return hn::IfThenElseZero(hn::And(hn::RebindMask(bits, is_one_more), hn::Lt(count, most)), hn::Set(bits, unit));
  };
  const auto more = hn::Or(add_if(hn::And(before, hn::Set(bits, 0xFFFFU)), is_free, 1U),
                           add_if(hn::ShiftRight<16>(before), is_met, 1U << 16));
  hn::StoreU(hn::Add(before, more), bits, counts);
}

void count(const SpanView& spans, const SeenPlaces& seen, PresenceCount* counts) {
  static_assert(sizeof(PresenceCount) == sizeof(std::uint32_t));
  const hn::CappedTag<float, 16> d;
  const hn::CappedTag<float, 1> single;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 0;
  for (; i + lanes <= seen.cell.size(); i += lanes)
    count_vector(d, spans, seen.cell.data() + i, seen.nearness.data() + i, &counts[i].bits);
  for (; i < seen.cell.size(); ++i)
    count_vector(single, spans, seen.cell.data() + i, seen.nearness.data() + i, &counts[i].bits);
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
HWY_EXPORT(count);

namespace {
/// Cells without a point, for the next turn: to clear those that had one is cheaper than memory that the system hands
/// out anew.
std::vector<CodedNearness>& spare_cells() {
  thread_local std::vector<CodedNearness> cells;
  return cells;
}
}  // namespace

BeamMap::BeamMap(const DirectionGrid& grid) : grid_(grid) {
  std::swap(nearest_, spare_cells());
  if (nearest_.size() != grid.size()) nearest_.assign(grid.size(), 0);
}

void BeamMap::finish() {
  constexpr CodedNearness kNothing = 0xFFFF;
  const auto columns = static_cast<std::size_t>(grid_.columns), rows = static_cast<std::size_t>(grid_.rows);
  // The beams speak for the rows that they reach, and for those beside.
  const auto is_reached = [&](std::size_t row) {
    CodedNearness any = 0;
    for (std::size_t x = 0; x < columns; ++x) any |= nearest_[row * columns + x];
    return any != 0;
  };
  std::size_t first = 0, end = rows;
  while (first < end && !is_reached(first)) ++first;
  while (end > first && !is_reached(end - 1)) --end;
  if (first < end) {
    first = first > 0 ? first - 1 : 0;
    end = std::min(rows, end + 1);
  }
  first_cell_ = static_cast<std::uint32_t>(first * columns);
  const std::size_t height = end - first;
  // Each loop is one that compilers turn into vector instructions. Rows go around, so they get a cell at both ends.
  thread_local std::vector<CodedNearness> near, far, ring_near, ring_far;
  thread_local std::vector<std::uint32_t> spans_of_row;
  near.resize(nearest_.size());
  far.resize(nearest_.size());
  ring_near.resize(columns + 2);
  ring_far.resize(columns + 2);
  spans_of_row.resize(columns);
  for (std::size_t row = 0; row < height; ++row) {
    CodedNearness* here = nearest_.data() + first_cell_ + row * columns;
    for (std::size_t x = 0; x < columns; ++x) {
      ring_near[x + 1] = here[x];
      ring_far[x + 1] = here[x] > 0 ? here[x] : kNothing;
    }
    std::fill_n(here, columns, CodedNearness{0});
    for (std::vector<CodedNearness>* ring : {&ring_near, &ring_far}) {
      ring->front() = (*ring)[columns];
      ring->back() = (*ring)[1];
    }
    CodedNearness *near_row = near.data() + row * columns, *far_row = far.data() + row * columns;
    for (std::size_t x = 0; x < columns; ++x) {
      near_row[x] = std::max(std::max(ring_near[x], ring_near[x + 1]), ring_near[x + 2]);
      far_row[x] = std::min(std::min(ring_far[x], ring_far[x + 1]), ring_far[x + 2]);
    }
  }
  spare_cells() = std::move(nearest_);
  spans_.reserve(height * columns + 1);
  for (std::size_t row = 0; row < height; ++row) {
    const std::size_t here = row * columns, below = row > 0 ? here - columns : here,
                      above = row + 1 < height ? here + columns : here;
    for (std::size_t x = 0; x < columns; ++x) {
      const CodedNearness nearest = std::max(std::max(near[below + x], near[here + x]), near[above + x]),
                          farthest = std::min(std::min(far[below + x], far[here + x]), far[above + x]);
      spans_of_row[x] = static_cast<std::uint32_t>(farthest) << 16 | nearest;
    }
    spans_.insert(spans_.end(), spans_of_row.begin(), spans_of_row.end());
  }
  spans_.push_back(0);
}

void BeamMap::count(const SeenPlaces& seen, PresenceCount* counts) const {
  const SpanView spans{spans_.data(), first_cell_, static_cast<std::uint32_t>(spans_.size() - 1)};
  HWY_DYNAMIC_DISPATCH(count)(spans, seen, counts);
}

}  // namespace hueline::fusion
#endif
