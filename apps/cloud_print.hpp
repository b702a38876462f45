#pragma once

#include <array>
#include <cstdint>

#include "core/coloured_point.hpp"

namespace hueline::apps {

/// Of every field of every point in the order given: two runs with the same one gave the same cloud.
class CloudPrint {
 public:
  void add(const ColouredPoint& point);
  std::array<std::uint64_t, 2> value() const { return value_; }
  std::uint64_t points() const { return points_; }
  bool operator==(const CloudPrint&) const = default;

 private:
  std::array<std::uint64_t, 2> value_{0xCBF29CE484222325ull, 0x9E3779B97F4A7C15ull};
  std::uint64_t points_ = 0;
};

}  // namespace hueline::apps
