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
// Points of a skin are of one surface if their cells are this near and their nearness differs by this share at most.
constexpr std::size_t kBesideRows = 5, kBesideColumns = 2;
constexpr float kSameSurface = 0.04f;
constexpr std::size_t kWindow = 2 * kBesideRows + 1;
constexpr std::size_t kWidest = 8;  // lanes of a vector
constexpr std::uint32_t kNoPoint = 0xFFFFFFFFU;
/// For each selection of eight lanes their numbers, four bits for each: what is selected comes first. Compress() of
/// Highway has such a table too, which compilers copy to the stack for each vector.
constexpr std::array<std::uint32_t, 256> kWantedFirst = [] {
  std::array<std::uint32_t, 256> out{};
  for (std::uint32_t bits = 0; bits < out.size(); ++bits)
    for (std::uint32_t lane = 0, at = 0; lane < kWidest; ++lane)
      if ((bits >> lane & 1u) != 0) out[bits] |= lane << (4 * at++);
  return out;
}();
/// What TurnSkin holds.
struct SkinView {
  const float* nearness;
  const std::uint32_t* index;
  const std::vector<std::uint32_t>& cells;
  std::uint32_t columns;
  std::size_t height, around;
};
}  // namespace hueline::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Writes the indices of those among kWindow points in sequence that are about as near as `own`. Returns how many there
/// are.
HWY_INLINE std::size_t select(const float* nearness, const std::uint32_t* index, float own, std::uint32_t self,
                              std::uint32_t* out) {
  const hn::CappedTag<float, kWidest> d;
  const hn::RebindToUnsigned<decltype(d)> whole;
  const std::size_t lanes = hn::Lanes(d);
  const auto four_bits_each = hn::Mul(hn::Iota(whole, 0), hn::Set(whole, 4));
  std::size_t count = 0;
  for (std::size_t i = 0; i < kWindow; i += lanes) {
    const auto apart = hn::Abs(hn::Sub(hn::LoadU(d, nearness + i), hn::Set(d, own)));
    const auto found = hn::LoadU(whole, index + i);
    const auto is_near = hn::RebindMask(whole, hn::Le(apart, hn::Set(d, kSameSurface * own)));
    const auto is_other = hn::And(hn::Ne(found, hn::Set(whole, kNoPoint)), hn::Ne(found, hn::Set(whole, self)));
    const auto is_wanted = hn::And(hn::FirstN(whole, kWindow - i), hn::And(is_near, is_other));
    std::array<std::uint8_t, 8> bits;  // as many as StoreMaskBits() may write
    hn::StoreMaskBits(whole, is_wanted, bits.data());
    const auto order = hn::And(hn::Shr(hn::Set(whole, kWantedFirst[bits[0]]), four_bits_each), hn::Set(whole, 7));
    hn::StoreU(hn::TableLookupLanes(found, hn::IndicesFromVec(whole, order)), whole, out + count);
    count += static_cast<std::size_t>(std::popcount(bits[0]));
  }
  return count;
}

void neighbours(const SkinView& skin, IndexLists& out) {
  // With room for a vector that begins at the last of the indices that a window can give.
  std::array<std::uint32_t, 2 * kWindow*(2 * kBesideColumns + 1) + kWidest> found;
  for (std::uint32_t i = 0; i < skin.cells.size(); ++i) {
    out.first.push_back(static_cast<std::uint32_t>(out.indices.size()));
    const std::uint32_t row = skin.cells[i] / skin.columns, column = skin.cells[i] % skin.columns;
    const std::size_t own = 2 * column * skin.height + row + skin.around;
    const float nearness = skin.nearness[skin.index[own] == i ? own : own + skin.height];
    std::size_t count = 0;
    std::size_t c = (column < kBesideColumns ? column + skin.columns : column) - kBesideColumns;
    for (std::size_t k = 0; k <= 2 * kBesideColumns; ++k, c = c + 1 < skin.columns ? c + 1 : 0) {
      const std::size_t near = 2 * c * skin.height + row + skin.around - kBesideRows;
      for (const std::size_t first : {near, near + skin.height})
        count += select(skin.nearness + first, skin.index + first, nearness, i, &found[count]);
    }
    const std::size_t stride = count / (TurnSkin::kMostNeighbours + 1) + 1;
    if (stride == 1) {
      out.indices.insert(out.indices.end(), found.data(), found.data() + count);
    } else {
      for (std::size_t k = 0; k < count; k += stride) out.indices.push_back(found[k]);
    }
  }
  out.first.push_back(static_cast<std::uint32_t>(out.indices.size()));
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
namespace {
HWY_EXPORT(neighbours);

constexpr float kSameLayer = 0.9f;  // of the nearness: points of a cell within this are of one surface
}  // namespace

TurnSkin::TurnSkin(const DirectionGrid& grid)
    : grid_(grid),
      columns_(static_cast<std::uint32_t>(grid.columns)),
      height_(static_cast<std::size_t>(grid.rows) + 2 * kAround),
      nearness_(2 * columns_ * height_ + kWidest, 0.0f),
      index_(nearness_.size(), kNoPoint) {
  static_assert(kBesideRows <= kAround);
}

void TurnSkin::add(const SeenPlaces& seen) {
  for (std::size_t i = 0; i < seen.cell.size(); ++i) {
    const std::size_t place = place_of(seen.cell[i]);
    float &near = nearness_[place], &far = nearness_[place + height_];
    const float nearness = seen.nearness[i];
    if (nearness > near) near = nearness;
    if (far == 0.0f || nearness < far) far = nearness;
  }
}

TurnSkin::Standing TurnSkin::stand_in(std::uint32_t cell, float nearness) {
  std::size_t place = place_of(cell);
  const float near = nearness_[place], far = nearness_[place + height_];
  const bool is_far = far < kSameLayer * near && nearness * nearness < near * far;
  if (is_far) place += height_;
  std::uint32_t& index = index_[place];
  if (index == kNoPoint) {
    index = static_cast<std::uint32_t>(cells_.size());
    cells_.push_back(cell);
  }
  return {index, nearness == (is_far ? far : near)};
}

void TurnSkin::neighbours(IndexLists& out) const {
  out.first.clear();
  out.first.reserve(cells_.size() + 1);
  out.indices.clear();
  HWY_DYNAMIC_DISPATCH(neighbours)({nearness_.data(), index_.data(), cells_, columns_, height_, kAround}, out);
}

void TurnSkin::clear() {
  for (const std::uint32_t cell : cells_) {
    const std::size_t place = place_of(cell);
    for (const std::size_t at : {place, place + height_}) {
      nearness_[at] = 0;
      index_[at] = kNoPoint;
    }
  }
  cells_.clear();
}

}  // namespace hueline::fusion
#endif
