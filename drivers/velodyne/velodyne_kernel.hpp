#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"

namespace hueline::drivers {

/// What one data packet gave besides its returns.
struct VelodyneBlocks {
  int decoded = 0;                          ///< blocks turned into returns
  int malformed = 0;                        ///< blocks with a wrong flag, azimuth or, in dual mode, partner
  int untimed = 0;                          ///< blocks behind a jump of the azimuth
  int first_azimuth = 0, last_azimuth = 0;  ///< of the blocks with a time, 0.01 deg
  int jump_azimuth = 0;                     ///< of the first block behind the jump, if there is one
  double turn_rate = 0;                     ///< of the mirror, 0.01 deg a second; 0: not known
};

/// The arithmetic of data packets: tables made once, then per packet only loads, multiplications and stores. Knows no
/// faults, no packets, no time but the offsets in a packet. Thread-bound (it owns the scratch space).
class VelodyneKernel {
 public:
  explicit VelodyneKernel(const VelodyneDecoder::Config& config);

  /// `bytes`: 1206. Replaces `returns` by the packet's, in firing order.
  VelodyneBlocks decode(std::span<const std::byte> bytes, bool is_dual, std::vector<LaserReturn>& returns);

 private:
  /// One azimuth of a packet: a block, or the two blocks of a pair.
  struct Unit {
    int azimuth = 0;  ///< 0.01 deg
    bool is_valid = false;
  };
  /// What never changes, by place in the block; one array a quantity, so that loops over them vectorise.
  struct Firings {
    std::array<float, kVelodyneFiringsPerBlock> sin_elevation, cos_elevation, vertical_offset;
    std::array<float, kVelodyneFiringsPerBlock> fraction;  ///< of the block's duration
    std::array<std::int32_t, kVelodyneFiringsPerBlock> offset_ns;
    std::array<std::uint16_t, kVelodyneFiringsPerBlock> channel;
  };
  /// What one azimuth gives, by place in the block.
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
  unsigned nearest_, span_;  ///< range steps: kept from nearest_ to nearest_ + span_
  float range_step_;
  bool has_window_;
  float window_begin_, window_width_;
  int max_step_;
  Firings firings_{};
  std::vector<float> sin_, cos_;  ///< by 0.01 deg
  Directions directions_{};
  /// One more than a packet can hold: a return is written before it is known whether it is kept.
  std::array<LaserReturn, kVelodyneBlocks * kVelodyneFiringsPerBlock + 1> scratch_;
};

}  // namespace hueline::drivers
