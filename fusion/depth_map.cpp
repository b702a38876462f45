// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time. The loops are written so that the compiler turns them into vector instructions.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/depth_map.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <new>
#include <numbers>
#include <utility>

#include "core/mutex.hpp"
#include "core/portable_math.hpp"
#include "fusion/depth_map.hpp"

#ifndef HUELINE_FUSION_DEPTH_MAP_ONCE
#define HUELINE_FUSION_DEPTH_MAP_ONCE
namespace hueline::fusion {
/// How far the filters of a row reach to the left and right, in cells. Near the poles a cell is narrower.
struct RowReach {
  int gap, guard;
};
/// A part of a map, and the working memory to close it. Around it lie `pad` columns on both sides and some rows, which
/// its filters need. The columns go around, the rows end at the poles.
struct DepthBlock {
  DepthMap::Config config;
  int gap = 0, guard = 0;  ///< reach of the filters up and down, in cells
  float tolerance = 0, share = 0;
  std::vector<RowReach> reach;  ///< for each row of the map
  std::vector<int> beside;      ///< for each row, how far to the left and right a change in it may reach, in columns
  int first_row = 0, rows = 0;  ///< rows of the map, with those around
  int pad = 0, width = 0;       ///< columns around on each side, and all columns; multiples of kLanes
  /// Of all planes, with room around each for vectors that begin beside it.
  hwy::AlignedFreeUniquePtr<CodedNearness[]> values;
  std::size_t plane_size = 0;
  CodedNearness* plane(std::size_t index) { return values.get() + index * plane_size + kRoom; }
  static constexpr std::size_t kRoom = 64;
};
/// The planes of a block.
enum DepthPlane : std::size_t { kClosed, kFar, kOutline, kGuarded, kOwn, kScratch, kDepthPlanes };
constexpr int kLanes = 32;                           // of the widest vectors
constexpr int kMostCells = 8;                        // largest reach to the left and right
constexpr int kBlockRows = 32, kBlockColumns = 256;  // what a block's filters work on fits the cache

constexpr int whole_lanes(int columns) { return (columns + kLanes - 1) / kLanes * kLanes; }
/// Returns how many columns beside a cell decide about it: two filters that close, slopes, and one that guards.
constexpr int columns_around(const RowReach& reach) { return 2 * reach.gap + 1 + std::max(1, reach.guard); }
constexpr int kMostAround = whole_lanes(columns_around({kMostCells, kMostCells}));
}  // namespace hueline::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<CodedNearness, kLanes>;
using V = hn::Vec<D>;
using F = hn::CappedTag<float, kLanes / 2>;
using VF = hn::Vec<F>;

struct Nearer {
  static V of(V a, V b) { return hn::Max(a, b); }
};
struct Farther {
  static V of(V a, V b) { return hn::Min(a, b); }
};

/// Replaces each value by the extreme of those within the reach in its row and then in its column. Vectors run over the
/// ends of rows, so the outermost columns become meaningless, as many as the reach.
template <class Extreme, class ReachOf>
void filter(DepthBlock& block, std::size_t from, std::size_t to, int vertical, const ReachOf& reach_of) {
  const D d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const std::ptrdiff_t stride = block.width;
  const CodedNearness* values = block.plane(from);
  CodedNearness *scratch = block.plane(kScratch), *result = block.plane(to);
  for (int y = 0; y < block.rows; ++y) {
    const CodedNearness* in = values + y * stride;
    CodedNearness* out = scratch + y * stride;
    const int reach = reach_of(block.reach[static_cast<std::size_t>(block.first_row + y)]);
    for (std::ptrdiff_t x = 0; x < stride; x += lanes) {
      V extreme = hn::Load(d, in + x);
      for (int k = 1; k <= reach; ++k)
        extreme = Extreme::of(extreme, Extreme::of(hn::LoadU(d, in + x - k), hn::LoadU(d, in + x + k)));
      hn::Store(extreme, d, out + x);
    }
  }
  // Two rows have all but one of the rows around them in common.
  for (int y = 0; y < block.rows; y += 2) {
    const int end = block.rows - 1, next = std::min(y + 1, end);
    const int first = std::max(0, y - vertical), last = std::min(end, next + vertical);
    const int begin_shared = std::max(0, next - vertical), end_shared = std::min(end, y + vertical);
    for (std::ptrdiff_t x = 0; x < stride; x += lanes) {
      const CodedNearness* column = scratch + x;
      V shared = hn::Load(d, column + begin_shared * stride);
      for (int k = begin_shared + 1; k <= end_shared; ++k)
        shared = Extreme::of(shared, hn::Load(d, column + k * stride));
      hn::Store(Extreme::of(shared, hn::Load(d, column + first * stride)), d, result + y * stride + x);
      hn::Store(Extreme::of(shared, hn::Load(d, column + last * stride)), d, result + next * stride + x);
    }
  }
}

