#pragma once

#include <cstddef>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/scenario.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::sim {

/// A timeline with faults.
struct FaultyTimeline {
  Timeline timeline;
  std::vector<std::size_t> hits;  ///< for each line: number of packets, images, edges or solutions that it touched
};

/// Builds everything that the devices send during `drive`, with the faults of `lines`. Faults are applied in this
/// order: solutions and wheels, clocks of the devices, what each device delivers, the way to the computer, the
/// computer's clock; faults of one stage in the order of their lines. Equal drives, configurations and lines give equal
/// bytes and times; without lines they are those of `build_timeline()`. Errors: Invalid (a line that `validate()`
/// refuses, configuration, drive).
Result<FaultyTimeline> build_faulty_timeline(const Drive& drive, const TimelineConfig& config,
                                             const std::vector<FaultLine>& lines);

/// Builds the same for a drive that `scenario` generated, with its seed, its laser and its faults. `laser` is the
/// number of the scanner on the vehicle; `before` is what the devices have sent before.
Result<FaultyTimeline> scenario_timeline(const Scenario& scenario, const Drive& drive, std::uint8_t laser = 0,
                                         const SentBefore& before = {});

}  // namespace hueline::sim
