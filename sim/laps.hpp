#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/scenario.hpp"
#include "sim/wire/timeline.hpp"

/// A short drive as a long one: what the vehicle does while its laser and camera run, it does again and again. Each lap
/// begins where and when the one before ended, headed as there, and sees the same returns and images. The devices count
/// on.
namespace hueline::sim {

/// Says why the drive of a scenario cannot be driven again; empty: it can. Laser and camera have to run for whole
/// seconds, because the devices' seconds are counted on, and there must be no faults, whose times are those of one
/// drive.
std::string cannot_be_driven_again(const Scenario& scenario);

/// One lap, and what the devices have sent before it.
struct Lap {
  Drive drive;
  SentBefore before;
};

/// Returns one of `laps` laps. The first has the time before laser and camera begin too, the last the time after they
/// end. The camera keeps its rate from one lap to the next: where a lap has no image left, its first ones are sent
/// again. What lies across a lap's end is left out. The only lap of one is the drive as it is. The drive has solutions.
Lap lap_of(const Scenario& scenario, const Drive& drive, std::uint32_t lap, std::uint32_t laps);

/// Timelines that follow one another in one drive time. Thread safety: none.
class Laps {
 public:
  /// Returns the timeline of the given lap.
  using Build = std::function<Result<Timeline>(std::uint32_t lap)>;
  Laps(std::uint32_t count, Build build) : count_(count), build_(std::move(build)) {}

  /// Returns the next lap; null after the last. What a device sends late, after its lap has ended, is among the next
  /// lap's events. Errors: those of `build`.
  Result<std::shared_ptr<const Timeline>> next();

 private:
  const std::uint32_t count_;
  const Build build_;
  std::uint32_t next_ = 0;
  std::vector<WireEvent> late_;  ///< events of the laps before
};

}  // namespace hueline::sim