/// Returns the difference to the neighbour that is smaller in size; 0 if the two have different signs.
inline VF gentler(F d, VF back, VF ahead) {
  const VF smaller = hn::IfThenElse(hn::Lt(hn::Abs(back), hn::Abs(ahead)), back, ahead);
  return hn::IfThenElseZero(hn::Gt(hn::Mul(back, ahead), hn::Zero(d)), smaller);
}

/// decoded() of a vector.
inline VF load_decoded(const CodedNearness* from) {
  const hn::Rebind<std::uint32_t, F> wide;
  const auto code = hn::PromoteTo(wide, hn::LoadU(hn::Rebind<CodedNearness, F>(), from));
  const auto bits = hn::Add(hn::ShiftLeft<kDroppedBits>(code), hn::Set(wide, kFarthestBits));
  return hn::BitCast(F(), hn::IfThenElseZero(hn::Gt(code, hn::Zero(wide)), bits));
}

/// coded() of a vector.
inline void store_coded(VF value, CodedNearness* to) {
  const hn::RebindToSigned<F> whole;
  const hn::Rebind<CodedNearness, F> codes;
  const auto above = hn::Sub(hn::BitCast(whole, value), hn::Set(whole, static_cast<std::int32_t>(kFarthestBits)));
  hn::StoreU(hn::DemoteTo(codes, hn::ShiftRight<kDroppedBits>(above)), codes, to);
}

/// Writes the indices of those of the points that are nearer than the nearest in their cells, and no nearer than
/// `most`, 1/m. Returns how many there are. `out` has room for all points.
std::size_t find_nearer(const CodedNearness* nearest, float most, const SeenPlaces& seen, std::uint32_t* out) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> whole;
  const hn::RebindToUnsigned<decltype(d)> bits;
  const std::size_t lanes = hn::Lanes(d), size = seen.cell.size();
  std::size_t count = 0, i = 0;
  for (; i + lanes <= size; i += lanes) {
    const auto nearness = hn::LoadU(d, seen.nearness.data() + i);
    // As coded(), but for its limits, which only leave out.
    const auto code = hn::ShiftRight<kDroppedBits>(
        hn::Sub(hn::BitCast(whole, nearness), hn::Set(whole, static_cast<std::int32_t>(kFarthestBits))));
    const auto offset = hn::ShiftLeft<1>(hn::BitCast(whole, hn::LoadU(bits, seen.cell.data() + i)));
    const auto here = hn::And(hn::GatherOffset(whole, reinterpret_cast<const std::int32_t*>(nearest), offset),
                              hn::Set(whole, 0xFFFF));
    const auto is_nearer = hn::And(hn::Gt(code, here), hn::RebindMask(whole, hn::Le(nearness, hn::Set(d, most))));
    if (hn::AllFalse(whole, is_nearer)) continue;
    std::array<std::uint8_t, 8> found{};  // as many as StoreMaskBits() may write
    hn::StoreMaskBits(whole, is_nearer, found.data());
    for (std::uint32_t left = found[0] | static_cast<std::uint32_t>(found[1]) << 8; left != 0; left &= left - 1)
      out[count++] = static_cast<std::uint32_t>(i) + static_cast<std::uint32_t>(std::countr_zero(left));
  }
  for (; i < size; ++i)
    if (coded(seen.nearness[i]) > nearest[seen.cell[i]] && seen.nearness[i] <= most)
      out[count++] = static_cast<std::uint32_t>(i);
  return count;
}

