#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/scratch_file.hpp"
#include "storage/byte_order.hpp"

namespace hueline::storage {

/// A place in an octree: the level below the root, and x, y, z counted in nodes of that level.
struct OctreeKey {
  std::uint32_t level = 0, x = 0, y = 0, z = 0;
  auto operator<=>(const OctreeKey&) const = default;
};

/// Sorts the point records of a LAS file into an octree while they come, in bounded memory: each node is given away
/// when it is full, or when its memory is needed and no point has come to it for the longest. A node with children
/// holds points that are about 1/128 of its edge apart, one in each cell of a grid, so each level is an even sample of
/// the cloud. The rest is in its children. Points that come to a node that was given away go to its children, so a
/// vehicle may return to a place after any time. Small nodes whose memory is needed wait in a scratch file, so that a
/// street that is driven a hundred times does not become a million nodes.
///
/// Each record is in exactly one node, whose cube contains it. (Where millions of points have the same few millimetres,
/// the cube is one up to a few millimetres beside it.) The same records give the same nodes. How large the octree is,
/// and which cube is its root, is known at the end only, so the cubes are those of a fixed lattice until then.
/// Thread safety: none; one thread calls all functions.
class PointOctree {
 public:
  struct Config {
    std::array<double, 3> scale{1, 1, 1};   ///< of the records' coordinates
    std::size_t record_size = 36;           ///< bytes of a record, at least 12: it begins with x, y, z as int32
    std::uint32_t node_points = 65'536;     ///< points with which a node is full, at least 1
    std::uint64_t held_bytes = 256u << 20;  ///< memory for the points of nodes that are not full; changes the nodes
    std::filesystem::path scratch;          ///< folder of the scratch file, which exists only if it is needed
  };
  /// A node of the finished octree.
  struct Node {
    OctreeKey key;
    std::optional<std::size_t> given;  ///< as how many-th it was given away, from 0; none: it has no points of its own
  };
  /// The cube of the root, in steps of the greatest scale.
  struct Cube {
    std::array<std::int64_t, 3> low{};
    std::int64_t edge = 1;
    double step = 1;  ///< in the unit of the scales
  };

  explicit PointOctree(const Config& config);
  PointOctree(PointOctree&&) noexcept;
  PointOctree& operator=(PointOctree&&) noexcept;
  ~PointOctree();

  /// Adds a record. The caller calls take() after it, or after some of them. Errors: those of the scratch file, which
  /// every later call returns too.
  Status add(ByteView record);
  /// Gives away the next of the nodes that are left, and returns whether there are more. After it no record may be
  /// added. Errors: as add().
  Result<bool> finish_some();
  /// Returns the records of the nodes that were given away since the last call, in the order of Node::given.
  std::vector<Bytes> take() { return std::exchange(given_, {}); }
  /// Returns the memory of the points that are not given away, bytes; after add() at most Config::held_bytes.
  std::uint64_t held_bytes() const { return held_bytes_; }
  /// Returns the nodes of the finished octree by level, the root first: those with points, and those above them.
  std::vector<Node> nodes() const;
  /// Returns the cube of the finished octree.
  Cube cube() const;

 private:
  static constexpr unsigned kLevels = 33;   // the lattice's greatest cube has an edge of 2^33 steps
  static constexpr unsigned kDeepest = 31;  // the level of the smallest nodes, of 4 steps
  static constexpr unsigned kGridBits = 7;
  static constexpr unsigned kEntry = 16;       // the level at which the way of most points begins
  using Place = std::array<std::uint64_t, 3>;  // in the lattice, in steps
  struct Block;
  class Grid;
  struct Growing;
  struct Entry {
    std::array<std::uint32_t, 3> cell{};
    Growing* node = nullptr;
  };

  Place place_of(ByteView record) const;
  void begin_lattice(ByteView record);
  Entry& entry_of(const Place& place);
  void insert(Growing* node, Place place, ByteView record);
  void put(Growing& node, ByteView records);
  void drop_grid(Growing& node);
  Bytes take_held(Growing& node);
  Bytes take_records(Growing& node);
  Growing* child_of(Growing& node, const Place& place);
  bool take_cell(Growing& node, const Place& place);
  static Place inside(const Growing& node, Place place);
  void split(Growing& node);
  void give(Growing& node);
  void spill(Growing& node);
  bool join(Growing& node);
  void make_room();
  void find_root();
  Status status() const { return error_ ? Status(*error_) : Status(); }

  Config config_;
  std::size_t node_bytes_;
  std::array<double, 3> ratio_{};  // of the scales to the greatest
  double step_ = 1;
  Place shift_{};                                    // lattice = coordinate + shift
  std::vector<std::unique_ptr<std::byte[]>> slabs_;  // the memory of all blocks
  Block* free_ = nullptr;                            // blocks that no node has
  std::vector<std::unique_ptr<Growing>> nodes_;      // a node stands behind the one above it
  std::vector<Entry> entries_;
  std::vector<Bytes> given_;
  std::size_t given_count_ = 0;
  std::uint64_t held_bytes_ = 0, number_ = 0;
  Place lowest_{}, highest_{};
  Growing* root_ = nullptr;
  std::optional<ScratchFile> scratch_;
  std::optional<Error> error_;
  std::optional<std::vector<Growing*>> left_;  // while the octree is being finished: what is not given away yet
};

}  // namespace hueline::storage
