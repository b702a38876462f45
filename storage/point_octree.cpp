#include "storage/point_octree.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace hueline::storage {
namespace {

/// A node with fewer points than this share of a full one is too small to be given away while points come.
constexpr std::size_t kSmallShare = 8;
/// So many full nodes' points a node of the deepest level takes before the one beside it is used.
constexpr std::size_t kDeepestNodes = 16;
constexpr std::size_t kEntries = 1u << 14;
/// An inner node with fewer points than this share stays open to the end: that costs little, and those above the root
/// are among them.
constexpr std::size_t kFewShare = 64;
constexpr std::size_t kBlockRecords = 16, kSlabBlocks = 256;

}  // namespace

/// Memory for some records of one node. Blocks are used again and again: buffers that grow and go would leave holes in
/// the program's memory, several times what the records need.
struct PointOctree::Block {
  Block* next = nullptr;
  std::byte* data() { return reinterpret_cast<std::byte*>(this + 1); }
};

/// Which cells of an inner node have a point: a hash table without chains, at most half full.
class PointOctree::Grid {
 public:
  /// Returns whether the cell had no point, and notes that it has one.
  bool take(std::uint32_t cell) {
    if (2 * (count_ + 1) > table_.size()) grow();
    std::uint32_t& place = find(cell + 1);
    if (place != 0) return false;
    place = cell + 1;
    ++count_;
    return true;
  }
  std::size_t bytes() const { return table_.size() * sizeof(std::uint32_t); }

 private:
  /// Returns where the value is, or the free place where it belongs.
  std::uint32_t& find(std::uint32_t value) {
    std::size_t at = (value * 0x9E3779B1u) >> shift_;
    while (table_[at] != 0 && table_[at] != value) at = (at + 1) & (table_.size() - 1);
    return table_[at];
  }
  void grow() {
    --shift_;
    for (const std::uint32_t value : std::exchange(table_, std::vector<std::uint32_t>(std::size_t{1} << (32 - shift_))))
      if (value != 0) find(value) = value;
  }
  unsigned shift_ = 32 - 5;  // 32 minus the bits of an index
  std::size_t count_ = 0;
  std::vector<std::uint32_t> table_ = std::vector<std::uint32_t>(32);
};

struct PointOctree::Growing {
  enum class State : std::uint8_t { Leaf, Inner, Given };
  struct Piece {
    std::uint64_t offset, bytes;
  };
  bool is_open() const { return state != State::Given; }
  std::size_t total() const { return spilled_bytes + bytes; }

  State state = State::Leaf;
  std::uint8_t level = 0;
  Place cell{};  // counted in nodes of the level
  Growing* above = nullptr;
  std::array<Growing*, 8> children{};
  Block *first = nullptr, *newest = nullptr;
  std::size_t bytes = 0;  // of the records in the blocks
  std::unique_ptr<Grid> grid;
  std::vector<Piece> spilled;  // what waits in the scratch file, older than the records
  std::size_t spilled_bytes = 0;
  std::uint64_t last = 0;  // number of the newest point
  std::uint32_t index = 0;
  std::optional<std::size_t> given;
};

PointOctree::PointOctree(const Config& config)
    : config_(config), node_bytes_(config.node_points * config.record_size), entries_(kEntries) {
  step_ = *std::max_element(config.scale.begin(), config.scale.end());
  for (std::size_t k = 0; k < 3; ++k) ratio_[k] = config.scale[k] / step_;
  root_ = nodes_.emplace_back(std::make_unique<Growing>()).get();
}
PointOctree::PointOctree(PointOctree&&) noexcept = default;
PointOctree& PointOctree::operator=(PointOctree&&) noexcept = default;
PointOctree::~PointOctree() = default;

PointOctree::Place PointOctree::place_of(ByteView record) const {
  Place place;
  for (std::size_t k = 0; k < 3; ++k) {
    std::int32_t value;
    std::memcpy(&value, record.data() + 4 * k, sizeof value);
    const auto steps = ratio_[k] == 1 ? std::int64_t{value} : static_cast<std::int64_t>(std::floor(value * ratio_[k]));
    place[k] = static_cast<std::uint64_t>(steps) + shift_[k];
  }
  return place;
}

