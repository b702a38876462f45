#pragma once

#include <cstdint>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/profile_scanner/profile_scanner_wire.hpp"

namespace hueline::drivers {

/// Computes the returns of a data datagram from ranges and angles. It does not deal with faults or packets.
/// Thread safety: none; one thread calls it, because it owns scratch space and the directions of the latest angle step.
class ProfileScannerKernel {
 public:
  explicit ProfileScannerKernel(const ProfileScannerDecoder::Config& config);

  /// Replaces `returns` by the returns of the datagram that are kept, in the order of pulses and, within a pulse, of
  /// range.
  void decode(const ProfileData& data, std::vector<LaserReturn>& returns);

 private:
  void fill_steps(std::int32_t step, std::size_t pulses);

  std::uint32_t nearest_, span_;               ///< in 0.1 mm; ranges from nearest_ to nearest_ + span_ are kept
  std::uint32_t window_begin_, window_width_;  ///< in 2^-32 turns
  std::int32_t step_ = 0;
  std::vector<double> sin_, cos_;  ///< of k angle steps
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
