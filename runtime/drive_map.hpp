#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/coloured_point.hpp"
#include "core/measurements.hpp"

namespace hueline::runtime {

/// What a drive gave in each second, and where: the map of the report. Memory is bounded by kMostSeconds.
/// Thread safety: none; the pipeline's thread calls all functions.
class DriveMap {
 public:
  struct Second {
    std::optional<Geodetic> place;  ///< of the first good solution of this second
    std::uint32_t points = 0, coloured = 0;
    float sigma_m = -1;  ///< horizontal sigma of the pose; below 0 if unknown
    std::optional<FixType> fix;
  };
  static constexpr std::int64_t kMostSeconds = 200'000;  // two days

  void on_solution(const InsSolution& solution);
  void on_fix(const GnssFix& fix);
  void on_cloud(const CloudBlock& block);

  /// Returns the seconds from the first on, without a gap.
  const std::vector<Second>& seconds() const { return seconds_; }
  /// Returns the GPS second of the first; 0 if there is none.
  std::int64_t first() const { return first_.value_or(0); }

 private:
  Second* at(std::int64_t gps_second);

  std::optional<std::int64_t> first_;
  std::vector<Second> seconds_;
};

}  // namespace hueline::runtime
