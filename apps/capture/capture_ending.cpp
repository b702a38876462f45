#include "apps/capture/capture_ending.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::apps {

void log_missing_packets(const config::Rig& rig, const runtime::LiveRun& run, bool is_cut) {
  for (const auto& sensor : rig.sensors) {
    const auto counts = run.ingest().counts(sensor.id);
    if (counts.shed)
      log_warning("{}: {} packets recorded but not fused: the pipeline was too slow; a replay fuses the same points",
                  sensor.name, counts.shed);
    if (counts.refused && run.recording().ok())
      log_error("{}: {} packets neither recorded nor fused: {}", sensor.name, counts.refused,
                is_cut ? "the disk was too slow, or they came while it ended at once" : "the disk was too slow");
  }
}

Status recorded_part(const runtime::LiveRun& run) {
  const Status recorded = run.recording();
  if (recorded.ok()) return {};
  return Error{recorded.error().code,
               fmt::format("recording ended early: {}; drive.mcap holds the first {} packets, whole; the {} after them "
                           "are lost",
                           recorded.error().message, run.packets_recorded(), run.packets_lost_at_the_end())};
}

void summarise(const Ending& ending, bool was_in_place, const config::Rig& rig, const runtime::LiveRun& run,
               runtime::Summary& summary) {
  // A replay sees the packets that were shed in the recording.
  for (std::size_t sensor = 0; sensor <= rig.sensors.size(); ++sensor)
    summary.on_shed(static_cast<SensorId>(sensor), run.ingest().shed(static_cast<SensorId>(sensor)));
  if (!ending.recorded.ok())
    summary.on_fault({kSystemSensor, FaultKind::DiskFull, drivers::host_now(), run.packets_lost_at_the_end(),
                      ending.recorded.error().message});
  if (was_in_place && !ending.place.ok())
    summary.on_fault({kSystemSensor, FaultKind::DiskFull, drivers::host_now(), run.packets_recorded(),
                      ending.place.error().message});
  if (ending.is_cut) summary.on_early_end("ended at once: a replay of drive.mcap makes cloud, view and summary whole");
}

std::string replay_of(const std::string& recording) {
  return fmt::format("hueline replay {0} --out {0}", std::filesystem::path(recording).parent_path().string());
}

int status_of_files(const Ending& ending, const runtime::LiveRun& run, const std::string& recording) {
  if (!ending.recorded.ok()) {
    log_error(ending.recorded.error().message);
    return kOutputRefused;
  }
  if (!ending.place.ok()) {
    log_error(
        "{} is not the recording of this drive: it was deleted, moved or replaced meanwhile; what was deleted is lost",
        recording);
    return kOutputRefused;
  }
  if (!ending.finished.ok()) {
    log_error("{}; the raw recording is whole: {}", ending.finished.error().message, replay_of(recording));
    return kOutputRefused;
  }
  if (!ending.is_cut) return kDone;
  log_warning("ended at once: {} is whole{}; cloud.las, view.mcap and summary.json end early: {}", recording,
              run.packets_left_behind()
                  ? fmt::format(" but for {} packets that waited for the disk", run.packets_left_behind())
                  : "",
              replay_of(recording));
  return kStopped;
}

int status_of_sources(const runtime::LiveRun& run, const runtime::Summary& summary, const std::string& recording) {
  int status = kDone;
  for (const auto& reader : run.readers()) {
    if (reader->outcome().ok()) continue;
    log_error("{}: {}; everything that was whole before it is recorded and used", reader->sensor_name(),
              reader->outcome().error().message);
    status = kInputUnreadable;
  }
  if (status != kDone) return status;
  if (summary.wire_packets() == 0) {
    log_error(
        "nothing came from any sensor: see the faults above; check that the devices are on and that the rig has their "
        "addresses");
    return kNothingCame;
  }
  if (summary.points() == 0) {
    log_warning("no point could be placed: the summary above says why; {} holds everything that came", recording);
    return kNothingCame;
  }
  return summary.verdict() && summary.verdict()->grade == runtime::Grade::Again ? kDriveAgain : kDone;
}

}  // namespace hueline::apps
