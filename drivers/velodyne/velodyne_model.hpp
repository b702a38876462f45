#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

/// What distinguishes one Velodyne model from another. Sources: VLP-16 User Manual 63-9243 (tables 9-1 and 9-4,
/// section 9.3), HDL-32E User's Manual (firing order, appendix E).
namespace hueline::drivers {

enum class VelodyneModel : std::uint8_t { Vlp16, Hdl32e };

constexpr int kVelodyneBlocks = 12;           ///< data blocks a packet
constexpr int kVelodyneFiringsPerBlock = 32;  ///< returns a block
constexpr std::size_t kVelodyneDataBytes = 1206;
constexpr std::size_t kVelodynePositionBytes = 512;

struct VelodyneLaser {
  double elevation_deg = 0;
  double vertical_offset_mm = 0;  ///< the beam's origin above the scanner's, along z
};

/// One row a model; a new model of this packet family is a new row.
struct VelodyneTable {
  const char* name;
  std::uint8_t product_id;                   ///< last factory byte of a data packet
  int lasers;                                ///< fired one after the other, in packet order
  std::chrono::nanoseconds firing_period;    ///< from one laser to the next
  std::chrono::nanoseconds sequence_period;  ///< all lasers, with the recharge
  double range_step_m;
  std::array<VelodyneLaser, kVelodyneFiringsPerBlock> laser;  ///< the first `lasers` are used

  constexpr int sequences_per_block() const { return kVelodyneFiringsPerBlock / lasers; }
  constexpr std::chrono::nanoseconds block_period() const { return sequence_period * sequences_per_block(); }
};

const VelodyneTable& velodyne_table(VelodyneModel model);

}  // namespace hueline::drivers
