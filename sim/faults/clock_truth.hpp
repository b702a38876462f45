#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::sim {

/// The clocks of a vehicle. Scanner: labels of its pulses, against UTC. Receiver: GPS time stamps of the POS. Camera:
/// its counter, against drive time. Host: the computer's clock, against drive time.
enum class VehicleClock : std::uint8_t { Scanner, Receiver, Camera, Host };
const char* name(VehicleClock clock);

/// What a clock truly showed at `gps_ns`.
struct ClockSample {
  VehicleClock clock = VehicleClock::Scanner;
  GpsNs gps_ns = 0;
  std::int64_t offset_ns = 0;  ///< clock minus truth
  double rate_ppb = 0;         ///< of the offset since the sample before (the first: until the next); a step is a spike
};

/// Every clock ten times a second; the camera's when it latched its counter for an image that the camera delivers, the
/// noise of the latch not being the clock's. `timeline` is the drive spoilt by `lines`. In the order of clock, then
/// time.
std::vector<ClockSample> true_clocks(const Timeline& timeline, const std::vector<FaultLine>& lines);

/// As CSV: clock,gps_ns,offset_ns,rate_ppb. Errors: Io.
Status write_clocks(const std::string& path, const std::vector<ClockSample>& samples);

}  // namespace hueline::sim
