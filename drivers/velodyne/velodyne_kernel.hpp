#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"

namespace hueline::drivers {

/// What the kernel finds in one data packet besides its returns.
struct VelodyneBlocks {
  int decoded = 0;    ///< blocks that became returns
  int malformed = 0;  ///< blocks with a wrong flag or azimuth or, in dual-return mode, a wrong partner
  int untimed = 0;    ///< blocks after a jump of the azimuth
  int first_azimuth = 0, last_azimuth = 0;  ///< of the blocks with a known time, 0.01 degrees
  int jump_azimuth = 0;                     ///< of the first block after the jump, if there is one, 0.01 degrees
  double turn_rate = 0;                     ///< of the mirror, 0.01 degrees a second; 0 if not known
};

/// Computes the returns of a data packet. Its tables are made once; for each packet there are only loads,
/// multiplications and stores. It does not deal with faults, packets or clocks; times are offsets within the packet.
/// Thread safety: none; one thread calls it, because it owns the scratch space.
class VelodyneKernel {
 public:
  explicit VelodyneKernel(const VelodyneDecoder::Config& config);

  /// Decodes a packet of 1206 bytes. Replaces `returns` by those of the packet, in the order of firing.
  VelodyneBlocks decode(std::span<const std::byte> bytes, bool is_dual, std::vector<LaserReturn>& returns);

 private:
  /// One azimuth of a packet: one block, or in dual-return mode the two blocks of a pair.
  struct Unit {
    int azimuth = 0;  ///< in 0.01 degrees
    bool is_valid = false;
  };
  /// Constants of each firing of a block. Each quantity has its own array, so that loops over them vectorise.
  struct Firings {
    std::array<float, kVelodyneFiringsPerBlock> sin_elevation, cos_elevation, vertical_offset;
    std::array<float, kVelodyneFiringsPerBlock> fraction;  ///< of the block's duration, at which the laser fires
    std::array<std::int32_t, kVelodyneFiringsPerBlock> offset_ns;
    std::array<std::uint16_t, kVelodyneFiringsPerBlock> channel;
  };
  /// The directions of one azimuth, for each firing of a block.
  struct Directions {
    std::array<float, kVelodyneFiringsPerBlock> azimuth, x, y;
    std::array<bool, kVelodyneFiringsPerBlock> is_inside;
  };

  int step(int from, int to) const;
  bool is_plausible(int step) const;
  void fill_directions(int azimuth, float step);
  void write(LaserReturn& r, std::size_t firing, unsigned distance, unsigned reflectivity, std::int32_t block_ns) const;
  LaserReturn* decode_single(const std::byte* block, std::int32_t block_ns, LaserReturn* out) const;
  LaserReturn* decode_pair(const std::byte* last, const std::byte* strongest, std::int32_t block_ns,
                           LaserReturn* out) const;
  bool keeps(std::size_t firing, unsigned distance) const;

  const VelodyneTable& table_;
  ReturnChoice choice_;
  unsigned nearest_, span_;  ///< in range steps; ranges from nearest_ to nearest_ + span_ are kept
  float range_step_;
  bool has_window_;
  float window_begin_, window_width_;
  int max_step_;
  Firings firings_{};
  std::vector<float> sin_, cos_;  ///< indexed by azimuth, 0.01 degrees
  Directions directions_{};
  /// It has room for one more return than a packet, because a return is written before it is known whether it is kept.
  std::array<LaserReturn, kVelodyneBlocks * kVelodyneFiringsPerBlock + 1> scratch_;
};

}  // namespace hueline::drivers
