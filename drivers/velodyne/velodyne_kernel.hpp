#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/azimuth_directions.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "drivers/written_ahead.hpp"

namespace hueline::drivers {

/// What the kernel finds in one data packet besides its returns.
struct VelodyneBlocks {
  int decoded = 0;    ///< blocks that became returns
  int malformed = 0;  ///< blocks with a wrong flag or azimuth or, in dual-return mode, a wrong partner
  int behind = 0;     ///< blocks behind a jump of the azimuth, whose returns are those of VelodyneKernel::behind()
  int untimed = 0;    ///< blocks behind a second jump; they are not decoded
  int first_azimuth = 0, last_azimuth = 0;      ///< of the blocks with a known time, 0.01 degrees
  int jump_azimuth = 0;                         ///< of the first block behind the jump, if there is one, 0.01 degrees
  int behind_azimuth = 0;                       ///< of the last block behind it
  std::chrono::nanoseconds behind_duration{0};  ///< of the blocks behind it
  double turn_rate = 0;                         ///< of the mirror, 0.01 degrees a second; 0 if not known
};

/// Computes the returns of a data packet. Its tables are made once; for each packet there are only loads,
/// multiplications and stores, of many firings at once. It does not deal with faults, packets or clocks; times are
/// offsets within the packet.
/// Thread safety: none; one thread calls it, because it owns the scratch space.
class VelodyneKernel {
 public:
  explicit VelodyneKernel(const VelodyneDecoder::Config& config);

  /// Decodes a packet of 1206 bytes. Replaces `returns` by those of the packet, in the order of the blocks. `turn_rate`
  /// is that of the packets before, 0.01 degrees a second; it is used if this packet has no two azimuths to measure it.
  VelodyneBlocks decode(std::span<const std::byte> bytes, bool is_dual, double turn_rate,
                        std::vector<LaserReturn>& returns);

  /// Returns the returns behind the azimuth jump of the latest packet. Their times count from the first block there:
  /// how long the scanner was silent at the jump, the packet does not say.
  std::vector<LaserReturn>& behind() { return behind_; }

  static constexpr std::size_t kFirings = kVelodyneFiringsPerBlock;
  using Floats = std::array<float, kFirings>;

  /// Constants of each firing of a block.
  struct Firings {
    alignas(64) Floats sin_elevation, cos_elevation, vertical_offset;
    alignas(64) Floats sin_azimuth, cos_azimuth;  ///< of the laser's azimuth against the block's
    alignas(64) Floats azimuth;                   ///< the same angle, rad
    alignas(64) Floats fraction;                  ///< of the sequence's or block's duration, at which the laser fires
    alignas(64) std::array<std::int32_t, kFirings> offset_ns;
    alignas(64) std::array<std::uint32_t, kFirings> channel;
  };
  /// What each firing's azimuth is ahead of the block's: by the laser's own azimuth, and because the mirror turns.
  struct Turn {
    alignas(64) Floats sin_ahead, cos_ahead;
    alignas(64) Floats turned;  ///< by the mirror alone, rad
  };
  /// Which returns are kept.
  struct Choice {
    ReturnChoice returns;
    std::uint32_t nearest, count;  ///< the smallest distance, and how many from there on, in range steps
    float range_step;
    bool has_window;
    float window_begin, window_width;  ///< of the azimuths, rad
  };
  /// A block to decode or, in dual-return mode, a pair: `strongest` is the odd block.
  struct Block {
    const Firings* firings;
    const Turn* turn;
    const std::byte *last, *strongest;
    float azimuth;
    bool is_near_north;  ///< so that the azimuth of a firing may be on the other side of 0
    AzimuthDirection direction;
    std::int32_t time_ns;
  };

 private:
  /// The blocks of one azimuth: one block or, in dual-return mode, a pair; of a scanner with several banks a sequence.
  struct Unit {
    int azimuth = 0;          ///< in 0.01 degrees
    unsigned good_banks = 0;  ///< a bit for each bank whose blocks can be decoded
    std::optional<int> step;  ///< of the azimuth to the next unit; nothing if it is not known or not plausible
  };
  struct Units {
    std::array<Unit, kVelodyneBlocks> units;
    int count = 0, malformed = 0;   ///< units; blocks that cannot be decoded
    int jump = 0, second_jump = 0;  ///< the first units behind a jump of the azimuth; `count` if there is none
    int sum = 0, steps = 0;         ///< of the plausible steps
  };
  Units units_of(std::span<const std::byte> bytes, int copies) const;
  void find_steps(Units& all) const;

  const VelodyneTable& table_;
  Choice choice_;
  nanoseconds period_;  ///< from one unit to the next
  int max_step_;
  std::vector<Firings> firings_;  ///< by bank
  std::vector<Turn> turns_;       ///< by plausible step of the azimuth, the smallest first, then by bank
  std::vector<Turn> mean_turns_;  ///< by bank; for the packet's mean step, which is no whole number
  std::vector<LaserReturn> behind_;
  alignas(64) std::array<LaserReturn, kVelodyneBlocks * kFirings + kWrittenAhead> scratch_;
};

}  // namespace hueline::drivers
