#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/coloured_point.hpp"

namespace hueline::products {

/// Whether a point lies on something that moves by itself, more likely than not.
inline bool is_moving(const ColouredPoint& point) { return point.moving >= 128; }

/// The finaliser of MurmurHash3 by Appleby: neighbouring numbers give unrelated ones.
constexpr std::uint64_t mixed_bits(std::uint64_t n) {
  n = (n ^ (n >> 33)) * 0xff51afd7ed558ccdu;
  n = (n ^ (n >> 33)) * 0xc4ceb9fe1a85ec53u;
  return n ^ (n >> 33);
}

/// Keeps an even sample of the coloured points of a drive, at most `most`. A hash of a point's number in the cloud
/// decides, so the same cloud gives the same sample. Points without a colour and points that move by themselves are
/// left out: reconstructions begin with what stands still. Thread safety: none.
class PointSample {
 public:
  explicit PointSample(std::size_t most) : most_(most) {}

  void add(const CloudBlock& block) {
    for (const ColouredPoint& point : block.points) {
      const std::uint64_t hash = mixed_bits(count_++);
      if (hash > limit_ || most_ == 0 || point.lens == kNoLens || is_moving(point)) continue;
      if (kept_.size() == most_) thin();
      if (hash <= limit_) kept_.emplace_back(hash, point);
    }
  }
  /// Returns the points in the order of the cloud.
  std::vector<ColouredPoint> points() const {
    std::vector<ColouredPoint> out;
    for (const auto& [hash, point] : kept_) out.push_back(point);
    return out;
  }

 private:
  void thin() {
    limit_ /= 2;
    std::erase_if(kept_, [&](const auto& one) { return one.first > limit_; });
  }

  std::size_t most_;
  std::uint64_t count_ = 0, limit_ = ~std::uint64_t{0};
  std::vector<std::pair<std::uint64_t, ColouredPoint>> kept_;
};

}  // namespace hueline::products
