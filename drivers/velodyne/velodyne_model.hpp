#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

/// The differences between the Velodyne models. Sources: VLP-16 User Manual 63-9243 (tables 9-1 and 9-4, section 9.3),
/// HDL-32E User's Manual (firing order, appendix E). All models have the same data packet, little endian:
///
///   offset  size  field
///        0  1200  12 blocks of 100 bytes
///     1200     4  time stamp, microseconds past the UTC hour
///     1204     1  return mode: 0x37 strongest, 0x38 last, 0x39 dual
///     1205     1  factory byte, the product
///
///   block
///        0     2  flag 0xFF 0xEE
///        2     2  azimuth, 0.01 degrees
///        4    96  32 firings of 3 bytes
///
///   firing
///        0     2  range, range steps of the model; 0: no return
///        2     1  reflectivity
namespace hueline::drivers {

enum class VelodyneModel : std::uint8_t { Vlp16, Hdl32e };

constexpr int kVelodyneBlocks = 12;           ///< blocks in a data packet
constexpr int kVelodyneFiringsPerBlock = 32;  ///< firings in a block
constexpr std::size_t kVelodyneDataBytes = 1206;
constexpr std::size_t kVelodynePositionBytes = 512;

/// Where one laser points.
struct VelodyneLaser {
  double elevation_deg = 0;
  double vertical_offset_mm = 0;  ///< of the beam's origin above the scanner's origin, along z
};

/// The constants of one model. Another model with the same data packet needs only another table.
struct VelodyneTable {
  const char* name;
  std::uint8_t product_id;  ///< factory byte of a data packet
  int lasers;               ///< number of lasers; they fire one after the other, in the order of the packet
  std::chrono::nanoseconds firing_period;    ///< from one laser to the next
  std::chrono::nanoseconds sequence_period;  ///< all lasers once, with the recharge time
  double range_step_m;
  std::array<VelodyneLaser, kVelodyneFiringsPerBlock> laser;  ///< the first `lasers` are used

  constexpr int sequences_per_block() const { return kVelodyneFiringsPerBlock / lasers; }
  constexpr std::chrono::nanoseconds block_period() const { return sequence_period * sequences_per_block(); }
};

const VelodyneTable& velodyne_table(VelodyneModel model);

}  // namespace hueline::drivers
