#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/hesai/hesai_decoder.hpp"
#include "drivers/return_lanes.hpp"

namespace hueline::drivers {

/// What the kernel finds in one data packet besides its returns.
struct HesaiBlocks {
  int malformed = 0;  ///< blocks with a wrong flag or azimuth, or another azimuth than those of the same firings
  nanoseconds first_firing{0};  ///< of the packet, after the packet's time
};

/// Computes the returns of a data packet from tables that are made once. It does not deal with faults, packets or
/// clocks; times are offsets from the packet's first firing.
/// Thread safety: none; one thread calls it, because it owns the scratch space.
class HesaiKernel {
 public:
  explicit HesaiKernel(const HesaiDecoder::Config& config);

  /// Decodes a packet of at least the model's size. Replaces `returns` by those of the packet, block by block.
  HesaiBlocks decode(std::span<const std::byte> bytes, const HesaiPacket& packet, std::vector<LaserReturn>& returns);

 private:
  static constexpr std::size_t kMost = 128;  ///< channels
  using Floats = std::array<float, kMost>;
  struct Channels {
    alignas(16) Floats sin_elevation, cos_elevation, sin_azimuth, cos_azimuth, azimuth;
    alignas(16) std::array<std::int32_t, kMost> time_ns, time_of_second_ns;
    alignas(16) std::array<std::uint32_t, kMost> ring;
  };

  std::int32_t block_ns(int block, int returns) const;
  void fill_lanes(const std::byte* units, int azimuth, std::int32_t block_ns, bool is_second);
  LaserReturn* decode_group(const std::byte* first, int returns, int azimuth, std::int32_t block_ns, bool is_second,
                            LaserReturn* out);

  const HesaiTable& table_;
  double min_range_m_, max_range_m_;
  std::int32_t nearest_ = 1, span_ = 65535;  ///< in steps of the packet's distance
  float range_step_ = 0;
  Channels channels_{};
  std::vector<float> sin_, cos_;  ///< indexed by azimuth, 0.01 degrees
  ReturnLanes<kMost> lanes_{};
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
