#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/ouster/ouster_wire.hpp"

namespace hueline::drivers {

/// What the kernel finds in one data packet besides its returns.
struct OusterColumns {
  int invalid = 0;             ///< columns that the scanner marks as not measured, or as outside its window
  int malformed = 0;           ///< columns with a number or a time that cannot be
  std::uint64_t first_ns = 0;  ///< the earliest time of a valid column; of any column if none is valid
};

/// Computes the returns of a data packet from tables that are made once for a scanner's metadata, many channels at a
/// time. It does not deal with faults, packets or clocks; times are offsets from the packet's earliest column. Thread
/// safety: none; one thread calls it, because it owns the scratch space.
class OusterKernel {
 public:
  /// Ranges in metres. The metadata are valid.
  OusterKernel(const OusterMetadata& metadata, double min_range_m, double max_range_m);

  /// Decodes a packet of the metadata's size. Replaces `returns` by those of the packet, column by column.
  OusterColumns decode(std::span<const std::byte> bytes, std::vector<LaserReturn>& returns);

  static constexpr std::size_t kMost = 128;  ///< channels
  using Floats = std::array<float, kMost>;
  /// The direction of each beam, as parts along the encoder's direction, left of it and upwards.
  struct Beams {
    alignas(64) Floats along, left, up, azimuth;
    alignas(64) std::array<std::uint32_t, kMost> ring;
  };
  /// The axes of the turned lidar frame in the Scanner frame, and the place of the beams' origin there.
  struct Turn {
    Eigen::Vector3f along, left, origin;
    float azimuth;  ///< of `along`, clockwise from y
  };
  /// How the pixels of a packet become returns.
  struct Pixels {
    OusterProfile profile;
    std::size_t channels;
    std::size_t reflectivity_at;      ///< byte of the pixel
    std::uint32_t nearest_mm, count;  ///< the smallest range that is kept, and how many from there on, mm
    float beam_m;                     ///< distance of the beams' origin from the centre
    Eigen::Vector3f up;
  };
  /// A column whose returns are wanted.
  struct Column {
    const std::byte* pixels;
    const Turn* turn;
    std::int32_t time_ns;
  };

 private:
  OusterMetadata metadata_;
  Pixels pixels_;
  Beams beams_{};
  std::vector<Turn> turns_;      ///< by column
  std::vector<Column> columns_;  ///< of the packet
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
