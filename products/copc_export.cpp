#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "products/cloud_export.hpp"
#include "products/laz_file.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {
namespace {

using storage::append;
using storage::Bytes;
using storage::LasPoint;
using storage::LasReader;

constexpr std::uint32_t kDeepest = 20;         // levels below the root: 3 x 20 bits fit into a code
constexpr std::size_t kMostCells = 4'000'000;  // that are counted; with more, two levels of cells become one
constexpr std::uint32_t kPageLevels = 5;       // of the octree in one page of the hierarchy
constexpr std::size_t kInfoSize = 160;
constexpr std::size_t kEvlrHead = 60;

/// A place in the octree: level, and x, y, z counted in nodes of that level.
struct NodeKey {
  std::uint32_t level = 0, x = 0, y = 0, z = 0;
  auto operator<=>(const NodeKey&) const = default;
};
NodeKey parent(const NodeKey& key, std::uint32_t level) {
  const std::uint32_t up = key.level - level;
  return {level, key.x >> up, key.y >> up, key.z >> up};
}

/// The cube of the octree.
class Cube {
 public:
  explicit Cube(const storage::LasHeader& header) : scale_(header.scale) {
    for (std::size_t k = 0; k < 3; ++k) {
      low_[k] = header.minimum[k];
      shift_[k] = header.offset[k] - header.minimum[k];
      // The edge is a step longer than the extent, so that the greatest coordinate lies inside.
      edge_ = std::max(edge_, header.maximum[k] - header.minimum[k] + header.scale[k]);
    }
  }
  /// Returns the code of a record's cell at the deepest level: the bits of x, y, z by turns, the highest first. A point
  /// outside the bounds of the header is counted to the nearest cell.
  std::uint64_t code(storage::ByteView record) const {
    constexpr double kCells = 1u << kDeepest;
    std::uint64_t code = 0;
    std::array<std::uint64_t, 3> cell;
    for (std::size_t k = 0; k < 3; ++k) {
      std::int32_t value;
      std::memcpy(&value, record.data() + 4 * k, sizeof value);
      cell[k] =
          static_cast<std::uint64_t>(std::clamp((value * scale_[k] + shift_[k]) / edge_ * kCells, 0.0, kCells - 1));
    }
    for (std::uint32_t bit = kDeepest; bit-- > 0;)
      for (const std::uint64_t c : cell) code = code << 1 | (c >> bit & 1);
    return code;
  }
  double edge() const { return edge_; }
  double centre(std::size_t axis) const { return low_[axis] + edge_ / 2; }

 private:
  std::array<double, 3> scale_, low_{}, shift_{};
  double edge_ = 0;
};

/// How many points are in each cell that has any, sorted by code. The cells become larger when there are too many.
class CellCounts {
 public:
  void add(std::uint64_t code) {
    pending_.push_back(code >> shift_);
    if (pending_.size() >= kPending) settle();
  }
  /// To be called after the last point.
  void settle() {
    std::sort(pending_.begin(), pending_.end());
    std::vector<Cell> merged;
    auto old = cells_.begin();
    for (std::size_t i = 0; i < pending_.size();) {
      std::size_t end = i;
      while (end < pending_.size() && pending_[end] == pending_[i]) ++end;
      while (old != cells_.end() && old->code < pending_[i]) merged.push_back(*old++);
      merged.push_back({pending_[i], end - i});
      if (old != cells_.end() && old->code == pending_[i]) merged.back().points += old++->points;
      i = end;
    }
    merged.insert(merged.end(), old, cells_.end());
    pending_.clear();
    cells_ = std::move(merged);
    while (cells_.size() > kMostCells) coarsen();
  }
  struct Cell {
    std::uint64_t code = 0, points = 0;
  };
  const std::vector<Cell>& cells() const { return cells_; }
  /// Level of the cells.
  std::uint32_t level() const { return kDeepest - shift_ / 3; }

