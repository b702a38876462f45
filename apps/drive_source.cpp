#include "apps/drive_source.hpp"

#include "apps/simulated_recording.hpp"
#include "apps/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"

namespace hueline::apps {

Result<DriveSource> DriveSource::open(const std::string& recording, const std::string& scenario, const std::string& cache, const std::string& rig_file) {
  DriveSource out;
  if (!recording.empty()) {
    auto opened = Recording::open(recording, rig_file);
    if (!opened.ok()) return opened.error();
    out.rig = opened->rig;
    out.recording = std::move(*opened);
    return out;
  }
  out.scenario = config::load_scenario(scenario);
  auto drive = sim::generate(*out.scenario, cache);
  if (!drive.ok()) return drive.error();
  out.drive = std::move(*drive);
  out.rig = rig_file.empty() ? config::parse_rig(simulated_rig(*out.scenario, {}, "lens"), "simulated rig") : config::load_rig(rig_file);
  return out;
}

Status DriveSource::feed(const std::function<bool(const Packet&)>& use) {
  if (recording) return recording->for_each(use);
  const auto timeline = sim::scenario_timeline(*scenario, *drive);
  if (!timeline.ok()) return timeline.error();
  return for_each_simulated_packet(*drive, timeline->timeline, rig, use);
}

}  // namespace hueline::apps