/// Fills the planes of `block` from the nearest points in kClosed.
void close_gaps(DepthBlock& block) {
  const auto gap = [](const RowReach& row) { return row.gap; };
  const auto guard = [](const RowReach& row) { return row.guard; };
  const auto one = [](const RowReach&) { return 1; };
  filter<Nearer>(block, kClosed, kClosed, block.gap, gap);
  filter<Farther>(block, kClosed, kClosed, block.gap, gap);
  filter<Farther>(block, kClosed, kFar, 1, one);
  // An outline is where a neighbour is nearer than the cell's own slope explains. It is marked with the neighbour's
  // nearness.
  const F d;
  const VF tolerance = hn::Set(d, block.tolerance), share = hn::Set(d, block.share);
  const std::ptrdiff_t stride = block.width;
  for (int y = 0; y < block.rows; ++y) {
    const std::ptrdiff_t first = y * stride;
    const CodedNearness* here = block.plane(kClosed) + first;
    const CodedNearness* above = y > 0 ? here - stride : here;
    const CodedNearness* below = y + 1 < block.rows ? here + stride : here;
    CodedNearness *mark = block.plane(kOutline) + first, *own = block.plane(kOwn) + first;
    for (std::ptrdiff_t x = 0; x < stride; x += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
      const VF c = load_decoded(here + x), left = load_decoded(here + x - 1), right = load_decoded(here + x + 1),
               up = load_decoded(above + x), down = load_decoded(below + x);
      const VF along = gentler(d, hn::Sub(c, left), hn::Sub(right, c)),
               across = gentler(d, hn::Sub(c, up), hn::Sub(down, c));
      const VF slack = hn::Add(hn::Mul(hn::Mul(tolerance, c), c), hn::Mul(share, c));
      const auto nearer = [&](VF beside, VF expected) {
        return hn::IfThenElseZero(hn::Gt(beside, hn::Add(expected, slack)), beside);
      };
      const VF most = hn::Max(hn::Max(nearer(left, hn::Sub(c, along)), nearer(right, hn::Add(c, along))),
                              hn::Max(nearer(up, hn::Sub(c, across)), nearer(down, hn::Add(c, across))));
      store_coded(most, mark + x);
      store_coded(hn::Sub(c, hn::Add(hn::Abs(along), hn::Abs(across))), own + x);
    }
  }
  filter<Nearer>(block, kOutline, kGuarded, block.guard, guard);
  filter<Nearer>(block, kOutline, kOutline, 1, one);
}

