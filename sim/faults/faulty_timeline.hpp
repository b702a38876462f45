#pragma once

#include <cstddef>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/scenario.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::sim {

struct FaultyTimeline {
  Timeline timeline;
  std::vector<std::size_t> hits;  ///< of each line: packets, images, edges or solutions that it touched
};

/// All that the devices send during `drive`, spoilt by `lines`: first the solutions and wheels, then the devices'
/// clocks, then what each device delivers, then the way to the computer, at last the computer's clock; lines of one
/// kind in their order. The same drive, config and lines give the same bytes and times; without lines they are those of
/// build_timeline. Invalid: a line's validate(), config, drive.
Result<FaultyTimeline> build_faulty_timeline(const Drive& drive, const TimelineConfig& config,
                                             const std::vector<FaultLine>& lines);

/// The same for a drive that `scenario` generated, with its seed, its laser and its faults. `laser`: which of the
/// vehicle's scanners that is.
Result<FaultyTimeline> scenario_timeline(const Scenario& scenario, const Drive& drive, std::uint8_t laser = 0);

}  // namespace hueline::sim
