#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::sim {

/// The clocks of a vehicle. Scanner: the labels of its pulses, against UTC. Receiver: the GPS time stamps of the POS.
/// Camera: its counter, against drive time. Host: the computer's clock, against drive time.
enum class VehicleClock : std::uint8_t { Scanner, Receiver, Camera, Host };
const char* name(VehicleClock clock);

/// The true state of a clock at `gps_ns`.
struct ClockSample {
  VehicleClock clock = VehicleClock::Scanner;
  GpsNs gps_ns = 0;
  std::int64_t offset_ns = 0;  ///< clock minus truth
  /// Rate of the offset since the previous sample (of the first sample, until the next one); a step appears as a spike.
  double rate_ppb = 0;
};

/// Returns the state of every clock ten times a second. The camera's clock is sampled when its counter was latched for
/// an image that the camera delivers; the noise of the latch is not counted as an error of the clock. `timeline` is the
/// drive with the faults of `lines`. The samples stand in the order of clock, then time.
std::vector<ClockSample> true_clocks(const Timeline& timeline, const std::vector<FaultLine>& lines);

/// Writes the samples as CSV: clock,gps_ns,offset_ns,rate_ppb. Errors: Io.
Status write_clocks(const std::string& path, const std::vector<ClockSample>& samples);

}  // namespace hueline::sim