/// A drive must not lie on both sides of a border between great cubes, or only a cube of hundreds of kilometres would
/// contain it. So its first point gets a place that is a third of the edge away from the borders of all levels up to an
/// edge of 2^26 steps, 67 km.
void PointOctree::begin_lattice(ByteView record) {
  constexpr std::uint64_t kBorder = 1u << 26, kThird = kBorder / 3, kHalf = 1u << 31;
  shift_.fill(kHalf);  // all coordinates are above 0 then
  for (std::size_t k = 0; k < 3; ++k) shift_[k] += (kThird - place_of(record)[k]) & (kBorder - 1);
  lowest_ = highest_ = place_of(record);
}

Status PointOctree::add(ByteView record) {
  if (number_++ == 0) begin_lattice(record);
  const Place place = place_of(record);
  for (std::size_t k = 0; k < 3; ++k) {
    lowest_[k] = std::min(lowest_[k], place[k]);
    highest_[k] = std::max(highest_[k], place[k]);
  }
  const Entry& entry = entry_of(place);
  insert(entry.node ? entry.node : nodes_.front().get(), place, record);
  if (held_bytes_ > config_.held_bytes) make_room();
  return status();
}

/// Returns the entry for a cell of the grids of the level above kEntry. All nodes on the way through that cell have
/// points in it once a point has passed through them, so the later points need not ask them.
PointOctree::Entry& PointOctree::entry_of(const Place& place) {
  constexpr unsigned kShift = kLevels - (kEntry - 1) - kGridBits;
  std::array<std::uint32_t, 3> cell;
  std::uint64_t hash = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    cell[k] = static_cast<std::uint32_t>(place[k] >> kShift);
    hash = (hash ^ cell[k]) * 0x9E3779B97F4A7C15ull;
  }
  Entry& entry = entries_[hash >> 50];
  static_assert(kEntries == 1u << (64 - 50));
  if (entry.cell != cell) entry = {cell, nullptr};
  return entry;
}

void PointOctree::insert(Growing* node, Place place, ByteView record) {
  while (true) {
    if (node->state == Growing::State::Leaf) {
      put(*node, record);
      if (node->level == kDeepest) {
        if (node->total() >= kDeepestNodes * node_bytes_) give(*node);
      } else if (node->total() >= node_bytes_) {
        split(*node);
      }
      return;
    }
    if (node->state == Growing::State::Inner && take_cell(*node, place)) {
      put(*node, record);
      if (node->bytes >= node_bytes_) give(*node);
      return;
    }
    if (node->level == kDeepest) {  // there is no place below: take the next cube
      place[0] += 1u << (kLevels - kDeepest);
      node = nodes_.front().get();
      continue;
    }
    node = child_of(*node, place);
    if (node->level == kEntry) entry_of(place).node = node;
  }
}

/// Adds whole records.
void PointOctree::put(Growing& node, ByteView records) {
  const std::size_t block_bytes = kBlockRecords * config_.record_size;
  for (; !records.empty(); records = records.subspan(config_.record_size)) {
    const std::size_t used = node.bytes % block_bytes;
    if (used == 0) {
      if (free_ == nullptr) {
        const std::size_t size = (sizeof(Block) + block_bytes + alignof(Block) - 1) / alignof(Block) * alignof(Block);
        std::byte* const slab = slabs_.emplace_back(std::make_unique<std::byte[]>(size * kSlabBlocks)).get();
        for (std::size_t i = 0; i < kSlabBlocks; ++i) free_ = new (slab + i * size) Block{free_};
      }
      Block* const block = std::exchange(free_, free_->next);
      block->next = nullptr;
      (node.first ? node.newest->next : node.first) = block;
      node.newest = block;
      held_bytes_ += block_bytes;
    }
    std::memcpy(node.newest->data() + used, records.data(), config_.record_size);
    node.bytes += config_.record_size;
  }
  node.last = number_;
}

/// Takes the records out of the node's blocks.
Bytes PointOctree::take_held(Growing& node) {
  const std::size_t block_bytes = kBlockRecords * config_.record_size;
  Bytes out(std::exchange(node.bytes, 0));
  std::size_t at = 0;
  for (Block* block = std::exchange(node.first, nullptr); block != nullptr;) {
    const std::size_t size = std::min(block_bytes, out.size() - at);
    std::memcpy(out.data() + at, block->data(), size);
    at += size;
    held_bytes_ -= block_bytes;
    Block* const next = block->next;
    block->next = std::exchange(free_, block);
    block = next;
  }
  node.newest = nullptr;
  return out;
}

