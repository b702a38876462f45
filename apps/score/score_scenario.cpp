#include "apps/score/score_scenario.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/score/score_recording.hpp"
#include "apps/score/score_sink.hpp"
#include "apps/score/sink_group.hpp"
#include "apps/score/view_judges.hpp"
#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "fusion/sight_judge.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/recording.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"

namespace hueline::apps {
namespace {

using Clock = std::chrono::steady_clock;
using Devices = std::map<SensorId, score::DeviceBytes>;

/// Returns for each camera event, in order, the true exposure that its image shows. Faults may send an image again with
/// any number.
std::vector<std::uint32_t> pictures(const sim::Drive& drive, const sim::Timeline& timeline) {
  std::map<std::string, std::uint32_t> number_of_file;
  for (const auto& exposure : drive.exposures) number_of_file[exposure.image_file] = exposure.number;
  std::vector<std::uint32_t> out;
  constexpr std::uint32_t kOfNoExposure = 0xFFFFFFFFu;
  for (const auto& event : timeline.events) {
    if (event.channel != sim::WireChannel::Camera) continue;
    const auto found = number_of_file.find(event.image_file);
    out.push_back(found == number_of_file.end() ? kOfNoExposure : found->second);
  }
  return out;
}

/// Counts the units of a channel that arrive. Laser packets and images count by their numbers, so that a copy does not
/// count; all other units count one by one.
std::uint64_t arrived(const sim::Timeline& timeline, sim::WireChannel channel) {
  std::set<std::uint32_t> numbers;
  std::uint64_t count = 0;
  for (const auto& event : timeline.events) {
    if (event.channel != channel || (channel == sim::WireChannel::Pos && event.log.id == 0)) continue;
    if (event.number == sim::kNoUnit) continue;
    ++count;
    numbers.insert(event.number);
  }
  return channel == sim::WireChannel::LaserData || channel == sim::WireChannel::Camera ? numbers.size() : count;
}

/// `sent` is the timeline without its faults.
void count_units(const sim::Timeline& sent, const sim::Timeline& received, const config::Rig& rig, Devices& devices) {
  const auto sensors = sensors_of_channels(rig);
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const auto channel = static_cast<sim::WireChannel>(i);
    score::DeviceBytes& device = devices[sensors[i]];
    const std::uint64_t there = arrived(sent, channel), here = arrived(received, channel);
    device.sent_units += there;
    device.missing_units += there > here ? there - here : 0;
    for (const auto& event : sent.events)
      if (event.channel == channel) device.sent_bytes += event.payload.size() + std::size_t{event.width} * event.height;
  }
}

/// Images that the camera never made do not count as lost on the way.
void forgive_unmade_images(const sim::Scenario& scenario, const std::vector<std::size_t>& hits,
                           score::DeviceBytes& camera) {
  for (std::size_t i = 0; i < scenario.faults.size(); ++i) {
    const sim::FaultType type = scenario.faults[i].type;
    if (type != sim::FaultType::ImageMissed && type != sim::FaultType::CameraDisconnect) continue;
    camera.missing_units -= std::min<std::uint64_t>(camera.missing_units, hits[i]);
  }
}

std::map<std::string, score::DeviceBytes> account(const config::Rig& rig, const runtime::Pipeline& pipeline,
                                                  Devices devices, const std::map<SensorId, std::uint64_t>& told_lost) {
  std::map<std::string, score::DeviceBytes> out;
  for (const auto& sensor : rig.sensors) {
    score::DeviceBytes& device = devices[sensor.id];
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

/// A temporary folder for a recording that nobody keeps.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& parent)
      : path_((std::filesystem::path(parent) / "recorded.XXXXXX").string()) {
    if (::mkdtemp(path_.data()) == nullptr) path_.clear();
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
};

/// A drive as a computer with the scenario's faults recorded it.
struct Recorded {
  SimulatedCapture capture;
  RecoveredRecording recovered;
  runtime::Recording recording;
};

Result<Recorded> record(const sim::Scenario& scenario, const sim::Drive& drive, const sim::Timeline& timeline,
                        const config::Rig& rig, int threads, const std::filesystem::path& file) {
  sim::FaultyDisk disk(scenario.faults, scenario.seed);
  auto capture = capture_on_faulty_disk(drive, timeline, rig, disk, file);
  if (!capture.ok()) return capture.error();
  auto recovered = judge_recording(*capture, file, drive, timeline, rig, threads);
  if (!recovered.ok()) return recovered.error();
  auto recording = runtime::Recording::open(file.string());
  if (!recording.ok()) return recording.error();
  return Recorded{std::move(*capture), std::move(*recovered), std::move(*recording)};
}

/// Takes note of the drifts that the watch over mounting and times reports. Nothing else doubts a camera.
class DriftReports : public runtime::ProductSink {
 public:
  DriftReports(SensorId camera, bool is_watched) : camera_(camera), is_watched_(is_watched) {}
  void on_fault(const Fault& fault) override {
    if (fault.kind == FaultKind::Implausible && fault.sensor == camera_)
      told_s_.push_back(to_seconds(fault.time - kSimulatedHostBegin));
  }
  void report(const sim::Scenario& scenario, score::ScenarioScore& score) const {
    if (!is_watched_) return score::add_unwatched_drift_figures(score);
    const sim::HeadDriftConfig& drift = scenario.camera.drift;
    score::add_drift_figures(told_s_, drift.is_there() ? std::optional(scenario.lead_in_s + drift.at_s) : std::nullopt,
                             score);
  }

 private:
  const SensorId camera_;
  const bool is_watched_;
  std::vector<double> told_s_;  // since the beginning of the drive
};

/// The pipeline with its sink, as the packets of a simulated drive come to it.
class ScoredPipeline {
 public:
  /// The images of the sensor `camera` show the true exposures `numbers`, in this order. `scorer` and `others` must
  /// outlive this object.
  ScoredPipeline(score::Scorer& scorer, const std::vector<runtime::ProductSink*>& others, const config::Rig& rig,
                 int threads, GpsTime drive_begin, SensorId camera, std::vector<std::uint32_t> numbers)
      : sink_(scorer, rig, drive_begin),
        sinks_(with(others, sink_)),
        pipeline_(rig, threads, sinks_),
        camera_(camera),
        numbers_(std::move(numbers)) {}

  /// Takes note of a packet that came to the computer. Call this for all of them, in order, each before process().
  void announce(PacketKind kind, SensorId sensor, std::uint64_t sequence) {
    if (kind == PacketKind::Wire && sensor == camera_) sink_.set_image(sequence, numbers_[images_++]);
  }
  void process(const Packet& packet) {
    sink_.set_now(packet.received);
    const auto began = Clock::now();
    pipeline_.process(packet);
    inside_ += Clock::now() - began;
  }
  /// Ends the stream.
  void finish() {
    sink_.set_now({});
    const auto began = Clock::now();
    pipeline_.flush();
    inside_ += Clock::now() - began - sinks_.spent();
    sink_.finish();
  }

  const ScoreSink& sink() const { return sink_; }
  const runtime::Pipeline& pipeline() const { return pipeline_; }
  /// Returns the time that the pipeline took, without that of the sinks.
  double seconds() const { return std::chrono::duration<double>(inside_).count(); }

 private:
  static std::vector<runtime::ProductSink*> with(std::vector<runtime::ProductSink*> sinks, ScoreSink& sink) {
    sinks.insert(sinks.begin(), &sink);
    return sinks;
  }

  ScoreSink sink_;
  SinkGroup sinks_;
  runtime::Pipeline pipeline_;
  const SensorId camera_;
  const std::vector<std::uint32_t> numbers_;
  std::size_t images_ = 0;
  Clock::duration inside_{0};
};

/// Records the drive on a disk with the scenario's faults, and calls `use` with the packets that are read back from it.
/// Announces all packets that came. Errors: those of record(); Io if the recording cannot be read.
Result<RecoveredRecording> feed_from_disk(const sim::Scenario& scenario, const sim::Drive& drive,
                                          const sim::Timeline& timeline, const config::Rig& rig, int threads,
                                          const std::string& cache, ScoredPipeline& pipeline,
                                          const std::function<bool(const Packet&)>& use) {
  const ScratchFolder folder(cache);
  if (folder.path().empty()) return io_error("make a folder in " + cache, errno);
  auto recorded = record(scenario, drive, timeline, rig, threads, folder.path() / "drive.mcap");
  if (!recorded.ok()) return recorded.error();
  for (const auto& packet : recorded->capture.packets) pipeline.announce(packet.kind, packet.sensor, packet.sequence);
  // The way in which the recording ends is among its figures, so that only Io is an error here.
  if (const Status read = recorded->recording.for_each(use); !read.ok() && read.error().code == ErrorCode::Io)
    return read.error();
  return std::move(recorded->recovered);
}

}  // namespace

Result<ScoredRun> score_scenario(const sim::Scenario& scenario, const std::string& name, const std::string& cache,
                                 std::size_t ray_returns, int threads, const ScoreProgress& progress,
                                 const std::string& sights_file) {
  sim::GenerateOptions options;
  options.threads = static_cast<unsigned>(threads);
  const auto drive = sim::generate(
      scenario, cache, [&](const std::string& stage, double share) { progress(name + ": rendering " + stage, share); },
      options);
  if (!drive.ok()) return drive.error();
  // This is what the devices sent. A solution that the POS does not give out was never sent.
  sim::Scenario faultless = scenario;
  std::erase_if(faultless.faults, [](const sim::FaultLine& line) { return line.type != sim::FaultType::PosGap; });
  const auto sent = sim::scenario_timeline(faultless, *drive), spoilt = sim::scenario_timeline(scenario, *drive);
  if (!sent.ok() || !spoilt.ok()) return !sent.ok() ? sent.error() : spoilt.error();
  const sim::Timeline& timeline = spoilt->timeline;
  const config::Rig rig = config::parse_rig(simulated_rig(scenario, {}, "lens"), "simulated rig");
  auto scorer = score::Scorer::open(
      scenario, drive->cache_dir,
      {.ray_returns = ray_returns, .seed = 1, .neighbours = rig.colouring.neighbours, .threads = threads});
  if (!scorer.ok()) return scorer.error();
  if (!sights_file.empty()) scorer->keep_sights();

  Devices devices;
  count_units(sent->timeline, timeline, rig, devices);
  const SensorId camera = sensors_of_channels(rig)[static_cast<std::size_t>(sim::WireChannel::Camera)];
  forgive_unmade_images(scenario, spoilt->hits, devices[camera]);
  ViewJudges views(rig, threads, score::encoding_of(scenario));
  DriftReports drifts(camera, rig.watch.images_per_s > 0);
  std::vector<runtime::ProductSink*> sinks = views.sinks();
  sinks.push_back(&drifts);
  ScoredPipeline pipeline(*scorer, sinks, rig, threads, gps_time_ns(drive->begin_gps_ns), camera,
                          pictures(*drive, timeline));
  const auto use = [&](const Packet& packet) {
    if (packet.sequence % 512 == 0)
      progress(name + ": colouring",
               std::min(1.0, static_cast<double>(packet.sequence) / static_cast<double>(timeline.events.size())));
    devices[packet.sensor].received_bytes += packet.kind == PacketKind::Wire ? packet.bytes.size() : 0;
    pipeline.process(packet);
    return true;
  };
  const auto is_of_disk = [](const sim::FaultLine& line) { return sim::FaultyDisk::concerns(line.type); };
  std::optional<RecoveredRecording> recovered;
  if (std::any_of(scenario.faults.begin(), scenario.faults.end(), is_of_disk)) {
    progress(name + ": recording", 0);
    auto read_back = feed_from_disk(scenario, *drive, timeline, rig, threads, cache, pipeline, use);
    if (!read_back.ok()) return read_back.error();
    recovered = std::move(*read_back);
  } else {
    const Status fed = for_each_simulated_packet(*drive, timeline, rig, [&](const Packet& packet) {
      pipeline.announce(packet.kind, packet.sensor, packet.sequence);
      return use(packet);
    });
    if (!fed.ok()) return fed.error();
  }
  pipeline.finish();

  ScoredRun run;
  run.cloud = pipeline.sink().cloud();
  std::optional<score::RecordingFacts> facts;
  if (recovered) {
    facts = recovered->facts;
    facts->is_same_cloud = recovered->cloud == run.cloud;
  }
  run.score = scorer->finish(name, account(rig, pipeline.pipeline(), devices, pipeline.sink().told_lost()),
                             [&](double share) { progress(name + ": casting rays", share); });
  if (!sights_file.empty())
    if (Status written = scorer->write_sights(sights_file, fusion::kEvidenceWords); !written.ok())
      return written.error();
  score::add_recording_figures(facts, run.score);
  views.report(run.score);
  drifts.report(scenario, run.score);
  run.score.figures["realtime_factor"] = {scenario.duration_s / pipeline.seconds(), {}};
  run.score.figures["points_per_second"] = {static_cast<double>(run.cloud.points()) / pipeline.seconds(), {}};
  return run;
}

}  // namespace hueline::apps
