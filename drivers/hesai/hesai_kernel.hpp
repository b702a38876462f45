#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/azimuth_directions.hpp"
#include "drivers/hesai/hesai_decoder.hpp"

namespace hueline::drivers {

/// What the kernel finds in one data packet besides its returns.
struct HesaiBlocks {
  int malformed = 0;  ///< blocks with a wrong flag or azimuth, or another azimuth than those of the same firings
  nanoseconds first_firing{0};  ///< of the packet, after the packet's time
};

/// Computes the returns of a data packet from tables that are made once, many firings at a time. It does not deal with
/// faults, packets or clocks; times are offsets from the packet's first firing.
/// Thread safety: none; one thread calls it, because it owns the scratch space.
class HesaiKernel {
 public:
  explicit HesaiKernel(const HesaiDecoder::Config& config);

  /// Decodes a packet of at least the model's size. Replaces `returns` by those of the packet, block by block.
  HesaiBlocks decode(std::span<const std::byte> bytes, const HesaiPacket& packet, std::vector<LaserReturn>& returns);

  static constexpr std::size_t kMost = 128;       ///< channels
  static constexpr std::size_t kMostReturns = 3;  ///< of a firing
  static constexpr std::size_t kMostBlocks = 10;
  static constexpr std::uint32_t kLeastDistance = 4;  ///< of a return, in steps: smaller ones say why there is none
  using Floats = std::array<float, kMost>;
  /// Constants of each channel.
  struct Channels {
    alignas(64) Floats sin_elevation, cos_elevation, sin_azimuth, cos_azimuth, azimuth;
    alignas(64) std::array<std::int32_t, kMost> time_ns;
    /// Those of every second block, or in high resolution; a model has one of them at most.
    alignas(64) std::array<std::int32_t, kMost> other_time_ns;
    alignas(64) std::array<std::uint32_t, kMost> ring;
  };
  /// How the units of a packet become returns.
  struct Units {
    std::size_t channels, bytes;  ///< number of channels, bytes of a unit
    float range_step;
    float turn;                    ///< of the head, rad/ns
    std::uint32_t nearest, count;  ///< the smallest distance that is kept, and how many from there on, in steps
  };
  /// The blocks of the same firings.
  struct Group {
    std::array<const std::byte*, kMostReturns> units;  ///< of each block; nullptr behind the last
    float azimuth;                                     ///< rad
    AzimuthDirection direction;
    std::int32_t time_ns;
    bool has_other_times;
  };

 private:
  std::int32_t block_ns(int block, const HesaiPacket& packet) const;

  const HesaiTable& table_;
  double min_range_m_, max_range_m_;
  Channels channels_{};
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
