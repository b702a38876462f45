#include "apps/simulate/drive_options.hpp"

#include "config/section.hpp"

namespace hueline::apps {

void DriveOptions::declare(Command& command, const Words& words) {
  command.option(words.recording, recording, words.recording_help);
  if (words.needs_scenario) {
    command.required("--scenario", scenario, "the scenario that was driven (YAML)");
    command.required("--sim", cache, "folder of simulated drives (simulate --out)");
  } else {
    command.option(
        "--scenario", scenario,
        "a simulated drive instead of a recording; a calibration prints the difference from the truth as well");
    command.option("--sim", cache, "with --scenario: folder of simulated drives");
  }
  command.option("--rig", rig, words.rig_help);
  command.reads(recording).reads(scenario).reads(rig);
}

void DriveOptions::check() const {
  if (recording.empty() == scenario.empty())
    throw config::ConfigError("give either a recording (drive.mcap) or --scenario with --sim");
  if (!scenario.empty() && cache.empty()) throw config::ConfigError("give --sim with --scenario");
}

}  // namespace hueline::apps
