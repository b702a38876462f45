#pragma once

#include <cstdint>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/profile_scanner/profile_scanner_wire.hpp"

namespace hueline::drivers {

/// The arithmetic of data datagrams: ranges and angles to places and times. Knows no faults and no packets.
/// Thread-bound (it owns scratch space and the directions of the last angle step).
class ProfileScannerKernel {
 public:
  explicit ProfileScannerKernel(const ProfileScannerDecoder::Config& config);

  /// Replaces `returns` by the kept ones of the datagram, in the order of pulses and, within one, of range.
  void decode(const ProfileData& data, std::vector<LaserReturn>& returns);

 private:
  void fill_steps(std::int32_t step, std::size_t pulses);

  std::uint32_t nearest_, span_;               ///< 0.1 mm: kept from nearest_ to nearest_ + span_
  std::uint32_t window_begin_, window_width_;  ///< 2^-32 turn
  std::int32_t step_ = 0;
  std::vector<double> sin_, cos_;  ///< of k steps
  std::vector<LaserReturn> scratch_;
};

}  // namespace hueline::drivers
