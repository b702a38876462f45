#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "storage/las_format.hpp"
#include "storage/laz_chunk.hpp"
#include "storage/point_octree.hpp"

/// What a COPC file (COPC 1.0, copc.io) has besides a LAZ file: the record that describes the octree, and the hierarchy
/// that says where each node is.
namespace hueline::storage {

constexpr std::size_t kCopcInfoSize = 160;
/// Where the data of the record are: it is the first one of the file.
constexpr std::uint64_t kCopcInfoPlace = kLasHeaderSize14 + kLasVlrHead;

/// Where a chunk of points is in the file.
struct LazPlace {
  std::uint64_t offset = 0;
  LazChunkSize size;
};

/// The extended record with the hierarchy, and what the record of the octree says about it.
struct CopcHierarchy {
  Bytes record;
  std::uint64_t root_offset = 0, root_size = 0;  ///< the page that begins with the root, in the file
};
/// Returns the hierarchy, which is to stand at `offset`. `places` are those of the nodes in the order of
/// PointOctree::Node::given.
CopcHierarchy encode_copc_hierarchy(const std::vector<PointOctree::Node>& nodes, std::span<const LazPlace> places,
                                    std::uint64_t offset);

/// Returns the record "copc" 1 with empty data, as it stands in a file that is not finished.
LasVlr copc_info_vlr();
/// Returns its data. `header` gives the offsets of the coordinates, `times` the first and the last GPS time.
Bytes encode_copc_info(const PointOctree::Cube& cube, const LasHeader& header, const CopcHierarchy& hierarchy,
                       std::pair<double, double> times);

}  // namespace hueline::storage
