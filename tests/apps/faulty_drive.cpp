#include "tests/apps/faulty_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "apps/simulate/point_claim.hpp"
#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "core/geodesy.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/recording.hpp"
#include "sim/generate.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::test {
namespace {

// The images are small and the returns are few, but every packet, pulse and solution of a drive comes at full rate. The
// UTC hour turns in the middle of the faults' time.
constexpr const char* kScenario = R"(
seed: 11
duration_s: 9
lead_in_s: 10
start_time_of_week_s: 302404
street: {furnished: false}
drive: {stand_s: 0.4, accelerate_s: 1.6, brake_s: 1, halt_s: 0.2}
ins: {rate_hz: 100}
laser: {dropout_probability: 0.95}
camera: {rate_hz: 10, lens_width: 64, lens_height: 54, antialias: false}
wheel: {rate_hz: 50}
)";

constexpr std::int64_t kBlock_ns = 110'592;     // of a VLP-16
constexpr std::size_t kQueueBytes = 2'000'000;  // holds two seconds of this drive
constexpr double kSigmas = 5, kSlackUs = 20;
constexpr double kPlaceSlack_m = 0.3;
constexpr double kPixelLimit = 45;    // of 8000 columns: 2 degrees
constexpr double kPixelWidth = 0.03;  // of a lens's picture, rad
constexpr double kPixelsPerRadian = 8000 / 6.283185307179586;

class Watcher : public runtime::Summary {
 public:
  Watcher(std::vector<std::string> sensors, const sim::Drive& drive, const sim::Judge& judge,
          std::map<std::uint64_t, const sim::WireEvent*> events, FaultyOutcome& out)
      : runtime::Summary(std::move(sensors)), drive_(drive), judge_(judge), events_(std::move(events)), out_(out) {}

  void on_laser(const StampedLaserBatch& batch) override {
    ++out_.batches;
    const sim::WireEvent* event = events_.at(batch.packet_sequence);
    if (event->channel != sim::WireChannel::LaserData || event->number >= drive_.laser.size()) {
      ++out_.strange_batches;
      return;
    }
    // A second batch of a packet has the blocks behind a jump of the azimuth.
    std::int64_t truth = drive_.laser[event->number].first_firing_gps_ns;
    if (out_.laser.contains(event->number))
      truth +=
          std::clamp<std::int64_t>(
              std::llround(static_cast<double>(count_ns(batch.time) - truth) / static_cast<double>(kBlock_ns)), 1, 11) *
          kBlock_ns;
    const FaultyOutcome::Stamp stamp =
        compare("packet", event->number, count_ns(batch.time), truth, batch.sigma, batch.state, out_.wrong_laser);
    out_.laser[event->number] = stamp;
  }

  void on_wheel(const StampedWheelSpeed& wheel) override {
    // The time is the middle of the control unit's cycle of 20 ms. It follows from the end of the frame.
    const double error_us = static_cast<double>(count_ns(wheel.time) + 10'000'000 - drive_.begin_gps_ns -
                                                (wheel.wheel.received - apps::kSimulatedHostBegin).count()) *
                            1e-3;
    ++out_.wheels;
    out_.largest_wheel_error_us = std::max(out_.largest_wheel_error_us, std::abs(error_us));
  }

  void on_exposure(const Exposure& exposure) override {
    runtime::Summary::on_exposure(exposure);
    if (exposure.timing == ExposureTiming::Unmatched) {
      ++out_.unmatched_exposures;
      return;
    }
    const sim::WireEvent* event = events_.at(exposure.image.packet_sequence);
    const sim::CameraExposure& truth = drive_.exposures.at(event->number);
    out_.exposures[event->number] = compare("exposure", event->number, count_ns(exposure.exposure_mid),
                                            truth.exposure_start_gps_ns + truth.exposure_ns / 2, exposure.sigma,
                                            exposure.state, out_.wrong_exposures);
    // The colours are those of the picture that the exposure brings, whatever its number is.
    for (const sim::CameraExposure& e : drive_.exposures)
      if (e.image_file == event->image_file) picture_of_[exposure.index] = e.number;
  }

