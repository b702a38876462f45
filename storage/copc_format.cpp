#include "storage/copc_format.hpp"

#include <map>
#include <tuple>

namespace hueline::storage {
namespace {

constexpr std::uint32_t kPageLevels = 5;  // of the octree in one page of the hierarchy
constexpr double kGridCells = 128;        // of an edge: the distance between points of the root is that of its grid

OctreeKey ancestor(const OctreeKey& key, std::uint32_t level) {
  const std::uint32_t up = key.level - level;
  return {level, key.x >> up, key.y >> up, key.z >> up};
}

}  // namespace

CopcHierarchy encode_copc_hierarchy(const std::vector<PointOctree::Node>& nodes, std::span<const LazPlace> places,
                                    std::uint64_t offset) {
  struct Entry {
    OctreeKey key;
    std::uint64_t offset;
    std::int32_t bytes, points;
  };
  std::map<OctreeKey, std::vector<Entry>> pages;  // by their first node
  const auto page_of = [](const OctreeKey& key) { return ancestor(key, key.level / kPageLevels * kPageLevels); };
  for (const auto& [key, given] : nodes) {
    const LazPlace place = given ? places[*given] : LazPlace{};
    pages[page_of(key)].push_back(
        {key, place.offset, static_cast<std::int32_t>(place.size.bytes), static_cast<std::int32_t>(place.size.points)});
    if (key.level > 0 && key.level % kPageLevels == 0)  // this node begins a page: the page above leads to it
      pages[page_of(ancestor(key, key.level - 1))].push_back({key, 0, 0, -1});
  }
  std::map<OctreeKey, std::pair<std::uint64_t, std::int32_t>> where;
  std::uint64_t size = 0;
  for (const auto& [key, entries] : pages) {
    const std::uint64_t bytes = 32 * entries.size();
    where[key] = {offset + kLasEvlrHead + size, static_cast<std::int32_t>(bytes)};
    size += bytes;
  }
  CopcHierarchy out;
  append_evlr_head(out.record, "copc", 1000, "EPT hierarchy", size);
  for (const auto& [first, entries] : pages)
    for (Entry entry : entries) {
      if (entry.points < 0) std::tie(entry.offset, entry.bytes) = where[entry.key];
      for (const std::uint32_t v : {entry.key.level, entry.key.x, entry.key.y, entry.key.z}) append(out.record, v);
      append(out.record, entry.offset);
      append(out.record, entry.bytes);
      append(out.record, entry.points);
    }
  out.root_offset = offset + kLasEvlrHead;
  out.root_size = pages.empty() ? 0 : 32 * pages.begin()->second.size();
  return out;
}

LasVlr copc_info_vlr() { return {"copc", 1, "COPC info", std::string(kCopcInfoSize, '\0')}; }

Bytes encode_copc_info(const PointOctree::Cube& cube, const LasHeader& header, const CopcHierarchy& hierarchy,
                       std::pair<double, double> times) {
  Bytes out;
  const double edge = static_cast<double>(cube.edge) * cube.step;
  for (std::size_t k = 0; k < 3; ++k)
    append(out, header.offset[k] + static_cast<double>(cube.low[k]) * cube.step + edge / 2);
  append(out, edge / 2);
  append(out, edge / kGridCells);
  append(out, hierarchy.root_offset), append(out, hierarchy.root_size);
  append(out, times.first), append(out, times.second);
  out.resize(kCopcInfoSize);
  return out;
}

}  // namespace hueline::storage
