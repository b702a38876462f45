#pragma once

#include <cstdint>
#include <vector>

#include "core/measurements.hpp"
#include "core/time.hpp"

/// What sync/ gives and fusion/ takes: measurements in GPS time, each with its sigma and the state of the clock that
/// stamped it.
namespace hueline {

struct StampedLaserBatch {
  SensorId sensor{};
  std::uint64_t packet_sequence = 0;
  GpsTime time{};  ///< first firing; each return's firing is time + time_offset_ns
  nanoseconds sigma{0};
  SyncState state = SyncState::Unlocked;
  std::vector<LaserReturn> returns;
};

/// A wheel encoder's statement at the instant that it is about.
struct StampedWheelSpeed {
  GpsTime time{};        ///< end of the frame on the bus, less the age that the rig gives its values
  nanoseconds sigma{0};  ///< of `time`
  SyncState state = SyncState::Unlocked;
  WheelSpeed wheel;
};

/// Why an exposure's time can or cannot be trusted.
enum class ExposureTiming : std::uint8_t {
  EventMark,    ///< stamped by the POS at its strobe
  CameraClock,  ///< mark lost: the camera's own counter, tied to GPS time by earlier marks; sigma grown to match
  Unmatched,    ///< neither: recorded, never used for colour
};
const char* name(ExposureTiming timing);

/// One moment of all lenses of a camera head.
struct Exposure {
  SensorId camera{};
  std::uint32_t index = 0;  ///< counted by sync from 0 in time order; what points refer to
  GpsTime exposure_mid{};
  nanoseconds sigma{0};
  SyncState state = SyncState::Unlocked;
  ExposureTiming timing = ExposureTiming::Unmatched;
  Image image;
};

}  // namespace hueline
