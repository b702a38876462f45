#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/progress_bar.hpp"
#include "apps/signals.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"
#include "sim/devices/player.hpp"
#include "sim/faults/clock_truth.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"
#include "sim/laps.hpp"
#include "sim/sight_file.hpp"
#include "sim/true_trajectory.hpp"

namespace hueline::apps {
namespace {

struct SimulateOptions {
  std::string scenario, out;
  std::string beside;
  std::string rig_file, method = "lens";
  double camera_link_mb_s = 0;
  int camera_packet = 9000;
  std::string clocks_file, sights_file, trajectory_file;
  bool play = false;
  double wait_s = 60;
  int laps = 1;
  SimulatedAddresses at;
};

sim::Player::Config player_config(const SimulateOptions& options, const sim::Drive& drive,
                                  const sim::Scenario& scenario) {
  sim::Player::Config config;
  config.laser->host = options.at.receiver();
  config.laser->data_port = static_cast<std::uint16_t>(options.at.data_port);
  config.laser->position_port = static_cast<std::uint16_t>(options.at.position_port);
  config.pos->address = options.at.address;
  config.pos->port = static_cast<std::uint16_t>(options.at.pos_port);
  config.pps->path = options.at.pps_socket;
  if (!drive.wheel.empty()) {
    config.wheel.emplace();
    config.wheel->interface = options.at.can_interface;
    config.wheel->host = options.at.receiver();
    config.wheel->port = static_cast<std::uint16_t>(options.at.can_port);
  }
  config.camera->interface = options.at.address;
  config.camera->serial = options.at.camera_serial;
  if (drive.exposures.empty()) {
    config.camera.reset();
  } else {
    config.camera->width = drive.exposures.front().width;
    config.camera->height = drive.exposures.front().height;
    // A compressed exposure is transported as plain bytes, and says itself how it was exposed.
    if (scenario.camera.payload == sim::ImagePayload::JpegPlanes)
      config.camera->pixel_format = "Mono8";
    else
      config.camera->reports_exposure = scenario.camera.reports_exposure;
    config.camera->max_packet_bytes = static_cast<std::uint32_t>(options.camera_packet);
    // The link has one gigabit, or ten if the images need more.
    const double bytes_per_second = scenario.camera.rate_hz * config.camera->width * config.camera->height;
    config.camera->stream.link_bytes_per_second =
        options.camera_link_mb_s > 0 ? options.camera_link_mb_s * 1e6 : (bytes_per_second < 90e6 ? 110e6 : 1180e6);
  }
  if (!options.beside.empty()) {
    config.second_laser = config.laser;
    config.second_laser->data_port = static_cast<std::uint16_t>(options.at.data_port + 1);
    config.second_laser->position_port = static_cast<std::uint16_t>(options.at.position_port + 1);
  }
  return config;
}

/// Requires that the scenarios differ in laser and camera only, because the scanner of `beside` is on the vehicle of
/// `scenario`.
void require_same_drive(const sim::Scenario& scenario, const sim::Scenario& beside) {
  const auto without_sensors = [](sim::Scenario s) {
    s.laser = {};
    s.camera = {};
    return s.text();
  };
  if (without_sensors(scenario) != without_sensors(beside))
    throw config::ConfigError(
        "--beside: the two scenarios may differ in laser and camera only, because they are one vehicle on one drive");
}

/// A drive of the vehicle, as one of its scanners saw it.
struct Rendered {
  sim::Scenario scenario;
  sim::Drive drive;
};

/// Builds what the devices send in one of `laps` laps. The devices of the first drive are the vehicle's; of the others
/// there is the scanner alone.
Result<sim::Timeline> timeline_of(const std::vector<Rendered>& drives, std::uint32_t number, std::uint32_t laps) {
  sim::Timeline all;
  for (std::uint8_t laser = 0; laser < drives.size(); ++laser) {
    const auto& [scenario, drive] = drives[laser];
    const sim::Lap lap = sim::lap_of(scenario, drive, number, laps);
    auto timeline = sim::scenario_timeline(scenario, lap.drive, laser, lap.before);
    if (!timeline.ok()) return timeline.error();
    if (laser == 0)
      all = std::move(timeline->timeline);
    else
      sim::add_laser_of(all, std::move(timeline->timeline));
  }
  return all;
}

int play(const SimulateOptions& options, const std::vector<Rendered>& drives, const std::stop_token& stop,
         ProgressBar& bar) {
  const auto& [scenario, drive] = drives.front();
  // The first lap is built before the devices are up, because building it finds what is wrong.
  const auto count = static_cast<std::uint32_t>(options.laps);
  sim::Laps laps(count, [&](std::uint32_t number) { return timeline_of(drives, number, count); });
  const Result<std::shared_ptr<const sim::Timeline>> first = laps.next();
  if (!first.ok()) {
    log_error(first.error().message);
    return kWrongUse;
  }
  const auto duration_ns =
      static_cast<double>(drive.end_gps_ns - drive.begin_gps_ns +
                          (count - 1) * (scenario.sensors_end_gps_ns() - scenario.sensors_begin_gps_ns()));
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(options.at.pps_socket).parent_path(), ignored);
  auto player = sim::Player::open(player_config(options, drive, scenario));
  if (!player.ok()) {
    log_error(player.error().message);
    return kOutputRefused;
  }
  log_info("devices are up: laser to {} udp {} and {}, POS at tcp {}, PPS at {}, camera {}; waiting for a capture",
           options.at.address, options.at.data_port, options.at.position_port, (*player)->pos_port(),
           options.at.pps_socket, options.at.camera_serial);
  if (const Status ready = (*player)->wait_until_ready(static_cast<std::int64_t>(options.wait_s * 1e9), stop);
      !ready.ok()) {
    if (ready.error().code == ErrorCode::Stopped) return kDone;
    log_error(ready.error().message);
    return kNothingCame;
  }
  bool is_first = true;
  const auto next_lap = [&] { return std::exchange(is_first, false) ? first : laps.next(); };
  const sim::PlayReport report = (*player)->run(next_lap, stop, [&](const sim::PlayProgress& progress) {
    bar.show("playing in real time", static_cast<double>(progress.drive_ns) / duration_ns);
  });
  bar.end();
  for (std::size_t i = 0; i < sim::kWireChannels; ++i) {
    const auto channel = static_cast<sim::WireChannel>(i);
    const auto& sent = report.of(channel);
    if (channel == sim::WireChannel::Wheel && drive.wheel.empty()) continue;
    std::fprintf(stdout, "%-15s %8llu sent, %llu refused, late by %.3f ms on average, %.1f ms at most\n",
                 sim::name(channel), static_cast<unsigned long long>(sent.sent),
                 static_cast<unsigned long long>(sent.failed), sent.mean_lateness_ns / 1e6,
                 static_cast<double>(sent.latest_ns) / 1e6);
  }
  std::fprintf(stdout, "%-15s %8llu sent, %llu refused, %llu sent again, %llu asked for again and gone\n",
               "camera packets", static_cast<unsigned long long>(report.camera.packets_sent),
               static_cast<unsigned long long>(report.camera.packets_failed),
               static_cast<unsigned long long>(report.camera.packets_resent),
               static_cast<unsigned long long>(report.camera.resends_refused));
  if (!report.problem.empty()) {
    log_error(report.problem);
    return kWrongUse;
  }
  return kDone;
}

/// Writes those optional files of truth that the options name.
Status write_truth(const SimulateOptions& options, const sim::Drive& drive, const sim::Scenario& scenario,
                   const sim::GenerateOptions& generation, ProgressBar& bar) {
  if (!options.clocks_file.empty()) {
    const auto timeline = sim::scenario_timeline(scenario, drive);
    if (!timeline.ok()) return timeline.error();
    if (const Status written =
            sim::write_clocks(options.clocks_file, sim::true_clocks(timeline->timeline, scenario.faults));
        !written.ok())
      return written;
  }
  if (!options.trajectory_file.empty())
    if (const Status written = sim::write_true_trajectory(scenario, drive, options.trajectory_file); !written.ok())
      return written;
  if (options.sights_file.empty()) return {};
  const Status written = sim::write_sights(
      scenario, drive, options.sights_file, [&](const std::string& stage, double share) { bar.show(stage, share); },
      generation);
  bar.end();
  return written;
}

int simulate(const SimulateOptions& options) {
  StopSignals signals;
  const sim::Scenario scenario = config::load_scenario(options.scenario);
  if (const std::string why = sim::cannot_be_driven_again(scenario); options.laps > 1 && !why.empty())
    throw config::ConfigError("--laps: " + why);
  std::optional<sim::Scenario> beside;
  if (!options.beside.empty()) {
    beside = config::load_scenario(options.beside);
    require_same_drive(scenario, *beside);
  }
  if (!options.rig_file.empty()) {
    std::error_code ignored;  // the rig may lie in it; if it cannot be made, the drive says why
    std::filesystem::create_directories(options.out, ignored);
    if (const Status written = write_output(
            options.rig_file, simulated_rig(scenario, options.at, options.method, beside ? &*beside : nullptr));
        !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
  }
  ProgressBar bar;
  sim::GenerateOptions generation;
  generation.stop = signals.asked();
  const auto made = [&](const sim::Scenario& one) {
    auto drive = sim::generate(
        one, options.out, [&](const std::string& stage, double share) { bar.show(stage, share); }, generation);
    bar.end();
    if (drive.ok()) {
      std::fprintf(stdout, "drive and truth: %s\n", drive->cache_dir.c_str());
      std::fflush(stdout);
    } else {
      log_error(drive.error().message);
    }
    return drive;
  };
  const auto status_of = [](const Error& error) {
    return error.code == ErrorCode::Invalid ? kWrongUse : error.code == ErrorCode::Stopped ? kStopped : kOutputRefused;
  };
  std::vector<sim::Scenario> scenarios{scenario};
  if (beside) scenarios.push_back(*beside);
  std::vector<Rendered> drives;
  for (const sim::Scenario& one : scenarios) {
    auto drive = made(one);
    if (!drive.ok()) return status_of(drive.error());
    drives.push_back({one, std::move(*drive)});
  }
  if (const Status written = write_truth(options, drives.front().drive, scenario, generation, bar); !written.ok()) {
    log_error(written.error().message);
    return status_of(written.error());
  }
  if (!options.play) return kDone;
  return play(options, drives, signals.asked(), bar);
}

}  // namespace

void add_simulate(Command& all) {
  auto options = std::make_shared<SimulateOptions>();
  Command command = all.command(kSimulate.word, kSimulate.help);
  command.required("SCENARIO", options->scenario,
                   "scenario file (YAML), or the name of one that is installed with the program (street, square, ...)");
  command.required(
      "--out", options->out,
      "folder for drives; each drive is named by the content of its scenario, and an existing one is used again");
  command.option("--write-rig", options->rig_file,
                 "also write the rig file of the emulated vehicle, with its true calibration");
  command.setting("--method", options->method, "with --write-rig: lens or panorama", {"lens", "panorama"});
  command.option("--beside", options->beside,
                 "another scenario of the same drive; its laser is the vehicle's second scanner, on the next ports");
  command.option("--trajectory", options->trajectory_file,
                 "also write the true trajectory as post-processing would deliver it (SBET)");
  command.option("--clocks", options->clocks_file,
                 "also write the true error of every clock, with the scenario's faults (CSV)");
  command.option("--sights", options->sights_file,
                 "also write which exposures truly saw each laser return (docs/formats.md); this takes about as long "
                 "as rendering");
  command.flag("--play", options->play, "emulate the devices: wait for a capture, then play in real time");
  command.setting(
      "--laps", options->laps,
      "with --play: how often to drive it, in one drive; each lap begins where and when the one before ended",
      {1, 100000});
  command.setting("--wait", options->wait_s, "with --play: seconds to wait for the capture");
  command.setting("--address", options->at.address, "address of the emulated devices, to which the laser also sends");
  command.option(
      "--capture-address", options->at.capture_address,
      "address of the computer that captures, if it is another one: the laser and the CAN gateway send to it");
  command.setting("--pps-socket", options->at.pps_socket, "local socket of the PPS edges");
  command.setting("--data-port", options->at.data_port, "UDP port of laser data", {1, 65535});
  command.setting("--position-port", options->at.position_port, "UDP port of laser position packets", {1, 65535});
  command.setting("--pos-port", options->at.pos_port, "TCP port of the POS", {0, 65535});
  command.setting("--can-port", options->at.can_port, "UDP port of the CAN bus, sent as a gateway's datagrams",
                  {1, 65535});
  command.option("--can-interface", options->at.can_interface,
                 "CAN interface on which the bus is emulated, instead of datagrams");
  command.setting("--camera", options->at.camera_serial, "serial number of the GigE camera");
  command.setting("--camera-link", options->camera_link_mb_s,
                  "rate of the camera's packets, MB/s; 0: a link of one gigabit, or of ten if the images need it",
                  {0.0, 1e5});
  command.setting("--camera-packet", options->camera_packet,
                  "size of the camera's largest packet, bytes with IP and UDP headers", {576, 65000});
  command.reads(options->scenario)
      .reads(options->beside)
      .makes(options->out)
      .writes(options->rig_file)
      .writes(options->clocks_file)
      .writes(options->trajectory_file)
      .writes(options->sights_file);
  command.footer(
      "Example: hueline simulate street --out drives/street\n"
      "Exit status: 0; 2 if the scenario is wrong; 4 if the output cannot be written.\n"
      "More: docs/scenario.md");
  command.runs([options] { return simulate(*options); });
}

}  // namespace hueline::apps