 private:
  static constexpr std::size_t kPending = 2'000'000;
  void coarsen() {
    shift_ += 3;
    std::size_t kept = 0;
    for (const Cell& cell : cells_) {
      if (kept > 0 && cells_[kept - 1].code == cell.code >> 3)
        cells_[kept - 1].points += cell.points;
      else
        cells_[kept++] = {cell.code >> 3, cell.points};
    }
    cells_.resize(kept);
  }
  std::uint32_t shift_ = 0;
  std::vector<std::uint64_t> pending_;
  std::vector<Cell> cells_;
};

/// The octree: which share of the points that come to a node stays there.
class Octree {
 public:
  Octree(const CellCounts& counts, std::uint32_t node_points) {
    // One level after the other, so that the nodes stand by level and code. `left`: the share of the points that no
    // node above keeps.
    struct Part {
      std::size_t begin, end, node;
      double left;
    };
    const auto& cells = counts.cells();
    std::vector<Part> level_parts;
    if (!cells.empty()) {
      nodes_.push_back({});
      level_parts.push_back({0, cells.size(), 0, 1.0});
    }
    for (std::uint32_t level = 0; !level_parts.empty(); ++level) {
      std::vector<Part> next;
      for (const Part& part : level_parts) {
        double points = 0;
        for (std::size_t i = part.begin; i < part.end; ++i) points += static_cast<double>(cells[i].points);
        const double come = points * part.left;
        // A little more than the limit may stay, so that no child gets a handful of points.
        if (come <= 1.2 * node_points || level == counts.level()) continue;
        const double stays = node_points / come;
        nodes_[part.node].stays = static_cast<std::uint64_t>(stays * 0x1p53);
        const std::uint32_t shift = 3 * (counts.level() - level - 1);
        for (std::size_t i = part.begin; i < part.end;) {
          std::size_t end = i;
          while (end < part.end && cells[end].code >> shift == cells[i].code >> shift) ++end;
          const auto octant = static_cast<std::size_t>(cells[i].code >> shift & 7);
          nodes_[part.node].children[octant] = nodes_.size();
          const NodeKey& up = nodes_[part.node].key;
          const auto bit = [octant](unsigned k) { return static_cast<std::uint32_t>(octant >> k & 1); };
          next.push_back({i, end, nodes_.size(), part.left * (1 - stays)});
          nodes_.push_back({{level + 1, up.x * 2 + bit(2), up.y * 2 + bit(1), up.z * 2 + bit(0)}});
          i = end;
        }
      }
      level_parts = std::move(next);
    }
  }

  /// Returns the node that keeps a point. `number` is the point's number in the cloud.
  std::size_t node_of(std::uint64_t code, std::uint64_t number) const {
    std::size_t node = 0;
    for (std::uint32_t shift = 3 * kDeepest; nodes_[node].stays < kAll;) {
      number = mix(number);
      if (number >> 11 < nodes_[node].stays) break;
      shift -= 3;
      node = nodes_[node].children[code >> shift & 7];
    }
    return node;
  }
  std::size_t size() const { return nodes_.size(); }
  const NodeKey& key(std::size_t node) const { return nodes_[node].key; }

 private:
  static constexpr std::uint64_t kAll = 1ull << 53;
  /// A step of SplitMix64 (Steele, Lea, Flood 2014).
  static std::uint64_t mix(std::uint64_t value) {
    value += 0x9E3779B97F4A7C15ull;
    value = (value ^ value >> 30) * 0xBF58476D1CE4E5B9ull;
    value = (value ^ value >> 27) * 0x94D049BB133111EBull;
    return value ^ value >> 31;
  }
  struct Node {
    NodeKey key;
    std::uint64_t stays = kAll;  // of 2^53
    std::array<std::size_t, 8> children{};
  };
  std::vector<Node> nodes_;
};

/// Calls `take` with each point of the cloud and its number. Returns whether the cloud was cut; then all whole points
/// were taken.
template <class Take>
Result<bool> for_each_point(LasReader& reader, const Take& take) {
  reader.rewind();
  std::uint64_t number = 0;
  for (std::vector<LasPoint> points;;) {
    const Status read = reader.next(points);
    if (!read && read.error().code != ErrorCode::Truncated) return read.error();
    if (points.empty()) return !read.ok();
    for (const LasPoint& point : points) take(point, number++);
  }
}

/// The data of the record "copc" 1.
std::string info_record(const Cube& cube, double spacing, std::uint64_t page_offset, std::uint64_t page_size,
                        double first_time, double last_time) {
  Bytes out;
  for (std::size_t k = 0; k < 3; ++k) append(out, cube.centre(k));
  append(out, cube.edge() / 2);
  append(out, spacing);
  append(out, page_offset), append(out, page_size);
  append(out, first_time), append(out, last_time);
  out.resize(kInfoSize);
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}

/// Returns the pages of the hierarchy, the root's first, as they stand in the file from `offset` on, and the size of
/// the first one.
std::pair<Bytes, std::uint64_t> hierarchy(const Octree& tree, const std::vector<LazFile::Place>& places,
                                          std::uint64_t offset) {
  struct Entry {
    NodeKey key;
    std::uint64_t offset;
    std::int32_t bytes, points;
  };
  std::map<NodeKey, std::vector<Entry>> pages;  // by their first node
  const auto page_of = [](const NodeKey& key) { return parent(key, key.level / kPageLevels * kPageLevels); };
  for (std::size_t node = 0; node < places.size(); ++node) {
    const auto& [at, size] = places[node];
    const NodeKey& key = tree.key(node);
    pages[page_of(key)].push_back(
        {key, at, static_cast<std::int32_t>(size.bytes), static_cast<std::int32_t>(size.points)});
    if (key.level > 0 && key.level % kPageLevels == 0)  // this node begins a page: the page above leads to it
      pages[page_of(parent(key, key.level - 1))].push_back({key, 0, 0, -1});
  }
  std::map<NodeKey, std::pair<std::uint64_t, std::int32_t>> where;
  std::uint64_t at = offset;
  for (const auto& [key, entries] : pages) {
    const std::uint64_t size = 32 * entries.size();
    where[key] = {at, static_cast<std::int32_t>(size)};
    at += size;
  }
  Bytes out;
  for (const auto& [first, entries] : pages)
    for (Entry entry : entries) {
      if (entry.points < 0) std::tie(entry.offset, entry.bytes) = where[entry.key];
      for (const std::uint32_t v : {entry.key.level, entry.key.x, entry.key.y, entry.key.z}) append(out, v);
      append(out, entry.offset);
      append(out, entry.bytes);
      append(out, entry.points);
    }
  const std::uint64_t first = pages.empty() ? 0 : 32 * pages.begin()->second.size();
  return {std::move(out), first};
}

}  // namespace

