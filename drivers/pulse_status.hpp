#pragma once

#include <cstdint>
#include <string>

#include "core/time.hpp"

namespace hueline::drivers {

/// What a scanner reports about the pulses per second (PPS) at its input. The byte is that of a Velodyne's position
/// packet (VLP-16 User Manual, section 9.3.3); the profile scanner format uses the same byte.
struct PulseStatus {
  SyncState clock = SyncState::Unlocked;
  std::string words;  ///< in the terms of the scanner's manual; goes into messages
};
inline PulseStatus pulse_status(std::uint8_t byte) {
  switch (byte) {
    case 0:
      return {SyncState::Unlocked, "no PPS"};
    case 1:
      return {SyncState::Acquiring, "synchronising to PPS"};
    case 2:
      return {SyncState::Locked, "PPS locked"};
    case 3:
      return {SyncState::Unlocked, "PPS in error"};
    default:
      return {SyncState::Unlocked, "PPS status " + std::to_string(byte)};
  }
}

}  // namespace hueline::drivers