  void on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override {
    runtime::Summary::on_cloud(block, trajectory);
    const auto T_ecef_enu = ecef_from_enu(block.origin);
    for (const ColouredPoint& point : block.points) {
      const auto tenth =
          static_cast<std::int64_t>(std::floor(static_cast<double>(count_ns(point.time) - drive_.begin_gps_ns) * 1e-8));
      if (tenth < 0 || static_cast<std::size_t>(tenth) >= out_.tenths.size()) continue;
      FaultyOutcome::Tenth& counts = out_.tenths[static_cast<std::size_t>(tenth)];
      ++counts.points;
      if (point.exposure == kNoExposure) continue;
      ++counts.coloured;
      const auto picture = picture_of_.find(point.exposure);
      if (picture == picture_of_.end()) continue;
      const auto verdict = judge_.judge(apps::claim_of(point, T_ecef_enu, picture->second, false));
      if (!verdict) continue;
      ++counts.judged;
      out_.largest_place_error_m = std::max(out_.largest_place_error_m, verdict->place_error_m);
      if (verdict->place_error_m > kSigmas * static_cast<double>(point.sigma_m) + kPlaceSlack_m) ++counts.misplaced;
      // If the place of a point is known to be uncertain, its pixel is uncertain too.
      const double seen_under =
          kSigmas * static_cast<double>(point.sigma_m) / std::max(0.5, verdict->distance_m) * kPixelsPerRadian;
      if (verdict->error_px > kPixelLimit + seen_under) ++counts.wrong_pixel;
    }
  }

  void on_fault(const Fault& fault) override {
    runtime::Summary::on_fault(fault);
    out_.told[fault.kind] += fault.count;
    if (fault.kind == FaultKind::Lost) out_.told_lost[fault.sensor] += fault.count;
    out_.faults.push_back(fmt::format("{:9.3f} s  {} x{} of sensor {}: {}",
                                      static_cast<double>((fault.time - apps::kSimulatedHostBegin).count()) * 1e-9,
                                      hueline::name(fault.kind), fault.count, fault.sensor, fault.detail));
  }

 private:
  FaultyOutcome::Stamp compare(const char* what, std::uint32_t number, std::int64_t stamped, std::int64_t truth,
                               nanoseconds sigma, SyncState state, std::uint64_t& wrong) {
    FaultyOutcome::Stamp out{static_cast<double>(stamped - truth) * 1e-3, static_cast<double>(sigma.count()) * 1e-3,
                             state == SyncState::Locked};
    if (std::abs(out.error_us) > kSigmas * out.sigma_us + kSlackUs) {
      ++wrong;
      if (out_.wrong_stamps.size() < 12)
        out_.wrong_stamps.push_back(fmt::format("{} {} at {:.4f} s is {:.1f} us off, sigma {:.1f} us, {}", what, number,
                                                static_cast<double>(truth - drive_.begin_gps_ns) * 1e-9, out.error_us,
                                                out.sigma_us, hueline::name(state)));
    }
    return out;
  }

  const sim::Drive& drive_;
  const sim::Judge& judge_;
  const std::map<std::uint64_t, const sim::WireEvent*> events_;
  FaultyOutcome& out_;
  std::map<std::uint32_t, std::uint32_t> picture_of_;
};

template <class T>
T require(Result<T> result, const char* what) {
  if (!result.ok()) throw std::runtime_error(std::string(what) + ": " + result.error().message);
  return std::move(*result);
}

}  // namespace

FaultyOutcome::Tenth FaultyOutcome::sum(double from_s, double to_s) const {
  Tenth out;
  for (std::size_t i = 0; i < tenths.size(); ++i) {
    const double at = 0.1 * static_cast<double>(i) + 0.05;
    if (at < from_s || at >= to_s) continue;
    out.points += tenths[i].points;
    out.coloured += tenths[i].coloured;
    out.judged += tenths[i].judged;
    out.misplaced += tenths[i].misplaced;
    out.wrong_pixel += tenths[i].wrong_pixel;
  }
  return out;
}

FaultyDrive& FaultyDrive::shared() {
  static FaultyDrive drive;
  return drive;
}

FaultyDrive::FaultyDrive() {
  scenario_ = config::parse_scenario(kScenario, "the faulty drive");
  const std::string cache = (std::filesystem::temp_directory_path() / "hueline-faulty-drive").string();
  drive_ = require(sim::generate(scenario_, cache), "rendering");
  apps::SimulatedAddresses nowhere;
  nowhere.pps_socket = "/nowhere/pps.sock";
  rig_ = config::parse_rig(apps::simulated_rig(scenario_, nowhere, "lens"), "simulated rig");
  sim::Judge::Config judge;
  judge.match_ns = 3'000;  // a point that was given another time has no truth of its own
  judge_ = std::make_unique<sim::Judge>(
      require(sim::Judge::open(scenario_, drive_.cache_dir + "/truth.bin", judge), "truth"));
}

sim::FaultyTimeline FaultyDrive::timeline(const std::vector<sim::FaultLine>& lines) const {
  sim::TimelineConfig config;
  config.seed = scenario_.seed;
  config.laser_model = scenario_.laser.model;
  sim::FaultyTimeline spoilt = require(sim::build_faulty_timeline(drive_, config, lines), "timeline");
  // Keeps what the rig asks its receiver for: one kind of solution, not all that the simulator offers.
  std::erase_if(spoilt.timeline.events, [](const sim::WireEvent& event) {
    const auto id = static_cast<sim::NovatelId>(event.log.id);
    return event.channel == sim::WireChannel::Pos &&
           (id == sim::NovatelId::Inspvas || id == sim::NovatelId::Inspvax || id == sim::NovatelId::Insstdevs ||
            id == sim::NovatelId::Mark1Pva);
  });
  return spoilt;
}

