// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/turn_skin.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>

#include "fusion/turn_skin.hpp"

#ifndef HUELINE_FUSION_TURN_SKIN_ONCE
#define HUELINE_FUSION_TURN_SKIN_ONCE
namespace hueline::fusion {
constexpr float kSameSurface = 0.04f;  // the nearness of points of one surface differs by this share at most
constexpr std::size_t kWindow = 2 * TurnSkin::kBesideRows + 1;
static_assert(kWindow <= 16);  // bits of a strip
/// What TurnSkin holds.
struct SkinView {
  const float* nearness;
  const std::uint32_t* index;
  const std::vector<std::uint32_t>& cells;
  std::size_t height;
  std::uint32_t no_point;
};
}  // namespace hueline::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Returns a bit for each of kWindow places in sequence: whether a point is there that is about as near as `own`.
HWY_INLINE std::uint16_t select(const float* nearness, const std::uint32_t* index, float own, std::uint32_t no_point) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToUnsigned<decltype(d)> whole;
  const std::size_t lanes = hn::Lanes(d);
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < kWindow; i += lanes) {
    const auto apart = hn::Abs(hn::Sub(hn::LoadU(d, nearness + i), hn::Set(d, own)));
    const auto is_near = hn::RebindMask(whole, hn::Le(apart, hn::Set(d, kSameSurface * own)));
    const auto is_point = hn::Ne(hn::LoadU(whole, index + i), hn::Set(whole, no_point));
    std::array<std::uint8_t, 8> bits{};  // as many as StoreMaskBits() may write
    hn::StoreMaskBits(whole, hn::And(is_near, is_point), bits.data());
    out |= (bits[0] | static_cast<std::uint32_t>(bits[1]) << 8) << i;
  }
  return static_cast<std::uint16_t>(out & ((1U << kWindow) - 1));
}

void neighbours(const SkinView& skin, TurnSkin::Neighbours* out) {
  constexpr std::size_t kOwnStrip = 2 * TurnSkin::kBesideColumns;
  for (std::uint32_t i = 0; i < skin.cells.size(); ++i) {
    TurnSkin::Neighbours& around = out[i];
    const std::size_t near = skin.cells[i];
    const std::size_t layer = skin.index[near] == i ? 0 : 1, own = near + layer * skin.height;
    const std::size_t first = near - kOwnStrip * skin.height - TurnSkin::kBesideRows;
    around.own = static_cast<std::uint32_t>(own);
    around.first = static_cast<std::uint32_t>(first);
    const float nearness = skin.nearness[own];
    int count = -1;  // without the point itself
    for (std::size_t s = 0; s < TurnSkin::kStrips; ++s) {
      const std::size_t at = first + s * skin.height;
      around.strips[s] = select(skin.nearness + at, skin.index + at, nearness, skin.no_point);
      count += std::popcount(around.strips[s]);
    }
    around.strips[kOwnStrip + layer] &= static_cast<std::uint16_t>(~(1U << TurnSkin::kBesideRows));
    const int stride = count / (static_cast<int>(TurnSkin::kMostNeighbours) + 1) + 1;
    if (stride == 1) continue;
    int next = 0;  // how many neighbours come before the one that stays
    for (std::uint16_t& strip : around.strips) {
      std::uint32_t kept = 0;
      for (std::uint32_t left = strip; left != 0; left &= left - 1) {
        if (next == 0) kept |= left & -left;
        next = next == 0 ? stride - 1 : next - 1;
      }
      strip = static_cast<std::uint16_t>(kept);
    }
  }
}

/// `counts` are those of each place.
void sum_around(std::span<const TurnSkin::Neighbours> around, const std::uint32_t* counts, std::size_t height,
                PresenceCount* sums) {
  const hn::CappedTag<std::uint32_t, 16> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t p = 0; p < around.size(); ++p) {
    const TurnSkin::Neighbours& of = around[p];
    auto sum = hn::Zero(d);
    for (std::size_t i = 0; i < kWindow; i += lanes) {
      const auto place = hn::Shl(hn::Set(d, 1), hn::Iota(d, static_cast<std::uint32_t>(i)));
      for (std::size_t s = 0; s < TurnSkin::kStrips; ++s) {
        if (of.strips[s] == 0) continue;  // as most of the farthest points are
        const auto is_neighbour = hn::TestBit(hn::Set(d, of.strips[s]), place);
        sum = hn::Add(sum, hn::IfThenElseZero(is_neighbour, hn::LoadU(d, counts + of.first + s * height + i)));
      }
    }
    sums[p].bits = counts[of.own] + hn::GetLane(hn::SumOfLanes(d, sum));
  }
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
namespace {
HWY_EXPORT(neighbours);
HWY_EXPORT(sum_around);
}  // namespace

TurnSkin::TurnSkin(const DirectionGrid& grid)
    : grid_(grid),
      height_(static_cast<std::size_t>(grid.rows) + 2 * kAround),
      nearness_(2 * static_cast<std::size_t>(grid.columns + 2 * kBesideColumns) * height_ + kWidest, 0.0f),
      index_(nearness_.size(), kNoPoint) {
  static_assert(kBesideRows <= kAround);
}

template <class T>
void TurnSkin::go_around(T* of_places) const {
  const std::size_t margin = 2 * kBesideColumns * height_,
                    columns = 2 * static_cast<std::size_t>(grid_.columns) * height_;
  std::copy_n(of_places + columns, margin, of_places);
  std::copy_n(of_places + margin, margin, of_places + margin + columns);
}

void TurnSkin::add(const SeenPlaces& seen) {
  for (std::size_t i = 0; i < seen.cell.size(); ++i) {
    const std::size_t place = seen.cell[i];
    float &near = nearness_[place], &far = nearness_[place + height_];
    const float nearness = seen.nearness[i];
    if (nearness > near) near = nearness;
    if (far == 0.0f || nearness < far) far = nearness;
  }
}

void TurnSkin::neighbours(std::vector<Neighbours>& out) {
  go_around(nearness_.data());
  go_around(index_.data());
  out.resize(cells_.size());
  HWY_DYNAMIC_DISPATCH(neighbours)({nearness_.data(), index_.data(), cells_, height_, kNoPoint}, out.data());
}

void TurnSkin::sum_around(std::span<const Neighbours> around, const PresenceCount* counts, PresenceCount* sums) const {
  // What was counted for each place. Places without a point keep what they had: nobody's neighbours are there.
  thread_local std::vector<std::uint32_t> of_places;
  if (of_places.size() < places()) of_places.assign(places(), 0);
  for (std::size_t i = 0; i < around.size(); ++i) of_places[around[i].own] = counts[i].bits;
  go_around(of_places.data());
  HWY_DYNAMIC_DISPATCH(sum_around)(around, of_places.data(), height_, sums);
}

void TurnSkin::clear() {
  for (const std::uint32_t place : cells_) {
    for (const std::size_t at : {place + std::size_t{0}, place + height_}) {
      nearness_[at] = 0;
      index_[at] = kNoPoint;
    }
  }
  cells_.clear();
}

}  // namespace hueline::fusion
#endif
