#pragma once

#include <optional>

#include "core/time.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

/// A reading of CLOCK_REALTIME relative to HostTime, with the host time of the reading.
struct ClockReading {
  HostTime at{};
  ClockOffset offset;
};

/// Returns by how much CLOCK_REALTIME stepped between two readings. Returns nothing if slewing (at most 600 ppm) and
/// the uncertainty of the readings explain the difference.
std::optional<nanoseconds> step_between(const ClockReading& before, const ClockReading& after);

/// Converts the stamp of an edge from CLOCK_REALTIME to HostTime. The edge happened between the two readings. Without a
/// step of the clock, it interpolates between them, so that slewing does no harm. After a step it uses the reading that
/// puts the edge between the two. Returns nothing if both do or neither does, because the edge could then be anywhere.
std::optional<HostTime> place_edge(nanoseconds stamp, const ClockReading& before, const ClockReading& after);

}  // namespace hueline::drivers