RecordedOutcome FaultyDrive::record(const std::vector<sim::FaultLine>& lines,
                                    const std::function<void(const std::filesystem::path&)>& before_reading) const {
  const sim::FaultyTimeline spoilt = timeline(lines);
  const TemporaryFolder folder;
  const auto file = folder / "drive.mcap";
  sim::FaultyDisk disk(lines, scenario_.seed);
  RecordedOutcome out;
  out.capture =
      require(apps::capture_on_faulty_disk(drive_, spoilt.timeline, rig_, disk, file, kQueueBytes), "capture");
  if (before_reading) before_reading(file);
  apps::RecoveredRecording recovered =
      require(apps::judge_recording(out.capture, file, drive_, spoilt.timeline, rig_, 1), "reading back");
  out.facts = recovered.facts;
  // The replay runs as in `hueline replay`.
  runtime::Recording recording = require(runtime::Recording::open(file.string()), "opening");
  apps::CloudPrint cloud;
  apps::CloudPrintSink sink(cloud);
  runtime::Pipeline pipeline(recording.rig, 2, sink);
  (void)recording.for_each([&](const Packet& packet) {
    pipeline.process(packet);
    return true;
  });
  pipeline.flush();
  out.facts.is_same_cloud = cloud == recovered.cloud && cloud.points() > 0;
  return out;
}

FaultyOutcome FaultyDrive::run(const std::vector<sim::FaultLine>& lines, const Enter& enter) const {
  const sim::FaultyTimeline spoilt = timeline(lines);
  FaultyOutcome out;
  out.hits = spoilt.hits;
  const std::size_t sent = timeline({}).timeline.events.size();
  out.missing = sent - std::min(sent, spoilt.timeline.events.size());
  out.tenths.resize(static_cast<std::size_t>(kSensorsEnd * 10) + 20);
  std::map<std::uint64_t, const sim::WireEvent*> events;
  std::uint64_t sequence = 0;
  for (const sim::WireEvent& event : spoilt.timeline.events) {
    const std::size_t pieces =
        event.piece_bytes > 0 ? (event.payload.size() + event.piece_bytes - 1) / event.piece_bytes : 1;
    events[sequence] = &event;
    sequence += std::max<std::size_t>(1, pieces) + (event.missing_packets > 0 ? 1 : 0);
    out.images += event.channel == sim::WireChannel::Camera ? 1 : 0;
  }
  Watcher watcher(rig_.sensor_names(), drive_, *judge_, std::move(events), out);
  // A pixel of this drive's lenses is four cells of the usual maps wide. Maps of all exposures in cells of its own
  // width take half of the time that these runs take.
  config::Rig rig = rig_;
  rig.colouring.visibility.depth.cell = rig.colouring.visibility.beam_cell = kPixelWidth;
  runtime::Pipeline pipeline(rig, 1, watcher);
  std::vector<std::uint64_t> received(rig_.sensors.size() + 1);
  const auto process = [&](const Packet& packet) {
    watcher.on_packet(packet);
    pipeline.process(packet);
  };
  const Status done = apps::for_each_simulated_packet(drive_, spoilt.timeline, rig_, [&](const Packet& packet) {
    if (packet.kind == PacketKind::Wire) received[packet.sensor] += packet.bytes.size();
    if (enter)
      enter(packet, process);
    else
      process(packet);
    return true;
  });
  if (!done.ok()) throw std::runtime_error(done.error().message);
  pipeline.flush();
  pipeline.report(watcher);
  const auto report = watcher.json();
  // Whatever the fault was, each return is a point or is counted with its reason.
  std::uint64_t told_returns = report.at("points").at("total").get<std::uint64_t>();
  for (const auto& [reason, count] : report.at("points").at("not_placed").items())
    told_returns += count.get<std::uint64_t>();
  if (told_returns != report.at("points").at("returns").get<std::uint64_t>())
    throw std::runtime_error("returns without a word: " + report.at("points").dump());
  for (const auto& sensor : rig_.sensors) {
    const auto& decoded = report.at("sensors").at(sensor.id).at("decoded");
    out.bytes[sensor.name] = {received[sensor.id], decoded.at("decoded_bytes").get<std::uint64_t>() +
                                                       decoded.at("ignored_bytes").get<std::uint64_t>() +
                                                       decoded.at("malformed_bytes").get<std::uint64_t>()};
  }
  return out;
}

const FaultyOutcome& FaultyDrive::clean() {
  if (!clean_) clean_ = std::make_unique<FaultyOutcome>(run({}));
  return *clean_;
}

}  // namespace hueline::test
