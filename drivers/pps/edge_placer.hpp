#pragma once

#include <optional>

#include "core/time.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

/// A reading of CLOCK_REALTIME against HostTime, with the host time at which it was made.
struct ClockReading {
  HostTime at{};
  ClockOffset offset;
};

/// How far CLOCK_REALTIME stepped between two readings; nullopt if slewing (at most 600 ppm) and the readings' own
/// uncertainty explain the difference.
std::optional<nanoseconds> step_between(const ClockReading& before, const ClockReading& after);

/// Places an edge stamped on CLOCK_REALTIME that happened between the two readings. Without a step by both readings
/// (interpolated, so that slewing does no harm); with one by whichever reading puts the edge between them. Nullopt if
/// both do or neither: the edge could be anywhere.
std::optional<HostTime> place_edge(nanoseconds stamp, const ClockReading& before, const ClockReading& after);

}  // namespace hueline::drivers