void PointOctree::drop_grid(Growing& node) {
  if (node.grid) held_bytes_ -= node.grid->bytes();
  node.grid.reset();
}

/// Takes the records out of the node, those in the scratch file too.
Bytes PointOctree::take_records(Growing& node) {
  Bytes held = take_held(node);
  if (node.spilled.empty()) return held;
  Bytes all(std::exchange(node.spilled_bytes, 0));
  std::size_t at = 0;
  for (const auto& [offset, bytes] : std::exchange(node.spilled, {})) {
    if (Status read = scratch_->read(offset, std::span(all).subspan(at, static_cast<std::size_t>(bytes)));
        !read && !error_)
      error_ = read.error();
    at += static_cast<std::size_t>(bytes);
  }
  append(all, held);
  return all;
}

PointOctree::Growing* PointOctree::child_of(Growing& node, const Place& place) {
  const unsigned bit = kLevels - node.level - 1;
  std::size_t octant = 0;
  for (std::size_t k = 0; k < 3; ++k) octant |= static_cast<std::size_t>(place[k] >> bit & 1) << k;
  Growing*& child = node.children[octant];
  if (child == nullptr) {
    nodes_.push_back(std::make_unique<Growing>());
    child = nodes_.back().get();
    child->level = static_cast<std::uint8_t>(node.level + 1);
    for (std::size_t k = 0; k < 3; ++k) child->cell[k] = place[k] >> bit;
    child->above = &node;
    child->index = static_cast<std::uint32_t>(nodes_.size() - 1);
  }
  return child;
}

bool PointOctree::take_cell(Growing& node, const Place& place) {
  const unsigned edge_bits = kLevels - node.level;
  const unsigned shift = edge_bits > kGridBits ? edge_bits - kGridBits : 0;
  std::uint32_t cell = 0;
  for (const std::uint64_t p : place)
    cell = cell << kGridBits | (static_cast<std::uint32_t>(p >> shift) & ((1u << kGridBits) - 1));
  held_bytes_ -= node.grid->bytes();
  const bool is_free = node.grid->take(cell);
  held_bytes_ += node.grid->bytes();
  return is_free;
}

/// Returns the place that is nearest to the given one in the node: a point may have come here from beside it.
PointOctree::Place PointOctree::inside(const Growing& node, Place place) {
  const unsigned edge_bits = kLevels - node.level;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint64_t low = node.cell[k] << edge_bits;
    place[k] = std::clamp(place[k], low, low + (std::uint64_t{1} << edge_bits) - 1);
  }
  return place;
}

/// Makes a full node without children an inner one: what finds a free cell of the grid stays, the rest goes down.
void PointOctree::split(Growing& node) {
  const Bytes all = take_records(node);
  node.state = Growing::State::Inner;
  node.grid = std::make_unique<Grid>();
  held_bytes_ += node.grid->bytes();
  for (std::size_t i = 0; i < all.size(); i += config_.record_size) {
    const ByteView record = ByteView(all).subspan(i, config_.record_size);
    const Place place = inside(node, place_of(record));
    if (take_cell(node, place))
      put(node, record);
    else
      insert(child_of(node, place), place, record);
  }
}

void PointOctree::give(Growing& node) {
  node.state = Growing::State::Given;
  drop_grid(node);
  Bytes records = take_records(node);
  if (records.empty()) return;
  node.given = given_count_++;
  given_.push_back(std::move(records));
}

/// Moves the records of a small node to the scratch file.
void PointOctree::spill(Growing& node) {
  const Bytes records = take_held(node);
  if (records.empty() || error_) return;
  if (!scratch_) {
    auto made = ScratchFile::create(config_.scratch);
    if (made)
      scratch_ = std::move(*made);
    else
      error_ = made.error();
  }
  if (error_) return;
  const Result<std::uint64_t> offset = scratch_->append(records);
  if (!offset) {
    error_ = offset.error();
    return;
  }
  node.spilled.push_back({*offset, records.size()});
  node.spilled_bytes += records.size();
}

/// Joins a small node without children with the node above, if there is room. It stays open: points may still come.
bool PointOctree::join(Growing& node) {
  Growing* const above = node.above;
  if (node.state != Growing::State::Leaf || node.total() >= node_bytes_ / kSmallShare || above == nullptr ||
      !above->is_open() || above->bytes + node.total() > 2 * node_bytes_)
    return false;
  const std::uint64_t last = above->last;
  put(*above, take_records(node));
  above->last = last;
  return true;
}

