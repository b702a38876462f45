#pragma once

#include <array>
#include <cstdint>

#include "runtime/products.hpp"

namespace hueline::apps {

/// A hash of every field of every point, in the given order. Two runs with the same hash gave the same cloud.
class CloudPrint {
 public:
  /// Adds a point to the hash.
  void add(const ColouredPoint& point);
  std::array<std::uint64_t, 2> value() const { return value_; }
  std::uint64_t points() const { return points_; }
  bool operator==(const CloudPrint&) const = default;

 private:
  std::array<std::uint64_t, 2> value_{0xCBF29CE484222325ull, 0x9E3779B97F4A7C15ull};
  std::uint64_t points_ = 0;
};

/// Adds each point of a pipeline to a CloudPrint. Thread safety: none; only the pipeline's thread calls it.
class CloudPrintSink final : public runtime::ProductSink {
 public:
  explicit CloudPrintSink(CloudPrint& print) : print_(print) {}
  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override {
    for (const ColouredPoint& point : block.points) print_.add(point);
  }

 private:
  CloudPrint& print_;
};

}  // namespace hueline::apps
