#pragma once

#include <cstdint>
#include <vector>

#include "core/measurements.hpp"
#include "core/time.hpp"

/// What sync/ returns and fusion/ accepts: measurements in GPS time, each with one sigma of its time and the state of
/// the clock that stamped it.
namespace hueline {

/// The returns of one packet, with the time of their firings.
struct StampedLaserBatch {
  SensorId sensor{};
  std::uint64_t packet_sequence = 0;
  GpsTime time{};        ///< the first firing; a return's firing is time + time_offset_ns
  nanoseconds sigma{0};  ///< one sigma of `time`
  SyncState state = SyncState::Unlocked;
  std::vector<LaserReturn> returns;
};

/// The report of a wheel encoder, with the time to which its value belongs.
struct StampedWheelSpeed {
  GpsTime time{};        ///< end of the frame on the bus, minus the age that the rig gives for the values
  nanoseconds sigma{0};  ///< one sigma of `time`
  SyncState state = SyncState::Unlocked;
  WheelSpeed wheel;
};

/// How the time of an exposure was found.
enum class ExposureTiming : std::uint8_t {
  EventMark,    ///< from the event mark of its strobe, which the POS stamped
  CameraClock,  ///< the mark is lost; from the camera's counter, tied to GPS time by earlier marks, with a larger sigma
  Unmatched,    ///< neither; the exposure is recorded, but never used for colour
};
/// Returns the enumerator's name.
const char* name(ExposureTiming timing);

/// One exposure of a camera, with its time and its image. A camera whose lenses are stacked in one image gives one
/// Exposure for all of them.
struct Exposure {
  SensorId camera{};
  std::uint32_t index = 0;  ///< number in the order of time, from 0; sync/ assigns it, and points refer to it
  GpsTime exposure_mid{};
  nanoseconds sigma{0};  ///< one sigma of `exposure_mid`
  SyncState state = SyncState::Unlocked;
  ExposureTiming timing = ExposureTiming::Unmatched;
  Image image;
  /// How long it lasted, around `exposure_mid`: as the camera reports, else as the rig says. If the camera reports
  /// different durations of parts of the image, this is their mean; the parts begin together, so the middle of a part
  /// is later by half of what its duration is longer.
  nanoseconds duration{0};
};

}  // namespace hueline