/// Lets nodes go until there is room. A node is worth its points times how long ago the newest one came, so those go
/// first that are full and that the vehicle has left.
void PointOctree::make_room() {
  struct Worth {
    double value;
    Growing* node;
  };
  const std::uint64_t enough = config_.held_bytes / 4 * 3;
  while (held_bytes_ > enough) {
    std::vector<Worth> open;
    for (const auto& node : nodes_) {
      const std::size_t least = node->state == Growing::State::Inner ? node_bytes_ / kFewShare : 1;
      if (node->is_open() && node->bytes >= least)
        open.push_back({static_cast<double>(node->bytes) * static_cast<double>(number_ - node->last + 1), node.get()});
    }
    if (open.empty()) return;
    std::sort(open.begin(), open.end(), [](const Worth& a, const Worth& b) {
      return a.value != b.value ? a.value > b.value : a.node->index < b.node->index;
    });
    for (const auto& [value, node] : open) {
      if (held_bytes_ <= enough) return;
      if (join(*node)) continue;
      if (node->state == Growing::State::Leaf && node->total() < node_bytes_ / kSmallShare)
        spill(*node);
      else
        give(*node);
    }
  }
}

/// Finds the smallest cube with all points that can be the root. The few points of the cubes above it become its own.
void PointOctree::find_root() {
  while (root_->level < kDeepest && !root_->given) {
    const unsigned bit = kLevels - root_->level - 1;
    std::size_t octant = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (lowest_[k] >> bit != highest_[k] >> bit) return;
      octant |= static_cast<std::size_t>(lowest_[k] >> bit & 1) << k;
    }
    if (root_->state == Growing::State::Leaf) {  // it has nothing below it and may become smaller
      ++root_->level;
      for (std::size_t k = 0; k < 3; ++k) root_->cell[k] = lowest_[k] >> bit;
      continue;
    }
    Growing* const child = root_->children[octant];
    if (child == nullptr || (!child->is_open() && root_->bytes > 0)) return;
    if (Bytes records = take_records(*root_); !records.empty()) put(*child, records);
    drop_grid(*root_);
    root_ = child;
  }
}

Result<bool> PointOctree::finish_some() {
  constexpr std::size_t kAtOnce = 64;
  if (!left_) {
    find_root();
    left_.emplace();
    for (const auto& node : nodes_)
      if (node->is_open() && node->level >= root_->level) left_->push_back(node.get());
    std::stable_sort(left_->begin(), left_->end(),
                     [](const Growing* a, const Growing* b) { return a->level < b->level; });
  }
  for (std::size_t i = 0; i < kAtOnce && !left_->empty() && !error_; ++i) {
    Growing* const node = left_->back();  // the deepest first, because they may join those above
    left_->pop_back();
    if (node == root_ || !join(*node)) give(*node);
  }
  if (error_) return *error_;
  return !left_->empty();
}

std::vector<PointOctree::Node> PointOctree::nodes() const {
  std::vector<bool> is_needed(nodes_.size());
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    if (!nodes_[i]->given && !is_needed[i]) continue;
    is_needed[i] = true;
    if (const Growing* above = nodes_[i]->above) is_needed[above->index] = true;
  }
  std::vector<Node> out;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Growing& node = *nodes_[i];
    if (!is_needed[i] || node.level < root_->level) continue;
    const unsigned down = node.level - root_->level;
    const auto relative = [&](std::size_t k) {
      return static_cast<std::uint32_t>(node.cell[k] - (root_->cell[k] << down));
    };
    out.push_back({{down, relative(0), relative(1), relative(2)}, node.given});
  }
  std::sort(out.begin(), out.end(), [](const Node& a, const Node& b) { return a.key < b.key; });
  return out;
}

PointOctree::Cube PointOctree::cube() const {
  Cube cube;
  cube.step = step_;
  cube.edge = std::int64_t{1} << (kLevels - root_->level);
  for (std::size_t k = 0; k < 3; ++k)
    cube.low[k] = static_cast<std::int64_t>(root_->cell[k]) * cube.edge - static_cast<std::int64_t>(shift_[k]);
  return cube;
}

}  // namespace hueline::storage
