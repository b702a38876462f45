#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

/// The differences between the Velodyne models. Sources: VLP-16 User Manual 63-9243 (tables 9-1 and 9-4, section 9.3),
/// VLP-16 Puck Hi-Res data sheet, HDL-32E User's Manual (firing order, appendix E), VLP-32C User Manual 63-9325,
/// VLS-128 User Manual. All models have the same data packet, little endian:
///
///   offset  size  field
///        0  1200  12 blocks of 100 bytes
///     1200     4  time stamp, microseconds past the UTC hour
///     1204     1  return mode: 0x37 strongest, 0x38 last, 0x39 dual. Others (0x3A, 0x3B: dual with confidence) arrange
///                 the blocks in ways that the manuals do not describe, and are not read
///     1205     1  factory byte, the product
///
///   block
///        0     2  flag 0xFF 0xEE; of a VLS-128 that of the block's lasers: EE 0-31, DD 32-63, CC 64-95, BB 96-127
///        2     2  azimuth, 0.01 degrees
///        4    96  32 firings of 3 bytes
///
///   firing
///        0     2  range, range steps of the model; 0: no return
///        2     1  reflectivity
///
/// In dual-return mode two blocks in a row are the two returns of the same firings. A VLS-128 then fills eight blocks
/// and leaves the other four empty.
namespace hueline::drivers {

enum class VelodyneModel : std::uint8_t { Vlp16, Hdl32e, PuckHiRes, Vlp32c, Vls128 };
inline constexpr std::array kVelodyneModels{VelodyneModel::Vlp16, VelodyneModel::Hdl32e, VelodyneModel::PuckHiRes,
                                            VelodyneModel::Vlp32c, VelodyneModel::Vls128};

/// Where the fields of a data packet are, and the return mode in which each block comes twice.
constexpr std::size_t kVelodyneStampAt = 1200, kVelodyneModeAt = 1204, kVelodyneProductAt = 1205;
constexpr std::uint8_t kVelodyneStrongest = 0x37, kVelodyneLast = 0x38, kVelodyneDual = 0x39;
constexpr bool is_velodyne_mode(std::uint8_t mode) { return mode >= kVelodyneStrongest && mode <= kVelodyneDual; }
constexpr int kVelodyneBlocks = 12;           ///< blocks in a data packet
constexpr int kVelodyneFiringsPerBlock = 32;  ///< firings in a block
constexpr std::size_t kVelodyneDataBytes = 1206;
constexpr std::size_t kVelodynePositionBytes = 512;

/// Where one laser points.
struct VelodyneLaser {
  double elevation_deg = 0;
  double azimuth_deg = 0;         ///< against the azimuth of the block, clockwise seen from above
  double vertical_offset_mm = 0;  ///< of the beam's origin above the scanner's origin, along z
};

/// The constants of one model. Another model with the same data packet needs only another table.
struct VelodyneTable {
  const char* name;
  std::uint8_t product_id;                   ///< factory byte of a data packet
  int at_once = 1;                           ///< number of lasers that fire together, in the order of the packet
  int pause_after = 1000;                    ///< after so many shots one firing period passes without a shot
  std::chrono::nanoseconds firing_period;    ///< from one shot to the next
  std::chrono::nanoseconds sequence_period;  ///< all lasers once, with the recharge time
  std::chrono::nanoseconds first_firing{0};  ///< time of the first shot minus the packet's stamp
  double range_step_m = 0.002;
  std::span<const VelodyneLaser> lasers;  ///< in the order of the packet

  constexpr int count() const { return static_cast<int>(lasers.size()); }
  /// Returns the number of blocks over which one sequence extends; 1 also if a block has several sequences.
  constexpr int banks() const { return count() > kVelodyneFiringsPerBlock ? count() / kVelodyneFiringsPerBlock : 1; }
  constexpr int sequences_per_block() const { return banks() > 1 ? 1 : kVelodyneFiringsPerBlock / count(); }
  /// Returns the time from the beginning of a block, or of the blocks of one sequence, to that of the next.
  constexpr std::chrono::nanoseconds block_period() const { return sequence_period * sequences_per_block(); }
  /// Returns the time from one data packet to the next.
  constexpr std::chrono::nanoseconds packet_period(bool is_dual) const {
    return block_period() * (kVelodyneBlocks / banks() / (is_dual ? 2 : 1));
  }
  /// Returns the time of a laser's shot in its sequence.
  constexpr std::chrono::nanoseconds firing_time(int laser) const {
    const int shot = laser / at_once;
    return firing_period * (shot + (shot >= pause_after ? 1 : 0));
  }
};

const VelodyneTable& velodyne_table(VelodyneModel model);

}  // namespace hueline::drivers