Result<ExportedCloud> export_copc(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                  const CloudExport& options) {
  auto reader = LasReader::open(cloud);
  if (!reader) return reader.error();
  const Cube cube(reader->header());

  // First all points are counted, then the octree is made of the counts, then its nodes are filled, as many at once as
  // the memory holds.
  CellCounts counts;
  storage::LasHeader header = reader->header();
  header.point_count = 0;
  header.points_by_return = {};
  double first_time = std::numeric_limits<double>::max(), last_time = std::numeric_limits<double>::lowest();
  const Result<bool> was_cut = for_each_point(*reader, [&](const LasPoint& point, std::uint64_t) {
    counts.add(cube.code(point.record));
    ++header.point_count;
    if (point.return_number >= 1) ++header.points_by_return[point.return_number - 1u];
    first_time = std::min(first_time, point.time.value_or(0));
    last_time = std::max(last_time, point.time.value_or(0));
  });
  if (!was_cut) return was_cut.error();
  if (header.point_count == 0)
    return Error{ErrorCode::Invalid, cloud.string() + " has no points: there is nothing to export"};
  counts.settle();
  const Octree tree(counts, options.node_points);

  std::vector<storage::LasVlr> records = lasting_records(reader->records());
  records.insert(records.begin(), {"copc", 1, "COPC info", std::string(kInfoSize, '\0')});
  auto file = LazFile::create(out, header, records, storage::kLazVariableChunks, options.threads);
  if (!file) return file.error();

  std::vector<std::uint64_t> sizes(tree.size());
  if (auto read = for_each_point(
          *reader,
          [&](const LasPoint& point, std::uint64_t number) { ++sizes[tree.node_of(cube.code(point.record), number)]; });
      !read)
    return read.error();
  std::vector<std::size_t> filled;  // the nodes that got points, as the chunks of the file
  for (std::size_t begin = 0; begin < tree.size();) {
    std::size_t end = begin;
    std::uint64_t held = 0;
    while (end < tree.size() && (end == begin || held + sizes[end] <= options.held_points)) held += sizes[end++];
    std::vector<Bytes> nodes(end - begin);
    for (std::size_t node = begin; node < end; ++node)
      nodes[node - begin].reserve(static_cast<std::size_t>(sizes[node]) * header.point_size);
    auto read = for_each_point(*reader, [&](const LasPoint& point, std::uint64_t number) {
      const std::size_t node = tree.node_of(cube.code(point.record), number);
      if (node >= begin && node < end) append(nodes[node - begin], point.record);
    });
    if (!read) return read.error();
    for (std::size_t node = begin; node < end; ++node) {
      if (sizes[node] == 0) continue;  // by chance; the hierarchy has it all the same, for its children
      if (Status added = file->add(std::move(nodes[node - begin])); !added) return added.error();
      filled.push_back(node);
    }
    begin = end;
  }
  if (Status ended = file->end_chunks(); !ended) return ended.error();

  std::vector<LazFile::Place> places(tree.size());
  for (std::size_t i = 0; i < filled.size(); ++i) places[filled[i]] = file->places()[i];
  Bytes evlr;
  const std::uint64_t evlr_at = file->size();
  const auto [pages, first_page] = hierarchy(tree, places, evlr_at + kEvlrHead);
  storage::append_evlr_head(evlr, "copc", 1000, "EPT hierarchy", pages.size());
  append(evlr, pages);
  if (Status written = file->append(evlr); !written) return written.error();
  file->header().evlr_offset = evlr_at;
  file->header().evlr_count = 1;
  const std::string info = info_record(cube, cube.edge() / std::sqrt(options.node_points), evlr_at + kEvlrHead,
                                       first_page, first_time, last_time);
  if (Status written = file->overwrite(storage::kLasHeaderSize14 + storage::kLasVlrHead, storage::as_bytes(info));
      !written)
    return written.error();
  ExportedCloud done{header.point_count, file->size(), file->places().size(), *was_cut};
  if (Status closed = file->close(); !closed) return closed.error();
  return done;
}

}  // namespace hueline::products
