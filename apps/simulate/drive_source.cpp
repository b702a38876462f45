#include "apps/simulate/drive_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "runtime/pipeline.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"

namespace hueline::apps {

Result<DriveSource> DriveSource::open(const DriveOptions& options, ProgressBar& bar, const std::string& method) {
  DriveSource out;
  if (!options.scenario.empty()) {
    out.scenario = config::load_scenario(options.scenario);
    auto drive = sim::generate(*out.scenario, options.cache,
                               [&](const std::string& stage, double share) { bar.show("rendering " + stage, share); });
    if (!drive.ok()) return drive.error();
    out.drive = std::move(*drive);
  }
  if (!options.recording.empty()) {
    if (options.follows) runtime::wait_for_recording(options.recording, *options.follows);
    auto opened = runtime::Recording::open(options.recording, options.rig);
    if (!opened.ok()) return opened.error();
    opened->follows = options.follows;
    out.rig = opened->rig;
    out.recording = std::move(*opened);
  } else {
    out.rig = options.rig.empty() ? config::parse_rig(simulated_rig(*out.scenario, {}, method), "simulated rig")
                                  : config::load_rig(options.rig);
  }
  return out;
}

Status DriveSource::feed(ProgressBar& bar, const std::function<bool(const Packet&)>& use) {
  if (recording) {
    std::optional<HostTime> first;
    return recording->for_each([&](const Packet& packet) {
      if (!first) first = packet.received;
      bar.show(fmt::format("reading, minute {}", 1 + static_cast<int>(to_seconds(packet.received - *first) / 60)), 0);
      return use(packet);
    });
  }
  const auto timeline = sim::scenario_timeline(*scenario, *drive);
  if (!timeline.ok()) return timeline.error();
  const double events = static_cast<double>(timeline->timeline.events.size());
  return for_each_simulated_packet(*drive, timeline->timeline, rig, [&](const Packet& packet) {
    if (packet.sequence % 512 == 0) bar.show("reading", std::min(1.0, static_cast<double>(packet.sequence) / events));
    return use(packet);
  });
}

Status DriveSource::feed_without_colours(ProgressBar& bar, config::Rig sensors, runtime::ProductSink& sink,
                                         runtime::PostTrajectory* trajectory, const std::function<bool()>& wants_more) {
  sensors.geometry.lasers.clear();  // no point is placed, so none is coloured
  runtime::Pipeline pipeline(sensors, 1, sink, trajectory);
  Status fed = feed(bar, [&](const Packet& packet) {
    pipeline.process(packet);
    return wants_more();
  });
  pipeline.flush();
  return fed;
}

}  // namespace hueline::apps
