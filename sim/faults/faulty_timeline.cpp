#include "sim/faults/faulty_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "sim/faults/stages.hpp"

namespace hueline::sim {

void sort_by_time(std::vector<WireEvent>& events) {
  std::stable_sort(events.begin(), events.end(),
                   [](const WireEvent& a, const WireEvent& b) { return a.at_ns < b.at_ns; });
}

Result<FaultyTimeline> build_faulty_timeline(const Drive& drive, const TimelineConfig& config,
                                             const std::vector<FaultLine>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (const std::string wrong = lines[i].validate(); !wrong.empty())
      return Error{ErrorCode::Invalid, fmt::format("faults[{}]: {}", i, wrong)};

  FaultyTimeline out;
  out.hits.resize(lines.size());
  Drive spoilt;
  const Drive* driven = &drive;
  if (std::any_of(lines.begin(), lines.end(),
                  [](const FaultLine& line) { return concerns_solutions(line.type) || concerns_wheels(line.type); })) {
    spoilt = drive;
    driven = &spoilt;
    for (std::size_t i = 0; i < lines.size(); ++i)
      out.hits[i] += spoil_solutions(lines[i], spoilt) + spoil_wheels(lines[i], spoilt);
  }
  Result<Timeline> built = build_timeline(*driven, config, LineErrors(lines, drive.begin_gps_ns));
  if (!built.ok()) return built.error();
  out.timeline = std::move(*built);
  auto& events = out.timeline.events;

  const auto random_of = [&](std::size_t i) { return SeededRandom(config.seed, kStreamFaultLine + i); };
  for (std::size_t i = 0; i < lines.size(); ++i) {
    out.hits[i] += LineErrors::concerns(lines[i]);
    out.hits[i] += spoil_pulses(lines[i], events, random_of(i));
    out.hits[i] += spoil_marks(lines[i], drive.begin_gps_ns, events, random_of(i));
    out.hits[i] += spoil_images(lines[i], events, random_of(i));
  }
  for (std::size_t i = 0; i < lines.size(); ++i) out.hits[i] += spoil_bus(lines[i], events);
  for (std::size_t i = 0; i < lines.size(); ++i) out.hits[i] += spoil_packets(lines[i], events, random_of(i));
  for (std::size_t i = 0; i < lines.size(); ++i) out.hits[i] += spoil_host_clock(lines[i], events);
  return out;
}

Result<FaultyTimeline> scenario_timeline(const Scenario& scenario, const Drive& drive, std::uint8_t laser,
                                         const SentBefore& before) {
  TimelineConfig config;
  config.seed = scenario.seed;
  config.laser_model = scenario.laser.model;
  config.laser = laser;
  config.before = before;
  config.strobe_jitter_ns = scenario.noise ? scenario.camera.strobe_jitter_us * 1e3 : 0;
  return build_faulty_timeline(drive, config, scenario.faults);
}

}  // namespace hueline::sim