/// Writes the four bounds of `columns` cells from column `pad` on of a row of the block, cell by cell.
void write_bounds(DepthBlock& block, int row, int columns, CodedNearness* bounds) {
  const D d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * block.width + block.pad;
  const CodedNearness *far = block.plane(kFar) + first, *own = block.plane(kOwn) + first,
                      *outline = block.plane(kOutline) + first, *guarded = block.plane(kGuarded) + first;
  std::ptrdiff_t x = 0;
  for (; x + lanes <= columns; x += lanes)
    hn::StoreInterleaved4(hn::Load(d, far + x), hn::Load(d, own + x), hn::Load(d, outline + x),
                          hn::Load(d, guarded + x), d, bounds + 4 * x);
  for (; x < columns; ++x) {
    CodedNearness* cell = bounds + 4 * x;
    cell[0] = far[x];
    cell[1] = own[x];
    cell[2] = outline[x];
    cell[3] = guarded[x];
  }
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
namespace {
HWY_EXPORT(close_gaps);
HWY_EXPORT(find_nearer);
HWY_EXPORT(write_bounds);

int cells_of(double angle, double cell) { return std::max(1, static_cast<int>(std::lround(angle / cell))); }

/// Returns how many rows above and below a cell decide about it.
int rows_around(const DepthBlock& block) { return 2 * block.gap + 1 + std::max(1, block.guard); }

/// Returns how many columns beside a cell of these rows decide about it, at the most.
int widest(const DepthBlock& block, int first_row, int last_row) {
  int most = 0;
  for (int row = first_row; row <= last_row; ++row)
    most = std::max(most, columns_around(block.reach[static_cast<std::size_t>(row)]));
  return most;
}

DepthBlock block_for(const DepthMap::Config& config, const DirectionGrid& grid) {
  DepthBlock block;
  block.config = config;
  block.gap = cells_of(config.gap, config.cell);
  block.guard = cells_of(config.guard, config.cell);
  block.tolerance = static_cast<float>(config.tolerance_m);
  block.share = static_cast<float>(config.tolerance_share);
  for (int row = 0; row < grid.rows; ++row) {
    const double width = portable::cos(std::numbers::pi * ((row + 0.5) / grid.rows - 0.5));
    const auto reach = [&](int cells) {
      return std::min(kMostCells, static_cast<int>(std::lround(cells / std::max(width, 0.01))));
    };
    block.reach.push_back({reach(block.gap), reach(block.guard)});
  }
  const int above = rows_around(block);
  for (int row = 0; row < grid.rows; ++row)
    block.beside.push_back(widest(block, std::max(0, row - above), std::min(grid.rows - 1, row + above)));
  block.plane_size =
      static_cast<std::size_t>((kBlockRows + 2 * rows_around(block)) * (kBlockColumns + 2 * kMostAround)) +
      2 * DepthBlock::kRoom;
  block.values = hwy::AllocateAligned<CodedNearness>(kDepthPlanes * block.plane_size);
  std::fill_n(block.values.get(), kDepthPlanes * block.plane_size, CodedNearness{0});
  return block;
}

// Of the eight cells around a place's own, so many with a nearer point are few, and so many are a surface.
constexpr int kFewAround = 1, kSurfaceAround = 5;
// A point is not far behind a place if it is no farther than this share of its nearness and this distance.
constexpr float kThereShare = 0.95f, kThere_m = 0.3f;

/// Returns the greatest code that is not before a place: for which decoded(code) * slack > here does not hold.
CodedNearness last_not_before(float here, float slack) {
  constexpr CodedNearness kNearest = 0xFFFF;
  if (!(slack > 0)) return kNearest;
  const CodedNearness about = coded(here / slack);
  // The division rounds, and may be one code off.
  if (decoded(about) * slack > here) return static_cast<CodedNearness>(about - 1);
  if (about < kNearest && !(decoded(static_cast<CodedNearness>(about + 1)) * slack > here))
    return static_cast<CodedNearness>(about + 1);
  return about;
}

/// Returns an index that goes around.
int around(int index, int size) { return (index % size + size) % size; }

/// The blocks that a map is closed in: their numbers of rows and columns, and the cells of each.
struct Blocks {
  explicit Blocks(const DirectionGrid& whole)
      : grid(whole),
        rows((grid.rows + kBlockRows - 1) / kBlockRows),
        columns((grid.columns + kBlockColumns - 1) / kBlockColumns) {}
  struct Cells {
    int row, end_row, column, end_column;
  };
  std::size_t size() const { return static_cast<std::size_t>(rows * columns); }
  Cells operator[](std::size_t index) const {
    const int row = static_cast<int>(index) / columns * kBlockRows,
              column = static_cast<int>(index) % columns * kBlockColumns;
    return {row, std::min(grid.rows, row + kBlockRows), column, std::min(grid.columns, column + kBlockColumns)};
  }
  std::size_t cell(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) + static_cast<std::size_t>(column);
  }
  DirectionGrid grid;
  int rows, columns;
};
}  // namespace

