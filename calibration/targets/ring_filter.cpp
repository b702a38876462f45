#include "calibration/targets/ring_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>

#include "calibration/targets/ring_kernel.hpp"

namespace hueline::calibration {

RingFilter::RingFilter(std::span<const Ring> rings) {
  std::vector<Ring> sorted(rings.begin(), rings.end());
  std::ranges::sort(sorted, {}, &Ring::inner);
  for (const Ring& ring : sorted) {
    const double inner = std::max(0.0, ring.inner);
    const auto from = static_cast<float>(inner * inner), to = static_cast<float>(ring.outer * ring.outer);
    if (!squared_.empty() && from <= squared_.back().second)
      squared_.back().second = std::max(squared_.back().second, to);
    else
      squared_.emplace_back(from, to);
  }
}

void RingFilter::keep(std::span<const float> xyz, std::vector<Eigen::Vector3f>& kept, float& farthest_squared) const {
  if (squared_.empty()) return;
  keep_in_rings(xyz.data(), xyz.size() / 3, squared_.data(), squared_.size(), kept, farthest_squared);
}

Result<RingPoints> read_rings(const ScanBlocks& scan, std::span<const Ring> rings, unsigned threads,
                              std::size_t most_points) {
  const RingFilter filter(rings);
  const std::size_t blocks = scan.blocks();
  /// The kept points of one block in the store of the thread that read it.
  struct Piece {
    std::size_t block, begin, count;
  };
  struct Store {
    std::vector<Eigen::Vector3f> points;
    std::vector<Piece> pieces;
    std::uint64_t points_read = 0;
    float farthest_squared = 0;
  };
  std::vector<Store> stores(std::clamp<std::size_t>(threads, 1, std::max<std::size_t>(blocks, 1)));
  std::atomic<std::size_t> next{0}, kept{0};
  std::mutex mutex;
  std::optional<std::pair<std::size_t, Error>>
      first_error;  // the error of the earliest block, so that it does not depend on threads
  const auto fail = [&](std::size_t block, Error error) {
    std::lock_guard lock(mutex);
    if (!first_error || block < first_error->first) first_error.emplace(block, std::move(error));
    next = blocks;
  };
  const auto work = [&](Store& store) {
    std::vector<std::byte> scratch;
    for (std::size_t block = next++; block < blocks; block = next++) {
      const auto xyz = scan.block(block, scratch);
      if (!xyz.ok()) return fail(block, xyz.error());
      const std::size_t before = store.points.size();
      filter.keep(*xyz, store.points, store.farthest_squared);
      store.points_read += xyz->size() / 3;
      const std::size_t added = store.points.size() - before;
      if (added) store.pieces.push_back({block, before, added});
      if (kept.fetch_add(added) + added > most_points)
        return fail(
            block,
            {ErrorCode::Exhausted,
             fmt::format("more than {} points lie at the targets' distances: give a narrower ring or fewer targets",
                         most_points)});
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t i = 1; i < stores.size(); ++i) helpers.emplace_back([&, i] { work(stores[i]); });
    work(stores[0]);
  }
  if (first_error) return first_error->second;

  RingPoints out;
  struct Part {
    Piece piece;
    const Store* store;
  };
  std::vector<Part> parts;
  float farthest = 0;
  for (const Store& store : stores) {
    for (const Piece& piece : store.pieces) parts.push_back({piece, &store});
    out.points_read += store.points_read;
    farthest = std::max(farthest, store.farthest_squared);
  }
  std::ranges::sort(parts, {}, [](const Part& part) { return part.piece.block; });
  out.points_scanner.reserve(kept);
  for (const Part& part : parts) {
    const auto begin = part.store->points.begin() + static_cast<std::ptrdiff_t>(part.piece.begin);
    out.points_scanner.insert(out.points_scanner.end(), begin, begin + static_cast<std::ptrdiff_t>(part.piece.count));
  }
  out.farthest_m = std::sqrt(static_cast<double>(farthest));
  return out;
}

}  // namespace hueline::calibration
