#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/azimuth_directions.hpp"
#include "drivers/robosense/robosense_wire.hpp"
#include "drivers/written_ahead.hpp"

namespace hueline::drivers {

/// Azimuth and time of a block of a packet of points.
struct RobosenseBlock {
  double azimuth = 0, step = 0;  ///< rad; the step is what the scanner turns in one firing period
  double time_us = 0;            ///< after the packet's
  AzimuthDirection direction{};  ///< of `azimuth`
};

/// Computes the returns of blocks of a scanner that rotates, many firings at a time. It does not deal with faults or
/// clocks.
/// Thread safety: none; one thread calls it, because it owns the scratch space.
class RobosenseKernel {
 public:
  static constexpr std::size_t kChannels = kRobosenseChannels;
  using Doubles = std::array<double, kChannels>;
  using Floats = std::array<float, kChannels>;
  /// Constants of each firing of a block.
  struct Channels {
    alignas(64) Doubles after_us, after, azimuth;  ///< `after` counts in firing periods
    alignas(64) Floats after_periods, sin_azimuth, cos_azimuth, sin_elevation, cos_elevation;
    alignas(64) std::array<std::uint32_t, kChannels> ring;
  };
  /// How the units of a block become returns.
  struct Units {
    double lens_radius_m;
    float range_step, lens_height;  ///< m; a step is one unit of the ranges
    bool is_reversed;
    /// How far a firing's azimuth is from its block's at most, rad, and the latest firing, in periods.
    double most_aside, most_after;
    std::uint32_t nearest, count;  ///< the smallest range that is kept, and how many from there on, in units
  };
  /// Firings whose returns are wanted: `first` and, with two returns, `second` are the first of their units. Four bytes
  /// behind the last unit can be read, as in a packet, whose blocks are followed by six.
  struct Firings {
    RobosenseBlock block;
    const std::byte *first, *second;
    std::size_t count;
  };

  RobosenseKernel(const RobosenseTable& table, const RobosenseDescription& description, double range_unit_m,
                  double min_range_m, double max_range_m);

  /// Replaces `returns` by those of the firings, which are those of one packet.
  void decode(std::span<const Firings> firings, std::vector<LaserReturn>& returns);

 private:
  Channels channels_{};
  Units units_{};
  alignas(64) std::array<LaserReturn, kRobosenseBlocks * kChannels + kWrittenAhead> scratch_;
};

}  // namespace hueline::drivers