class DepthMap::Memory {
 public:
  /// Returns planes of nothing.
  std::unique_ptr<Planes> take(const DirectionGrid& grid) {
    std::unique_ptr<Planes> planes;
    {
      const Lock lock(mutex_);
      if (!spare_.empty()) {
        planes = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (!planes || planes->nearest.size() != grid.size() + 1) return std::make_unique<Planes>(grid);
    planes->clear(grid);
    return planes;
  }
  void give(std::unique_ptr<Planes> planes) {
    const Lock lock(mutex_);
    spare_.push_back(std::move(planes));
  }

 private:
  Mutex mutex_;
  std::vector<std::unique_ptr<Planes>> spare_ HUELINE_GUARDED_BY(mutex_);
};

std::shared_ptr<DepthMap::Memory> DepthMap::make_memory() { return std::make_shared<Memory>(); }

void DepthMap::Return::operator()(Planes* planes) const {
  std::unique_ptr<Planes> owned(planes);
  if (memory) memory->give(std::move(owned));
}

DepthMap::Planes::Planes(const DirectionGrid& grid)
    : nearest(grid.size() + 1),
      bounds(static_cast<Bounds*>(std::calloc(grid.size(), sizeof(Bounds)))),
      strips(grid.size() / kStrip + 1),
      is_written(Blocks(grid).size()) {
  if (!bounds) throw std::bad_alloc();
}

void DepthMap::Planes::clear(const DirectionGrid& grid) {
  for (std::size_t strip = 0; strip < strips.size(); ++strip)
    if (std::exchange(strips[strip], 0) != 0)
      std::fill(nearest.begin() + static_cast<std::ptrdiff_t>(strip * kStrip),
                nearest.begin() + static_cast<std::ptrdiff_t>(std::min(nearest.size(), (strip + 1) * kStrip)),
                CodedNearness{0});
  const Blocks blocks(grid);
  for (std::size_t part = 0; part < is_written.size(); ++part) {
    if (std::exchange(is_written[part], 0) == 0) continue;
    const Blocks::Cells cells = blocks[part];
    for (int row = cells.row; row < cells.end_row; ++row)
      std::fill_n(bounds.get() + blocks.cell(row, cells.column), cells.end_column - cells.column, Bounds{});
  }
}

DepthMap::DepthMap(const Config& config, std::shared_ptr<Memory> memory)
    : config_(config),
      grid_(config.cell),
      tolerance_(static_cast<float>(config.tolerance_m)),
      share_(static_cast<float>(1.0 + config.tolerance_share)),
      most_(static_cast<float>(1.0 / config.nearest_m)),
      planes_(memory ? memory->take(grid_).release() : new Planes(grid_), Return{memory}),
      nearest_(planes_->nearest.data()),
      bounds_(planes_->bounds.get()),
      strips_(planes_->strips.data()) {}

std::span<const std::uint32_t> DepthMap::nearer(const SeenPlaces& seen) const {
  thread_local std::vector<std::uint32_t> found;
  if (found.size() < seen.cell.size()) found.resize(seen.cell.size());
  return {found.data(), HWY_DYNAMIC_DISPATCH(find_nearer)(nearest_, most_, seen, found.data())};
}

DepthMap::Around DepthMap::look_around(std::uint32_t cell, float nearness) const {
  // Codes compare as what they stand for, so the bounds of the place become codes, and only the nearest is decoded.
  const CodedNearness not_before = last_not_before(nearness * share_, 1.0f - tolerance_ * nearness);
  const CodedNearness far_behind = coded(kThereShare * nearness / (1.0f + kThere_m * nearness));
  Around out;
  CodedNearness nearest = 0;
  const auto ask = [&](CodedNearness code) {
    nearest = std::max(nearest, code);
    out.before += code > not_before ? 1 : 0;
    out.there += code > far_behind && code <= not_before ? 1 : 0;
  };
  const auto columns = static_cast<std::int64_t>(grid_.columns), size = static_cast<std::int64_t>(grid_.size());
  const std::int64_t middle = cell;
  const bool is_inside = middle > columns && middle + columns + 1 < size;
  for (const std::int64_t row : {middle - columns, middle, middle + columns})
    for (const int column : {-1, 0, 1})
      // A neighbour beyond the grid's first column lies in the row before, which is as good: rows are dense.
      if (const std::int64_t index = row + column; is_inside || (index >= 0 && index < size)) ask(nearest_[index]);
  out.nearest = decoded(nearest);
  out.is_before = nearest_[cell] > not_before;
  return out;
}

LineOfSight DepthMap::judge_points(std::uint32_t cell, float nearness, LineOfSight closed) const {
  const Around around = look_around(cell, nearness);
  if (around.is_before)
    return closed == LineOfSight::Hidden || around.before > kSurfaceAround ? LineOfSight::Hidden : LineOfSight::Covered;
  return closed == LineOfSight::Hidden && around.before > kFewAround ? LineOfSight::Hidden : LineOfSight::Behind;
}

void DepthMap::close() {
  if (is_closed_) return;
  is_closed_ = true;
  // The memory of a block is the same for all maps, and maps are closed again and again.
  thread_local DepthBlock block;
  if (block.reach.empty() || block.config != config_) block = block_for(config_, grid_);
  const int columns = grid_.columns, rows = grid_.rows;
  const int above = rows_around(block);
  const Blocks blocks(grid_);
  // The blocks that a changed cell reaches.
  std::vector<std::uint8_t> is_reached(blocks.size());
  for (std::size_t strip = 0; strip < planes_->strips.size(); ++strip) {
    if (strips_[strip] != kChanged) continue;
    strips_[strip] = kSettled;
    const auto first = static_cast<int>(strip * kStrip), last = first + static_cast<int>(kStrip) - 1;
    // A strip that goes on in the next row may have changed at any column.
    const int first_row = first / columns, last_row = std::min(rows - 1, last / columns);
    const bool is_one_row = first_row == last_row;
    const int low = std::max(0, first_row - above), high = std::min(rows - 1, last_row + above);
    const int beside =
        std::max(block.beside[static_cast<std::size_t>(first_row)], block.beside[static_cast<std::size_t>(last_row)]);
    const int left = is_one_row ? first % columns - beside : 0,
              right = is_one_row ? last % columns + beside : columns - 1;
    for (int x = 0; x < blocks.columns; ++x) {
      const int begin = x * kBlockColumns, end = std::min(columns, begin + kBlockColumns);
      const bool is_beside = right < begin || left >= end;
      const bool is_around = left + columns < end || right - columns >= begin;
      if (is_beside && !is_around) continue;
      for (int y = low / kBlockRows; y <= high / kBlockRows; ++y)
        is_reached[static_cast<std::size_t>(y * blocks.columns + x)] = 1;
    }
  }
  for (std::size_t part = 0; part < is_reached.size(); ++part) {
    if (is_reached[part] == 0) continue;
    planes_->is_written[part] = 1;
    const auto [row, end_row, column, end_column] = blocks[part];
    block.first_row = std::max(0, row - above);
    block.rows = std::min(rows, end_row + above) - block.first_row;
    block.pad = whole_lanes(widest(block, block.first_row, block.first_row + block.rows - 1));
    block.width = whole_lanes(end_column - column) + 2 * block.pad;
    for (int y = 0; y < block.rows; ++y) {
      const CodedNearness* in = nearest_ + static_cast<std::ptrdiff_t>(block.first_row + y) * columns;
      CodedNearness* out = block.plane(kClosed) + static_cast<std::ptrdiff_t>(y) * block.width;
      for (int x = 0; x < block.width;) {
        const int from = around(column - block.pad + x, columns), run = std::min(columns - from, block.width - x);
        std::copy_n(in + from, run, out + x);
        x += run;
      }
    }
    HWY_DYNAMIC_DISPATCH(close_gaps)(block);
    for (int y = row; y < end_row; ++y) HWY_DYNAMIC_DISPATCH(write_bounds)
    (block, y - block.first_row, end_column - column, &bounds_[blocks.cell(y, column)].whole);
  }
}

}  // namespace hueline::fusion
#endif
