// Wheels that turn otherwise than the vehicle moves, and faults of their bus.
#include <algorithm>
#include <cmath>

#include "sim/faults/stages.hpp"
#include "sim/wire/can_encode.hpp"

namespace hueline::sim {

bool concerns_wheels(FaultType type) { return type == FaultType::WheelStuck || type == FaultType::WheelSlip; }

std::size_t spoil_wheels(const FaultLine& line, Drive& drive) {
  if (!concerns_wheels(line.type)) return 0;
  std::size_t hits = 0;
  const WheelSample* before = nullptr;  // the previous sample without the fault
  WheelSample kept;
  std::array<double, 4> stuck{};  // the last speeds before the fault
  std::array<double, 2> added{};  // pulses too many (or too few) so far
  for (WheelSample& sample : drive.wheel) {
    const WheelSample truth = sample;
    if (line.covers(sample.gps_ns - drive.begin_gps_ns)) {
      ++hits;
      const double factor = line.type == FaultType::WheelSlip ? line.strength : 0;
      for (std::size_t wheel = 0; wheel < 4; ++wheel)
        sample.speed[wheel] = line.type == FaultType::WheelSlip ? factor * truth.speed[wheel] : stuck[wheel];
      if (before)
        for (std::size_t side = 0; side < 2; ++side)
          added[side] +=
              (factor - 1) * (static_cast<double>(truth.pulses[side]) - static_cast<double>(before->pulses[side]));
    } else {
      stuck = truth.speed;
    }
    // The sensors keep counting from the wrong count.
    for (std::size_t side = 0; side < 2; ++side)
      sample.pulses[side] =
          static_cast<std::uint32_t>(std::max(0.0, std::round(static_cast<double>(truth.pulses[side]) + added[side])));
    kept = truth;
    before = &kept;
  }
  return hits;
}

std::size_t spoil_bus(const FaultLine& line, std::vector<WireEvent>& events) {
  if (line.type != FaultType::CanBusOff) return 0;
  const std::size_t hits = std::erase_if(
      events, [&](const WireEvent& e) { return e.channel == WireChannel::Wheel && line.covers(e.at_ns); });
  for (const bool is_end : {false, true}) {
    WireEvent event;
    event.channel = WireChannel::Wheel;
    event.at_ns = is_end ? line.end_ns() : line.begin_ns();
    event.payload = is_end ? encode_bus_restarted() : encode_bus_off();
    event.number = kNoUnit;
    events.push_back(std::move(event));
  }
  sort_by_time(events);
  return hits + 1;
}

}  // namespace hueline::sim
