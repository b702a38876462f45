#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/azimuth_directions.hpp"
#include "drivers/hesai/hesai_decoder.hpp"
#include "drivers/written_ahead.hpp"

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
    alignas(64) std::array<std::uint32_t, kMost> ring;
  };
  /// When each channel fires after its block's time, and what the head has turned then.
  struct Turns {
    alignas(64) std::array<std::int32_t, kMost> time_ns;
    alignas(64) Floats angle, sine, cosine;  ///< rad
    std::int32_t first_ns;                   ///< of the channel that fires first
  };
  /// How the units of a packet become returns.
  struct Units {
    std::size_t channels, bytes;  ///< number of channels, bytes of a unit
    float range_step;
    std::uint32_t nearest, count;  ///< the smallest distance that is kept, and how many from there on, in steps
  };
  /// The blocks of the same firings.
  struct Group {
    std::array<const std::byte*, kMostReturns> units;  ///< of each block; nullptr behind the last
    const Turns* turns;
    float azimuth;       ///< rad
    bool is_near_north;  ///< so that the azimuth of a firing may be on the other side of 0
    AzimuthDirection direction;
    std::int32_t time_ns;
  };

 private:
  void follow(const HesaiPacket& packet);

  const HesaiTable& table_;
  double min_range_m_, max_range_m_;
  Channels channels_{};
  /// The other ones are those of every second block, or in high resolution; a model has one of them at most.
  Turns turns_{}, other_turns_{};
  float most_aside_ = 0;  ///< of the beams' azimuths, rad
  float aside_ = 0;       ///< of a firing from its block's azimuth at the most, with what the head has turned, rad
  Units units_{};
  double step_m_ = -1, turns_per_min_ = -1;  ///< those of the latest packet
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
