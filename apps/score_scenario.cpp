#include "apps/score_scenario.hpp"

#include "apps/pipeline.hpp"
#include "apps/score_sink.hpp"
#include "apps/simulated_recording.hpp"
#include "apps/simulated_rig.hpp"
#include "sim/generate.hpp"

namespace hueline::apps {
namespace {

using Clock = std::chrono::steady_clock;

/// By packet sequence, which for_each_simulated_packet() counts along the timeline: number of the exposure whose file the image is.
std::map<std::uint64_t, std::uint32_t> image_numbers(const sim::Drive& drive, const sim::Timeline& timeline) {
  std::map<std::string, std::uint32_t> number_of_file;
  for (const auto& exposure : drive.exposures) number_of_file[exposure.image_file] = exposure.number;
  std::map<std::uint64_t, std::uint32_t> out;
  for (std::size_t i = 0; i < timeline.events.size(); ++i)
    if (timeline.events[i].channel == sim::WireChannel::Camera)
      if (const auto found = number_of_file.find(timeline.events[i].image_file); found != number_of_file.end()) out[i] = found->second;
  return out;
}

std::map<std::string, score::DeviceBytes> account(const config::Rig& rig, const Pipeline& pipeline, const std::map<SensorId, score::DeviceBytes>& received,
                                                  const std::map<SensorId, std::uint64_t>& told_lost) {
  std::map<std::string, score::DeviceBytes> out;
  for (const auto& sensor : rig.sensors) {
    score::DeviceBytes device;
    if (const auto found = received.find(sensor.id); found != received.end()) device = found->second;
    if (const DecodeCounts* counts = pipeline.counts(sensor.id)) {
      device.decoded = counts->decoded_bytes;
      device.ignored = counts->ignored_bytes;
      device.malformed = counts->malformed_bytes;
    }
    if (const auto found = told_lost.find(sensor.id); found != told_lost.end()) device.told_lost = found->second;
    out[sensor.name] = device;
  }
  return out;
}

}  // namespace

Result<ScoredRun> score_scenario(const sim::Scenario& scenario, const std::string& name, const std::string& cache, int threads, const ScoreProgress& progress) {
  sim::GenerateOptions options;
  options.threads = static_cast<unsigned>(threads);
  const auto drive = sim::generate(scenario, cache, [&](const std::string& stage, double share) { progress(name + ": rendering " + stage, share); }, options);
  if (!drive.ok()) return drive.error();
  sim::TimelineConfig timeline_config;
  timeline_config.seed = scenario.seed;
  timeline_config.laser_model = scenario.laser.model;
  const auto timeline = sim::build_timeline(*drive, timeline_config);
  if (!timeline.ok()) return timeline.error();
  const config::Rig rig = config::parse_rig(simulated_rig(scenario, {}, "lens"), "simulated rig");
  auto scorer = score::Scorer::open(scenario, drive->cache_dir, {});
  if (!scorer.ok()) return scorer.error();

  ScoreSink sink(*scorer, rig, gps_time_ns(drive->begin_gps_ns), image_numbers(*drive, *timeline));
  Pipeline pipeline(rig, threads, sink);
  std::map<SensorId, score::DeviceBytes> bytes;
  Clock::duration inside{0};
  const Status fed = for_each_simulated_packet(*drive, *timeline, rig, [&](const Packet& packet) {
    if (packet.sequence % 512 == 0)
      progress(name + ": colouring", static_cast<double>(packet.sequence) / static_cast<double>(timeline->events.size()));
    score::DeviceBytes& device = bytes[packet.sensor];
    ++device.sent_units;
    ++device.received_units;
    device.sent_bytes += packet.bytes.size();
    device.received_bytes += packet.bytes.size();
    sink.set_now(packet.received);
    const auto began = Clock::now();
    pipeline.process(packet);
    inside += Clock::now() - began;
    return true;
  });
  if (!fed.ok()) return fed.error();
  sink.set_now({});
  const auto began = Clock::now();
  pipeline.flush();
  inside += Clock::now() - began - sink.spent();
  sink.finish();

  ScoredRun run;
  run.score = scorer->finish(name, account(rig, pipeline, bytes, sink.told_lost()), [&](double share) { progress(name + ": casting rays", share); });
  run.cloud = sink.fingerprint();
  run.points = sink.points();
  const double seconds = std::chrono::duration<double>(inside).count();
  run.score.figures["realtime_factor"] = {scenario.duration_s / seconds, {}};
  run.score.figures["points_per_second"] = {static_cast<double>(run.points) / seconds, {}};
  return run;
}

}  // namespace hueline::apps
